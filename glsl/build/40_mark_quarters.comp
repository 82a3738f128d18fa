#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
// Leaves, 1 of 2 under Lists::Boundary, whose flags are known: the quarters of its leaf's cell that each entry is near to, by which a search passes most of
// a list over, into the top bits of P.
ARGUMENTS(7)
    uint capacity;
    uint id_mask; // bits of an entry that are its primitive
END_ARGUMENTS
BUFFER(0, readonly, uint, entries)
BUFFER16(1, READ_WRITE, Grid, grid)
BUFFER(2, readonly, BuildStatus, status)
BUFFER(3, readonly, uint, codes)
RECORDS(4, uvec4, cells)
BUFFER16(5, readonly, uvec4, quantized) // the vertices, of which the last word is the finest cell
BUFFER(6, READ_WRITE, uint, p)
#include "shared/quarters.glsl"

void main() {
    uint n = min(entries.at[0], capacity), first = first_item();
    if (first == 0u) grid.at[0].ids = id_mask;
    if (first >= n || status.at[0].overflow != 0u) return;
    Grid g = grid.at[0];
    g.ids = id_mask;
    for (uint i = first; i < min(n, first + ROWS); ++i) {
        uvec4 ids = words(cells.at[p.at[i]]);
        uvec3 lo = uvec3(1023u), hi = uvec3(0u);
        for (uint k = 0u; k < 4u; ++k) {
            uvec3 q = unpack_cell(quantized.at[ids[k]].w);
            lo = min(lo, q);
            hi = max(hi, q);
        }
        p.at[i] |= quarters_near(g, codes.at[i], lo, hi);
    }
}
