#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
// Codes of all but the paper's lists, 1 of 2: which candidates are entries, and how many. An invocation takes a share of 32 candidates of one
// tetrahedron, a word of answers. Of those that an assignment keeps (SPEC 2.2) STEP LIST_ALL takes all. For Lists::Boundary (2.6) MARK marks the
// cells of boundary primitives; then LIST_MARKED takes what lies in marked cells, and the owners of the centres of others.
layout(constant_id = 2) const uint ASSIGN = 1;
layout(constant_id = 3) const uint STEP = 0;
ARGUMENTS(12)
    uint tets;
    uint capacity; // shares
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER16(1, readonly, uvec4, quantized)
BUFFER16(2, readonly, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER16(4, readonly, vec4, vertices)
BUFFER(5, readonly, uint, offsets) // of the shares of every tetrahedron
BUFFER(6, readonly, uint, shares)  // their number
BUFFER(7, writeonly, uint, hits)   // one bit per candidate
BUFFER(8, writeonly, uint, counts) // hits per share
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

void main() {
    uint share = item_index();
    if (share >= min(shares.at[0], capacity)) return;
    Grid g = grid.at[0];
    uint t = owner_of(share, tets);
    bool inner = STEP != LIST_ALL && (boundary.at[t >> 5u] >> (t & 31u) & 1u) == 0u;
    if (STEP == MARK && inner) return;
    CellBox box = coarser(finest_box(t), g.level);
    uint first = 32u * (share - offsets.at[t]);
    uint n = min(32u, box.size.x * box.size.y * box.size.z - first);
    Tet tet = load_tet(cells.at[t]);
    Filter cell_filter;
    if (ASSIGN != 0u) cell_filter = make_filter(tet, g, g.level, ASSIGN);
    vec3 h = half_cell(g, g.level);
    vec3 lo = min(min(tet.v[0], tet.v[1]), min(tet.v[2], tet.v[3])), hi = max(max(tet.v[0], tet.v[1]), max(tet.v[2], tet.v[3]));
    uvec3 at = first == 0u ? box.lo : candidate(box, first), central;
    uint bits = 0u, centres = 0u;
    for (uint i = 0u; i < n; ++i) {
        uint code = morton(at);
        if (STEP == LIST_MARKED && !is_marked(code)) {
            vec3 centre = cell_centre(h, at);
            if (inner && all(lessThanEqual(lo, centre)) && all(lessThanEqual(centre, hi))) {
                if (centres == 0u) central = at;
                centres |= 1u << i;
            }
        } else if (ASSIGN == 0u || touches(cell_filter, at)) {
            bits |= 1u << i;
            if (STEP == MARK && !is_marked(code)) atomicOr(marks.at[code >> 5u], 1u << (code & 31u));
        }
        at = next_candidate(box, at);
    }
    if (STEP == MARK) return;
    // Apart from the loop above, so that neighbouring invocations, whose centres have other numbers, do this side by side.
    while (centres != 0u) {
        uint i = uint(findLSB(centres));
        if (owns_centre(t, tet, cell_centre(h, central))) bits |= 1u << i;
        centres &= centres - 1u;
        if (centres != 0u) central = candidate(box, first + uint(findLSB(centres)));
    }
    hits.at[share] = bits;
    counts.at[share] = bitCount(bits);
}
