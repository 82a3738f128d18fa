#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/ordered.glsl"
// Bad cells (SPEC 2.3), and the bounds of the vertices that valid cells use. Floats are ordered as unsigned keys: no rounding, and
// the order of atomics does not matter.
ARGUMENTS(4)
    uint tets;
    uint points;
    uint stride;  // floats from one point to the next
    uint groups;  // workgroups of this dispatch; each invocation takes every (groups * WORKGROUP)-th tetrahedron
END_ARGUMENTS
BUFFER(0, readonly, float, positions)
RECORDS(1, uvec4, cells)
BUFFER(2, READ_WRITE, uint, bad) // one bit per tetrahedron, zeroed
BUFFER(3, READ_WRITE, MeshStatus, status)

const uint LIMIT = (125u + 127u) << 23; // coordinates from 2^125 on count as infinite

// A key; denormals count as 0.
uint key_of(float x) {
    uint bits = floatBitsToUint(x);
    return ordered((bits & 0x7f800000u) == 0u ? 0u : bits);
}

void main() {
    // No arrays as in `MeshStatus`: the optimiser would give them its type, layout included, which local variables must not have.
    uvec3 lo = uvec3(0u), hi = uvec3(0u);
    uint bad_cells = 0u;
    for (uint t = item_index(); t < tets; t += groups * WORKGROUP) {
        uvec4 v = words(cells.at[t]);
        bool ok = max(max(v.x, v.y), max(v.z, v.w)) < points && v.x != v.y && v.x != v.z && v.x != v.w && v.y != v.z && v.y != v.w && v.z != v.w;
        uvec3 tl = uvec3(0u), th = uvec3(0u);
        for (uint i = 0u; ok && i < 4u; ++i) {
            for (uint c = 0u; c < 3u; ++c) {
                float x = positions.at[v[i] * stride + c];
                ok = ok && (floatBitsToUint(x) & 0x7fffffffu) < LIMIT;
                tl[c] = max(tl[c], ~key_of(x));
                th[c] = max(th[c], key_of(x));
            }
        }
        if (ok) {
            lo = max(lo, tl);
            hi = max(hi, th);
        } else {
            atomicOr(bad.at[t >> 5u], 1u << (t & 31u));
            bad_cells += 1u;
        }
    }
    bad_cells = subgroupAdd(bad_cells);
    lo = subgroupMax(lo);
    hi = subgroupMax(hi);
    if (subgroupElect()) {
        if (bad_cells > 0u) atomicAdd(status.at[0].bad, bad_cells);
        for (uint c = 0u; c < 3u; ++c) {
            if (lo[c] != 0u) atomicMax(status.at[0].lo[c], lo[c]);
            if (hi[c] != 0u) atomicMax(status.at[0].hi[c], hi[c]);
        }
    }
}
