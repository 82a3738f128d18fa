// Candidates are processed in shares of up to SHARE candidates of one tetrahedron. Every tetrahedron has at least one
// share. A dispatch over the first shares of all tetrahedra needs no search; the other shares follow in a second
// dispatch (LATER), which is empty for most meshes; then there are as many shares as tetrahedra. Otherwise offsets, which
// the including kernel declares, are the scanned numbers of shares (tets + 1). Needs cells.glsl.
#include "shared/share.glsl"
layout(constant_id = 3) const uint LATER = 0;

struct Share {
    uint index; // among all shares, in the order of the tetrahedra
    uint t;
    uint first; // its first candidate
};

// The first share of a tetrahedron, where there are `all` shares.
Share first_share(uint t, uint tets, uint all) { return Share(all == tets ? t : offsets.at[t], t, 0u); }

// Share number i among those that are not the first of their tetrahedron.
Share later_share(uint i, uint tets) {
    // The last tetrahedron with at most i such shares before it.
    uint lo = 0u, hi = tets;
    while (hi - lo > 1u) {
        uint mid = lo + (hi - lo) / 2u;
        if (offsets.at[mid] - mid <= i) lo = mid;
        else hi = mid;
    }
    return Share(lo + i + 1u, lo, SHARE * (i - (offsets.at[lo] - lo) + 1u));
}

// The share of invocation i of a dispatch, where there are `all` shares. Returns false if it has none.
bool share_of(uint i, uint tets, uint all, out Share share) {
    if (i >= (LATER == 0u ? tets : all - tets)) return false;
    if (LATER == 0u) share = first_share(i, tets, all);
    else share = later_share(i, tets);
    return share.index < all;
}

// The candidate `by` places after `at`, for `by` up to SHARE, found by steps instead of the divisions of `candidate`.
uvec3 advance(CellBox box, uvec3 at, uint by) {
    uvec3 end = box.lo + box.size;
    at.x += by;
    while (at.x >= end.x) {
        at.x -= box.size.x;
        at.y += 1u;
        bool slab = at.y == end.y;
        at.y = slab ? box.lo.y : at.y;
        at.z += uint(slab);
    }
    return at;
}

uvec3 first_candidate(CellBox box, uint first) { return LATER == 0u || first == 0u ? box.lo : candidate(box, first); }

uint candidates_of(CellBox box, uint first) { return min(SHARE, box.size.x * box.size.y * box.size.z - first); }
