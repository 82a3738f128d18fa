// Point location in a leaf's list (SPEC 3.1). Twin of `listed` in src/reference/locate.rs. Needs tree.glsl, tet.glsl,
// and flags, cells, vertices.

#include "shared/boundary_node.glsl"
#include "shared/best_owner.glsl"
#include "shared/leaf_slab.glsl"

// Of up to 32 entries from `begin` on and before `end`, those that are near the point's quarters of the leaf's cell,
// one bit each. Most entries fail this test, and most of the others fail that of `near_of`. Each test is done for all
// entries before the next test, so that invocations wait less for each other.
uint in_quarters(uint begin, uint end, Sought s) {
    uint count = min(32u, end - begin), left = 0u;
    for (uint k = 0u; k < count; ++k) left |= uint((p.at[begin + k] & s.quarters) == s.quarters) << k;
    return left;
}

// Of the entries in `left`, those whose quantized box is near the point.
uint near_of(uint begin, uint left, Sought s) {
    uint ids = grid.at[0].ids, near = 0u;
    for (; left != 0u; left &= left - 1u) {
        if (is_near(words(cells.at[p.at[begin + findLSB(left)] & ids]), s)) near |= left & -left;
    }
    return near;
}

uint near_among(uint begin, uint end, Sought s) { return near_of(begin, in_quarters(begin, end, s), s); }

// Considers the entries [begin, end) in order, up to the first that contains the point.
void search(inout Best best, uint begin, uint end, Sought s) {
    for (; begin < end && !best.inside; begin += 32u) {
        for (uint near = near_among(begin, end, s); near != 0u && !best.inside; near &= near - 1u) {
            uint t = listed_tet(begin + findLSB(near));
            Tet tet = load_tet(words(cells.at[t]));
            consider(best, t, tet, weights(tet, s.x));
        }
    }
}

// Whether a point, x in normalised coordinates, is no farther outside of the bounds than it can be from its owner: by 3 t
// times their size, and what rounding adds. Farther away, the weights of a small tetrahedron are nothing but rounding.
bool in_reach(Grid g, vec3 at, vec3 x, float tolerance) {
    precise float grow = min(tolerance, 1e10) * 3.0 + two_to(-16);
    precise vec3 beyond = g.extent.xyz * grow, most = g.extent.xyz + beyond;
    return near_bounds(g, at) && all(greaterThanEqual(x, -beyond)) && all(lessThanEqual(x, most));
}

// The leaf whose tetrahedra may own the point `at`, x in normalised coordinates; NONE if none can.
uint leaf_to_search(Grid g, vec3 at, vec3 x, float tolerance) {
    if (!in_reach(g, at, x, tolerance)) return NONE;
    uvec3 finest = quantize(g, at);
    uint leaf = find_leaf(g.level, finest);
    return leaf == NONE || (leaves_room(g, tolerance) && side_of_slab(g, slab_scale(g), leaf, finest, x) != 0) ? NONE : leaf;
}

// The owner, once the whole list has been searched; NONE if there is none.
uint decide(Best best, uint leaf, float tolerance) {
    if (best.owner == NONE || best.inside) return best.owner;
    return !is_boundary_node(leaf) || best.smallest >= -tolerance ? best.owner : NONE;
}
