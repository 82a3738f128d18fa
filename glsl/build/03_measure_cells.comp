#version 460
// Finds out what the boundary needs to know of the shape of each tetrahedron: on which side of its faces it lies, and at
// which of its vertices its corner is thin (SPEC 2.3). Also counts flat, negative and crowded ones.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/corners.glsl"
#include "shared/shapes.glsl"
ARGUMENTS(6)
    uint tets;
    uint tile;  // tetrahedra per workgroup
END_ARGUMENTS
RECORDS(0, vec4, vertices)
RECORDS(1, uvec4, cells)
BUFFER(2, readonly, uint, bad)
BUFFER(3, READ_WRITE, uint, shapes) // see shapes.glsl; zeroed
BUFFER(4, READ_WRITE, uint, thin)   // thin corners at every vertex; zeroed
BUFFER(5, READ_WRITE, MeshStatus, status)
#include "shared/bad.glsl"
#include "shared/vertices.glsl"

void main() {
    uint flat_cells = 0u, negative = 0u;
    uvec2 items = items_of_tile(tile, tets);
    for (uint t = items.x; t < items.y; t += gl_SubgroupSize) {
        if (is_bad(t)) continue;
        uvec4 ids = words(cells.at[t]);
        Tet tet = load_tet(ids);
        float vol = volume(tet);
        uint shape = vol == 0.0 ? FLAT : vol < 0.0 ? MIRRORED : 0u;
        if (shape != 0u) atomicOr(shapes.at[t >> 4u], shape << (2u * (t & 15u)));
        // The sign of the volume in the caller's order of vertices follows from the parity of the permutation.
        uvec4 r = tet.rank;
        uint inversions = uint(r.y < r.x) + uint(r.z < r.x) + uint(r.w < r.x) + uint(r.z < r.y) + uint(r.w < r.y) + uint(r.w < r.z);
        flat_cells += uint(shape == FLAT);
        negative += uint(shape != FLAT && ((shape == MIRRORED) != ((inversions & 1u) != 0u)));
        for (uint corners = thin_corners(tet, vol), f = 0u; corners != 0u && f < 4u; ++f) {
            if ((corners >> r[f] & 1u) != 0u && atomicAdd(thin.at[ids[f]], 1u) == MOST_THIN) atomicAdd(status.at[0].crowded, 1u);
        }
    }
    flat_cells = subgroupAdd(flat_cells);
    negative = subgroupAdd(negative);
    if (subgroupElect()) {
        if (flat_cells > 0u) atomicAdd(status.at[0].zero_volume, flat_cells);
        if (negative > 0u) atomicAdd(status.at[0].negative, negative);
    }
}
