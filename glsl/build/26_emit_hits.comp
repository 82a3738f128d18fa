#version 460
// Codes, filter 5: writes the entries of the candidates that were hit.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(10)
    uint tets;
    uint capacity; // most shares
    uint room;     // most entries
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, vec4, vertices)
RECORDS(2, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, readonly, uint, offsets) // index of the first share of every tetrahedron
BUFFER(5, readonly, uint, shares)
BUFFER(6, readonly, uint, hits)
BUFFER(7, readonly, uint, places) // scanned counts of the shares
BUFFER(8, writeonly, uint, codes)
BUFFER(9, writeonly, uint, ids)
#include "shared/cells.glsl"
#include "shared/shares.glsl"

void main() {
    Share share;
    if (!share_of(item_index(), tets, min(shares.at[0], capacity), share)) return;
    uint bits = hits.at[share.index], place = places.at[share.index];
    if (bits == 0u) return;
    Grid g = grid.at[0];
    CellBox box = coarser(finest_box(share.t), g.level);
    uvec3 at = first_candidate(box, share.first);
    uint i = 0u;
    for (; bits != 0u && place < room; bits &= bits - 1u) {
        uint next = uint(findLSB(bits));
        at = advance(box, at, next - i);
        i = next;
        codes.at[place] = morton(at);
        ids.at[place] = share.t;
        ++place;
    }
}
