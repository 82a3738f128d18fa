// Point location in a leaf's list (SPEC 3.1). Twin of `listed` in src/reference/locate.rs. Needs tree.glsl, tet.glsl, and flags, cells, vertices.

#include "shared/candidates.glsl"

// The next entry of [i, end) that is near, `t` its primitive and `cell` the vertices. Most are not: they are passed over here, so that invocations wait for
// each other less.
uint next_near(uint i, uint end, Sought s, out uint t, out uvec4 cell) {
    uint ids = grid.at[0].ids;
    for (; i < end; ++i) {
        uint entry = p.at[i];
        if ((entry >> ID_BITS & s.halves) != s.halves) continue;
        t = entry & ids;
        cell = cells.at[t];
        if (is_near(cell, s)) break;
    }
    return i;
}

// Looks at entries [begin, end) in order, ends at the first that contains the point.
void search(inout Best best, uint begin, uint end, Sought s) {
    uint t;
    uvec4 cell;
    for (uint i = next_near(begin, end, s, t, cell); i < end && !best.inside; i = next_near(i + 1u, end, s, t, cell)) {
        Tet tet = load_tet(cell);
        consider(best, t, tet, weights(tet, s.x));
    }
}

bool is_boundary_node(uint node) { return (flags.at[node >> 5u] >> (node & 31u) & 1u) != 0u; }

// The owner after the whole list has been searched.
uint decide(Best best, uint leaf, float tolerance) {
    if (best.owner == NONE || best.inside) return best.owner;
    return !is_boundary_node(leaf) || best.smallest >= -tolerance ? best.owner : NONE;
}
