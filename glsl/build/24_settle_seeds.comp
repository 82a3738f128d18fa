#version 460
// Codes, filter 3, with Lists::Boundary: decides about centres on faces, edges or vertices, or too near to them.
// There are few, but each needs a star of tetrahedra; in the previous kernel, every such centre would hold up all lanes
// of a subgroup.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
ARGUMENTS(12)
    uint tets;
    uint capacity; // most shares
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, vec4, vertices)
RECORDS(2, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, readonly, uint, offsets)
BUFFER(5, READ_WRITE, uint, hits)
BUFFER(6, READ_WRITE, uint, counts)
BUFFER(7, readonly, uint, marks)
RECORDS(8, uvec4, neighbours)
BUFFER(9, readonly, uint, doubts)
BUFFER(10, readonly, uint, doubt_count)
BUFFER(11, readonly, uint, shares) // number of shares
#include "shared/cells.glsl"
#include "shared/shares.glsl"
#include "shared/centre.glsl"
#include "shared/best_owner.glsl"
#include "shared/walk.glsl"
#include "shared/marks.glsl"
#include "shared/seeds.glsl"

// Whether t is a seed of an unmarked cell whose centre it does not clearly contain: either it contains the centre and
// no lower-numbered tetrahedron does, or it is near the centre and no tetrahedron contains it.
bool owns_centre(uint t, Weights own, vec3 centre) {
    uint beaten_below = own.inside ? t : NONE;
    star[0] = t;
    star_size = 1u;
    for (uint i = 0u; i < star_size; ++i) {
        uint u = star[i];
        Tet other = load_tet(words(cells.at[u]));
        Weights w = weights(other, centre);
        if (w.inside && u < beaten_below) return false;
        grow_star(u, other, w, centre);
    }
    return true;
}

void main() {
    uint k = item_index();
    if (k >= min(doubt_count.at[0], capacity)) return;
    uint item = doubts.at[k];
    Share share = item < tets ? first_share(item, tets, shares.at[0]) : later_share(item - tets, tets);
    Grid g = grid.at[0];
    CellBox box = coarser(finest_box(share.t), g.level);
    uvec3 at = first_candidate(box, share.first);
    Tet tet = load_tet(words(cells.at[share.t]));
    uint marked, centres, bits = hits.at[share.index], i = 0u;
    sift(g.level, box, at, candidates_of(box, share.first), centres_of(tet, g, box), marked, centres);
    for (centres &= ~bits; centres != 0u; centres &= centres - 1u) {
        uint next = uint(findLSB(centres));
        at = advance(box, at, next - i);
        i = next;
        vec3 centre = centre_of(g, at);
        Weights own = weights(tet, centre);
        if (in_doubt(own) && owns_centre(share.t, own, centre)) bits |= 1u << i;
    }
    hits.at[share.index] = bits;
    counts.at[share.index] = bitCount(bits);
}
