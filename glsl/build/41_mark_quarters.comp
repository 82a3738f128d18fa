#version 460
// Leaves 1, with Lists::Boundary, whose boundary flags follow from marks: writes into the top bits of every entry of P
// which quarters of its leaf's cell the entry is near, so that a search can skip most of a list.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(7)
    uint capacity;
END_ARGUMENTS
BUFFER(0, readonly, uint, entries)
GRID(1, readonly)
BUFFER(2, readonly, BuildStatus, status)
BUFFER(3, readonly, uint, codes)
RECORDS(4, uvec4, cells)
RECORDS(5, vec4, vertices)
BUFFER(6, READ_WRITE, uint, p)
#include "shared/quarters.glsl"
#include "shared/spanned.glsl"

void main() {
    uvec2 items = items_of_tile(WORKGROUP * ROWS, min(entries.at[0], capacity));
    if (status.at[0].overflow != 0u) return;
    Grid g = grid.at[0];
    for (uint i = items.x; i < items.y; i += gl_SubgroupSize) {
        uvec3 lo, hi;
        cells_spanned(words(cells.at[p.at[i]]), lo, hi);
        p.at[i] |= quarters_near(g, codes.at[i], lo, hi);
    }
}
