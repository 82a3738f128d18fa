// Point location in the structure of structure.glsl.
#ifdef BINARY_TREE
#include "shared/binary_owner.glsl"
#include "shared/stride.glsl"
#else
layout(constant_id = 4) const uint LISTS = 0;
#include "shared/tree.glsl"
#include "shared/owner_list.glsl"
#include "shared/owner_walk.glsl"
#include "shared/owner_search.glsl"

// Continues a search for the owner of the point `at`, `x` in normalised coordinates, in the leaf around it. Returns false
// if the budget is spent before the search has ended.
bool find_owner_in(inout OwnerSearch s, Grid g, uint leaf, vec3 at, vec3 x, float tolerance, inout uint work, uint budget, out uint owner) {
    owner = NONE;
    uvec2 range = entry_range(leaf);
    if (s.cursor == 0u) {
        uint before = walked_tets;
        s.best = walked(g, leaf, range, at, x);
        work += walked_tets - before;
    }
    if (!s.best.inside && !walks_in(leaf, range)) {
        uint begin = range.x + s.cursor, end = min(range.y, begin + max(budget - min(work, budget), 1u));
        search(s.best, begin, end, sought_at(g, at, x, tolerance));
        work += end - begin;
        s.cursor = end - range.x;
        if (!s.best.inside && end < range.y) return false;
    }
    owner = decide(s.best, leaf, tolerance);
    s = no_search();
    return true;
}

// The same, of a point anywhere.
bool find_owner(inout OwnerSearch s, Grid g, vec3 at, vec3 x, float tolerance, inout uint work, uint budget, out uint owner) {
    owner = NONE;
    uint leaf = leaf_to_search(g, at, x, tolerance);
    return leaf == NONE || find_owner_in(s, g, leaf, at, x, tolerance, work, budget, owner);
}
#endif
