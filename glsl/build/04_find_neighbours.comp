#version 460
// Turns the mates of faces into neighbours, in place, and sets boundary bits (SPEC 2.3).
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/mates.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/corners.glsl"
ARGUMENTS(7)
    uint tets;
    uint share; // tetrahedra per workgroup
END_ARGUMENTS
BUFFER(0, readonly, uint, bad)
BUFFER(1, readonly, uint, flat_cells) // one bit per tetrahedron, set if it has no volume
BUFFER16(2, READ_WRITE, uvec4, neighbours) // mates on entry
BUFFER(3, READ_WRITE, uint, boundary) // one bit per tetrahedron, zeroed
BUFFER(4, READ_WRITE, MeshStatus, status)
RECORDS(5, uvec4, cells)
BUFFER(6, readonly, uint, thin) // thin corners at every vertex
#include "shared/bad.glsl"

bool is_flat(uint t) { return (flat_cells.at[t >> 5u] >> (t & 31u) & 1u) != 0u; }

bool is_crowded(uint t) {
    uvec4 v = words(cells.at[t]);
    return max(max(thin.at[v.x], thin.at[v.y]), max(thin.at[v.z], thin.at[v.w])) > MOST_THIN;
}

void main() {
    uint boundary_cells = 0u;
    bool any_crowded = status.at[0].crowded > 0u;
    uvec2 items = items_of_share(share, tets);
    for (uint t = items.x; t < items.y; t += gl_SubgroupSize) {
        uint on_boundary = 0u;
        uvec4 mates = neighbours.at[t], across = uvec4(NONE);
        if (!is_bad(t)) {
            for (uint f = 0u; f < 4u; ++f) {
                bool paired = mates[f] != ALONE && mates[f] != CROWDED;
                if (paired) across[f] = face_of_mate(mates[f]) >> 2;
                // Two tetrahedra on the same side of a face are a fold, unless one of them is flat: a flat one lies on
                // no side.
                bool same_side = paired && (mates[f] & SIDE) != 0u;
                if (!paired || (same_side && !is_flat(across[f]))) on_boundary = 1u;
            }
            if (is_flat(t) || (any_crowded && is_crowded(t))) on_boundary = 1u;
            if (on_boundary != 0u) atomicOr(boundary.at[t >> 5u], 1u << (t & 31u));
        }
        neighbours.at[t] = across;
        boundary_cells += on_boundary;
    }
    boundary_cells = subgroupAdd(boundary_cells);
    if (boundary_cells > 0u && subgroupElect()) atomicAdd(status.at[0].boundary, boundary_cells);
}
