#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
// Codes of all but the paper's lists, 1 of 2: which candidates are entries, 32 bits to a word, and how many. Of those that an assignment keeps
// (SPEC 2.2) STEP LIST_ALL takes all. For Lists::Boundary (2.6) MARK marks the cells of boundary primitives; then LIST_MARKED takes what lies in
// marked cells, and the owners of the centres of others.
layout(constant_id = 2) const uint ASSIGN = 1;
layout(constant_id = 3) const uint STEP = 0;
ARGUMENTS(12)
    uint tets;
    uint stride;
    uint capacity;
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER(1, readonly, float, positions)
BUFFER16(2, readonly, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER16(4, readonly, vec4, vertices)
BUFFER(5, readonly, uint, offsets)
BUFFER(6, readonly, uint, candidates)
BUFFER(7, writeonly, uint, hits)   // one bit per candidate
BUFFER(8, writeonly, uint, counts) // hits per word
BUFFER(9, READ_WRITE, uint, marks) // one bit per cell of the level of the leaves, zeroed
BUFFER(10, readonly, uint, boundary)
BUFFER16(11, readonly, uvec4, neighbours)
#include "shared/cells.glsl"
#include "shared/owner.glsl"
#include "shared/assign.glsl"
#include "shared/candidates.glsl"
#include "shared/walk.glsl"
#include "shared/marks.glsl"

const uint LIST_ALL = 0u;
const uint MARK = 1u;
const uint LIST_MARKED = 2u;

// The primitive of the candidates at hand.
uint t;
CellBox box;
Tet tet;
Filter cell_filter;
bool inner; // no boundary primitive
vec3 lo, hi;

void load_primitive(Grid g) {
    box = coarser(finest_box(g, t, stride), g.level);
    if (STEP != LIST_ALL) inner = (boundary.at[t >> 5u] >> (t & 31u) & 1u) == 0u;
    if (STEP == MARK && inner) return;
    tet = load_tet(cells.at[t]);
    if (ASSIGN != 0u) cell_filter = make_filter(tet, g, g.level, ASSIGN);
    lo = min(min(tet.v[0], tet.v[1]), min(tet.v[2], tet.v[3]));
    hi = max(max(tet.v[0], tet.v[1]), max(tet.v[2], tet.v[3]));
}

bool is_listed(uvec3 cell, uint code, vec3 h) {
    if (STEP == LIST_MARKED && !is_marked(code)) {
        if (!inner) return false;
        vec3 centre = cell_centre(h, cell);
        return all(lessThanEqual(lo, centre)) && all(lessThanEqual(centre, hi)) && owns_centre(t, tet, centre);
    }
    return ASSIGN == 0u || touches(cell_filter, cell);
}

void main() {
    uint n = min(candidates.at[0], capacity);
    uint word = item_index();
    uint first = 32u * word;
    if (first >= n) return;
    uint end = min(n, first + 32u);
    Grid g = grid.at[0];
    vec3 h = half_cell(g, g.level);
    t = owner_of(first, tets);
    uint next = offsets.at[t + 1u];
    load_primitive(g);
    uvec3 at = candidate(box, first - offsets.at[t]);
    uint bits = 0u;
    for (uint i = first; i < end; ++i) {
        if (i >= next) {
            while (next <= i && t + 1u < tets) next = offsets.at[++t + 1u];
            load_primitive(g);
            at = box.lo;
        }
        if (STEP == MARK && inner) {
            i = next - 1u;
            continue;
        }
        uint code = STEP == LIST_ALL ? 0u : morton(at);
        if (is_listed(at, code, h)) {
            if (STEP == MARK && !is_marked(code)) atomicOr(marks.at[code >> 5u], 1u << (code & 31u));
            bits |= 1u << (i - first);
        }
        at = next_candidate(box, at);
    }
    if (STEP == MARK) return;
    hits.at[word] = bits;
    counts.at[word] = bitCount(bits);
}
