#version 460
// Overlap (SPEC 3.5), step 1: finds the vertices that lie in the other mesh: those in the cell of a non-boundary leaf,
// and those that a tetrahedron in the list of a boundary leaf contains. Lists are searched in parts of at most
// PART_LENGTH entries per dispatch. Twin of src/reference/overlap.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/tree_buffers.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
layout(constant_id = 2) const uint PART_LENGTH = 16384;
ARGUMENTS(13)
    uint points;
    uint stride; // floats from one point to the next
    uint part;  // number of this dispatch
END_ARGUMENTS
TREE(0) // of the other mesh, like all up to `vertices`
RECORDS(6, uvec4, cells)
RECORDS(7, vec4, vertices)
BUFFER(8, readonly, float, own_positions)
BUFFER(9, readonly, uint, used)
BUFFER(10, READ_WRITE, uint, places) // 1: in the other mesh
BUFFER(11, READ_WRITE, uint, around) // one bit per tetrahedron of the other mesh: it contains a vertex of this one
BUFFER(12, READ_WRITE, OverlapStatus, status)
#include "shared/tree.glsl"
#include "shared/owner_list.glsl"

void main() {
    if (part > 0u && part * PART_LENGTH >= grid.at[0].longest) return; // all lists have ended
    uint i = item_index();
    uint located = 0u;
    bool look = i < points && status.at[0].empty == 0u && (used.at[i >> 5u] >> (i & 31u) & 1u) != 0u;
    if (look && part > 0u) look = places.at[i] == 0u;
    if (i < points && part == 0u) places.at[i] = 0u;
    if (look) {
        Grid g = grid.at[0];
        vec3 x = vec3(own_positions.at[i * stride], own_positions.at[i * stride + 1u], own_positions.at[i * stride + 2u]);
        x = vec3(canonical(x.x), canonical(x.y), canonical(x.z));
        bool within = all(lessThanEqual(g.lo.xyz, x)) && all(lessThanEqual(x, g.hi.xyz));
        uvec3 finest = quantize(g, x);
        uint leaf = within ? find_leaf(g.level, finest) : NONE;
        if (leaf != NONE && !is_boundary_node(leaf)) {
            places.at[i] = 1u;
        } else if (leaf != NONE) {
            located = uint(part == 0u);
            vec3 place = normalise(g, x);
            Sought sought = sought_at(g, x, place, 0.0);
            uvec2 range = side_of_slab(g, slab_scale(g), leaf, finest, place) != 0 ? uvec2(0u) : entry_range(leaf);
            uint begin = min(range.y, range.x + part * PART_LENGTH), end = min(range.y, begin + PART_LENGTH);
            bool inside = false;
            for (; begin < end && !inside; begin += 32u) {
                for (uint near = near_among(begin, end, sought); near != 0u && !inside; near &= near - 1u) {
                    uint t = listed_tet(begin + findLSB(near));
                    inside = weights(load_tet(words(cells.at[t])), sought.x).inside;
                    if (inside) atomicOr(around.at[t >> 5u], 1u << (t & 31u));
                }
            }
            places.at[i] = uint(inside);
        }
    }
    located = subgroupAdd(located);
    if (subgroupElect() && located > 0u) atomicAdd(status.at[0].located, located);
}
