// A search for the owner of a point that may take several dispatches. Needs candidates.glsl.

// Where it stands.
struct OwnerSearch {
    uint cursor; // what has been searched
    Best best;
};

OwnerSearch no_search() { return OwnerSearch(0u, no_best()); }

// The two properties of a candidate in one word, and back.
uint best_bits(Best best) { return uint(best.in_box) | uint(best.inside) << 1; }
Best best_of(uint owner, uint bits, float least) { return Best(owner, (bits & 2u) != 0u, (bits & 1u) != 0u, least); }
