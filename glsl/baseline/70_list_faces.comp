#version 460
// Ray tracing baseline: lists every face of a mesh once, with the tetrahedra on either side (Wald et al. 2019). FILL 0
// counts, FILL 1 writes.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
layout(constant_id = 2) const uint FILL = 0;
ARGUMENTS(8)
    uint tets;
END_ARGUMENTS
RECORDS(0, vec4, vertices)
RECORDS(1, uvec4, cells)
BUFFER(2, readonly, uint, bad)
BUFFER16(3, readonly, uvec4, neighbours)
BUFFER(4, READ_WRITE, uint, places)  // FILL 0: faces of each tetrahedron; FILL 1: number of its first face
BUFFER(5, writeonly, uint, indices)  // three vertices per face
ALIGNED_BUFFER(8, 6, writeonly, uvec2, sides) // tetrahedra in front of and behind each face, or NONE
BUFFER(7, READ_WRITE, uint, longest) // bits of a length that no edge exceeds, zeroed
#include "shared/bad.glsl"
#include "shared/vertices.glsl"

void main() {
    uint t = item_index();
    uint reach = 0u;
    if (t < tets) {
        uint place = FILL != 0u ? places.at[t] : 0u;
        if (!is_bad(t)) {
            uvec4 v = words(cells.at[t]), across = neighbours.at[t];
            for (uint f = 0u; f < 4u; ++f) {
                if (across[f] != NONE && across[f] < t) continue;
                if (FILL != 0u) {
                    uvec3 face = f == 0u ? v.yzw : f == 1u ? v.xzw : f == 2u ? v.xyw : v.xyz;
                    vec3 a = vertex(face.x), b = vertex(face.y), c = vertex(face.z);
                    bool turned = orient(a, b, c, vertex(v[f])) < 0.0;
                    indices.at[3u * place] = face.x;
                    indices.at[3u * place + 1u] = turned ? face.z : face.y;
                    indices.at[3u * place + 2u] = turned ? face.y : face.z;
                    sides.at[place] = uvec2(t, across[f]);
                }
                ++place;
            }
            vec3 a = vertex(v.x), b = vertex(v.y), c = vertex(v.z), d = vertex(v.w);
            vec3 size = max(max(a, b), max(c, d)) - min(min(a, b), min(c, d));
            reach = floatBitsToUint(size.x + size.y + size.z);
        }
        if (FILL == 0u) places.at[t] = place;
    }
    if (FILL == 0u) {
        reach = subgroupMax(reach);
        if (subgroupElect()) atomicMax(longest.at[0], reach);
    }
}
