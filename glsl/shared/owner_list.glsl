// Point location in a leaf's list (SPEC 3.1). Twin of `listed` in src/reference/locate.rs. Needs tree.glsl, tet.glsl, and flags, cells, vertices.

#include "shared/candidates.glsl"

// Looks at entries [begin, end) in order, ends at the first that contains x.
void search(inout Best best, uint begin, uint end, vec3 x) {
    for (uint i = begin; i < end; ++i) {
        uint t = p.at[i];
        Tet tet = load_tet(cells.at[t]);
        consider(best, t, tet, weights(tet, x));
        if (best.inside) return;
    }
}

bool is_boundary_node(uint node) { return (flags.at[node >> 5u] >> (node & 31u) & 1u) != 0u; }

// The owner after the whole list has been searched.
uint decide(Best best, uint leaf, float tolerance) {
    if (best.owner == NONE || best.inside) return best.owner;
    return !is_boundary_node(leaf) || best.smallest >= -tolerance ? best.owner : NONE;
}
