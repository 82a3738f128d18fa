#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
// Codes of all but the paper's lists, 2 of 2: the entries of the candidates that were hit.
ARGUMENTS(10)
    uint tets;
    uint capacity; // shares
    uint room;     // entries
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER16(1, readonly, uvec4, quantized)
BUFFER16(2, readonly, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, readonly, uint, offsets) // of the shares
BUFFER(5, readonly, uint, shares)
BUFFER(6, readonly, uint, hits)
BUFFER(7, readonly, uint, places) // scanned counts of the shares
BUFFER(8, writeonly, uint, codes)
BUFFER(9, writeonly, uint, ids)
#include "shared/cells.glsl"
#include "shared/owner.glsl"

void main() {
    uint share = item_index();
    if (share >= min(shares.at[0], capacity)) return;
    uint bits = hits.at[share], place = places.at[share];
    if (bits == 0u) return;
    Grid g = grid.at[0];
    uint t = owner_of(share, tets);
    CellBox box = coarser(finest_box(t), g.level);
    uint first = 32u * (share - offsets.at[t]);
    uvec3 at = first == 0u ? box.lo : candidate(box, first);
    for (; bits != 0u && place < room; bits >>= 1) {
        if ((bits & 1u) != 0u) {
            codes.at[place] = morton(at);
            ids.at[place] = t;
            ++place;
        }
        at = next_candidate(box, at);
    }
}
