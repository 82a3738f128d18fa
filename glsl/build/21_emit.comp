#version 460
// Codes, emit all candidates (Lists::All with Aabb): every invocation writes a run of ROWS entries, whichever
// tetrahedra they belong to, so that a large tetrahedron among small ones does not become a long loop.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(8)
    uint tets;
    uint capacity;
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, vec4, vertices)
RECORDS(2, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, readonly, uint, offsets)
BUFFER(5, readonly, uint, candidates)
BUFFER(6, writeonly, uint, codes)
BUFFER(7, writeonly, uint, ids)
#include "shared/cells.glsl"
#include "shared/tet_of_candidate.glsl"

void main() {
    uint n = min(candidates.at[0], capacity);
    uint first = first_item();
    if (first >= n) return;
    uint end = min(n, first + ROWS);
    Grid g = grid.at[0];
    uint t = tet_of_candidate(first, tets);
    uint next = offsets.at[t + 1u];
    CellBox box = coarser(finest_box(t), g.level);
    uvec3 at = candidate(box, first - offsets.at[t]);
    for (uint i = first; i < end; ++i) {
        if (i >= next) {
            // Most tetrahedra have candidates. A long stretch of bad ones, which have none, must not become a long
            // loop.
            t = min(t + 1u, tets - 1u);
            if (offsets.at[t + 1u] <= i) t = tet_of_candidate(i, tets);
            next = offsets.at[t + 1u];
            box = coarser(finest_box(t), g.level);
            at = box.lo;
        }
        codes.at[i] = morton(at);
        ids.at[i] = t;
        at = next_candidate(box, at);
    }
}
