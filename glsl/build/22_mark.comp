#version 460
// Codes, filter 1, with Lists::Boundary (SPEC 2.6): marks the cells that boundary tetrahedra touch. An invocation
// takes a few tetrahedra, of which hardly any are on the boundary, and marks the first share of each; with LATER, it
// takes one other share.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
layout(constant_id = 2) const uint ASSIGN = 0;
layout(constant_id = 4) const uint TETS_EACH = 32; // per invocation: 32 where there are few, 8 where there are thousands
ARGUMENTS(8)
    uint tets;
    uint capacity; // most shares
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, vec4, vertices)
RECORDS(2, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, readonly, uint, offsets) // index of the first share of every tetrahedron
BUFFER(5, readonly, uint, shares)  // number of shares
BUFFER(6, READ_WRITE, uint, marks) // one bit per cell of the level of the leaves; zeroed
BUFFER(7, readonly, uint, boundary)
#include "shared/cells.glsl"
#include "shared/shares.glsl"
#include "shared/assign.glsl"
#include "shared/touching.glsl"
#include "shared/best_owner.glsl"
#include "shared/marks.glsl"
#include "shared/boundary_tet.glsl"

void mark_word(uint word, uint bits) {
    if ((bits & ~marks.at[word]) != 0u) atomicOr(marks.at[word], bits);
}

void mark(Grid g, uint t, uint first) {
    CellBox box = coarser(finest_box(t), g.level);
    uvec3 at = first_candidate(box, first);
    Tet tet;
    if (ASSIGN != 0u) tet = load_tet(words(cells.at[t]));
    uint run;
    for (uint n = candidates_of(box, first); n > 0u; n -= run) {
        run = min(n, box.lo.x + box.size.x - at.x);
        uint row = low_bits(run);
        if (ASSIGN != 0u) row = touching(tet, g, ASSIGN, box, at, row);
        uint place = mark_place(g.level, at), shift = place & 31u;
        mark_word(place >> 5u, row << shift);
        if (shift + run > 32u) mark_word((place >> 5u) + 1u, row >> (32u - shift));
        at.x += run - 1u;
        at = next_candidate(box, at);
    }
}

void main() {
    Grid g = grid.at[0];
    if (LATER != 0u) {
        Share share;
        if (!share_of(item_index(), tets, min(shares.at[0], capacity), share)) return;
        if (is_boundary_tet(share.t)) mark(g, share.t, share.first);
        return;
    }
    uint first = TETS_EACH * item_index();
    if (first >= tets) return;
    uint bits = boundary.at[first >> 5u] >> (first & 31u) & low_bits(TETS_EACH);
    for (; bits != 0u; bits &= bits - 1u) mark(g, first + uint(findLSB(bits)), 0u);
}
