#version 460
// Finds bad tetrahedra (SPEC 2.3) and the bounds of the vertices that valid tetrahedra use. Floats are compared as
// ordered unsigned keys: nothing is rounded, and the order of the atomic operations does not matter.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/ordered.glsl"
ARGUMENTS(4)
    uint tets;
    uint points;
    uint stride;  // floats from one point to the next
    uint tile;    // tetrahedra per workgroup
END_ARGUMENTS
BUFFER(0, readonly, float, positions)
RECORDS(1, uvec4, cells)
BUFFER(2, READ_WRITE, uint, bad) // one bit per tetrahedron, zeroed
BUFFER(3, READ_WRITE, MeshStatus, status)

#include "shared/positions.glsl"

const uint LIMIT = (125u + 127u) << 23; // coordinates of magnitude 2^125 and more count as infinite

uvec3 magnitude(vec3 x) { return floatBitsToUint(x) & 0x7fffffffu; }

// The ordered key of a float. Denormals count as 0.
uint key_of(float x) {
    uint bits = floatBitsToUint(x);
    return ordered((bits & 0x7f800000u) == 0u ? 0u : bits);
}

void main() {
    const float FAR = uintBitsToFloat(LIMIT);
    vec3 lo = vec3(FAR), hi = vec3(-FAR);
    uint bad_cells = 0u;
    uvec2 items = items_of_tile(tile, tets);
    for (uint t = items.x; t < items.y; t += gl_SubgroupSize) {
        uvec4 v = words(cells.at[t]);
        bool ok = max(max(v.x, v.y), max(v.z, v.w)) < points && v.x != v.y && v.x != v.z && v.x != v.w && v.y != v.z && v.y != v.w && v.z != v.w;
        if (ok) {
            vec3 a = position(v.x, stride), b = position(v.y, stride), c = position(v.z, stride), d = position(v.w, stride);
            ok = all(lessThan(max(max(magnitude(a), magnitude(b)), max(magnitude(c), magnitude(d))), uvec3(LIMIT)));
            if (ok) {
                lo = min(lo, min(min(a, b), min(c, d)));
                hi = max(hi, max(max(a, b), max(c, d)));
            }
        }
        if (!ok) {
            atomicOr(bad.at[t >> 5u], 1u << (t & 31u));
            bad_cells += 1u;
        }
    }
    bad_cells = subgroupAdd(bad_cells);
    lo = subgroupMin(lo);
    hi = subgroupMax(hi);
    if (subgroupElect()) {
        if (bad_cells > 0u) atomicAdd(status.at[0].bad, bad_cells);
        for (uint c = 0u; hi.x > -FAR && c < 3u; ++c) {
            atomicMax(status.at[0].lo[c], ~key_of(lo[c]));
            atomicMax(status.at[0].hi[c], key_of(hi[c]));
        }
    }
}
