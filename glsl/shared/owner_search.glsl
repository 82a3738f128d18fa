// A search for the owner of a point that may take several dispatches. Needs best_owner.glsl.

// The state of such a search.
struct OwnerSearch {
    uint cursor; // entries already searched, or the place in the binary tree where the walk resumes
    Best best;
};

OwnerSearch no_search() { return OwnerSearch(0u, no_best()); }

// Packs the two flags of a candidate into one word, and unpacks them.
uint best_bits(Best best) { return uint(best.in_box) | uint(best.inside) << 1; }
Best best_of(uint owner, uint bits, float least) { return Best(owner, (bits & 2u) != 0u, (bits & 1u) != 0u, least); }
