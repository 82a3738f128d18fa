#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
// Codes of Planes and Exact, 2 of 2: the entries of the candidates that were hit.
ARGUMENTS(10)
    uint tets;
    uint stride;
    uint capacity; // candidates
    uint room;     // entries
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER(1, readonly, float, positions)
BUFFER16(2, readonly, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, readonly, uint, offsets)
BUFFER(5, readonly, uint, candidates)
BUFFER(6, readonly, uint, hits)
BUFFER(7, readonly, uint, places) // scanned counts of the words
BUFFER(8, writeonly, uint, codes)
BUFFER(9, writeonly, uint, ids)
#include "shared/cells.glsl"
#include "shared/owner.glsl"

void main() {
    uint n = min(candidates.at[0], capacity);
    uint word = item_index();
    uint first = 32u * word;
    if (first >= n) return;
    Grid g = grid.at[0];
    uint bits = hits.at[word], place = places.at[word];
    if (bits == 0u) return;
    uint t = owner_of(first + uint(findLSB(bits)), tets);
    uint begin = offsets.at[t], next = offsets.at[t + 1u];
    CellBox box = coarser(finest_box(g, t, stride), g.level);
    for (; bits != 0u && place < room; bits &= bits - 1u) {
        uint i = first + uint(findLSB(bits));
        if (i >= next) {
            while (next <= i && t + 1u < tets) next = offsets.at[++t + 1u];
            begin = offsets.at[t];
            box = coarser(finest_box(g, t, stride), g.level);
        }
        codes.at[place] = morton(candidate(box, i - begin));
        ids.at[place] = t;
        ++place;
    }
}
