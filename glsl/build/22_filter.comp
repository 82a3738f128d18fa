#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
// Codes of Planes and Exact, 1 of 2 (SPEC 2.2): which candidates their tetrahedra touch, 32 bits to a word, and how many.
layout(constant_id = 2) const uint ASSIGN = 1;
ARGUMENTS(9)
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
#include "shared/cells.glsl"
#include "shared/owner.glsl"
#include "shared/assign.glsl"

Filter filter_of(Grid g, uint t) {
    uvec4 ids = cells.at[t];
    Tet tet = make_tet(ids, vertices.at[ids.x].xyz, vertices.at[ids.y].xyz, vertices.at[ids.z].xyz, vertices.at[ids.w].xyz);
    return make_filter(tet, g, g.level, ASSIGN);
}

void main() {
    uint n = min(candidates.at[0], capacity);
    uint word = item_index();
    uint first = 32u * word;
    if (first >= n) return;
    uint end = min(n, first + 32u);
    Grid g = grid.at[0];
    uint t = owner_of(first, tets);
    uint next = offsets.at[t + 1u];
    CellBox box = coarser(finest_box(g, t, stride), g.level);
    uvec3 at = candidate(box, first - offsets.at[t]);
    Filter f = filter_of(g, t);
    uint bits = 0u;
    for (uint i = first; i < end; ++i) {
        if (i >= next) {
            while (next <= i && t + 1u < tets) next = offsets.at[++t + 1u];
            box = coarser(finest_box(g, t, stride), g.level);
            at = box.lo;
            f = filter_of(g, t);
        }
        if (touches(f, at)) bits |= 1u << (i - first);
        at = next_candidate(box, at);
    }
    hits.at[word] = bits;
    counts.at[word] = bitCount(bits);
}
