#version 460
// Codes, filter 2: decides which candidates are entries, and counts them. An invocation
// takes a share of up to 32 candidates of one tetrahedron, and answers with one word. With LISTS 0, the entries are the
// candidates that the assignment keeps (SPEC 2.2). Otherwise (SPEC 2.6) they are those of them that lie in marked
// cells, and the unmarked cells whose centre a non-boundary tetrahedron clearly contains; centres in doubt are left to
// the next kernel.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
layout(constant_id = 2) const uint ASSIGN = 1;
layout(constant_id = 4) const uint LISTS = 0; // 1: marked cells and seeds
ARGUMENTS(12)
    uint tets;
    uint capacity; // most shares
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, vec4, vertices)
RECORDS(2, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, readonly, uint, offsets) // index of the first share of every tetrahedron
BUFFER(5, readonly, uint, shares)  // number of shares
BUFFER(6, writeonly, uint, hits)   // one bit per candidate
BUFFER(7, writeonly, uint, counts) // hits per share
BUFFER(8, readonly, uint, marks)
BUFFER(9, readonly, uint, boundary)
BUFFER(10, writeonly, uint, doubts)       // shares with centres in doubt: t for a first share, tets + i for another
BUFFER(11, READ_WRITE, uint, doubt_count) // zeroed
#include "shared/cells.glsl"
#include "shared/shares.glsl"
#include "shared/assign.glsl"
#include "shared/touching.glsl"
#include "shared/best_owner.glsl"
#include "shared/marks.glsl"
#include "shared/boundary_tet.glsl"
#include "shared/seeds.glsl"

void main() {
    uint item = item_index();
    Share share;
    if (!share_of(item, tets, min(shares.at[0], capacity), share)) return;
    Grid g = grid.at[0];
    uint t = share.t;
    CellBox box = coarser(finest_box(t), g.level);
    uint n = candidates_of(box, share.first);
    if (n == 0u) { // a bad tetrahedron
        hits.at[share.index] = 0u;
        counts.at[share.index] = 0u;
        return;
    }
    uvec3 at = first_candidate(box, share.first);
    Tet tet = load_tet(words(cells.at[t]));
    uint bits = low_bits(n), centres = 0u;
    if (LISTS != 0u) {
        sift(g.level, box, at, n, centres_of(tet, g, box), bits, centres);
        if (is_boundary_tet(t)) centres = 0u;
    }
    // Inside the mesh no candidate is marked, and no planes need to be made.
    if (ASSIGN != 0u && bits != 0u) bits = touching(tet, g, ASSIGN, box, at, bits);
    bool doubt = false;
    uint i = 0u;
    for (; centres != 0u; centres &= centres - 1u) {
        uint next = uint(findLSB(centres));
        at = advance(box, at, next - i);
        i = next;
        Weights own = weights(tet, centre_of(g, at));
        if (own.clear) bits |= 1u << i;
        doubt = doubt || in_doubt(own);
    }
    hits.at[share.index] = bits;
    counts.at[share.index] = bitCount(bits);
    if (doubt) doubts.at[atomicAdd(doubt_count.at[0], 1u)] = LATER == 0u ? item : tets + item;
}
