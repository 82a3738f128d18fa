// A tree as queries see it (SPEC 2.5). The including kernel declares grid, masks, co, po, p and, where used, flags,
// cells, vertices.

#include "shared/children.glsl"

// The leaf that contains a cell of the finest grid, found by descent over child masks. NONE if there is none, or if
// none of its tetrahedra is near the cell.
uint find_leaf(uint level, uvec3 finest) {
    uint code = morton(finest), leaf = find_node(0u, 0u, level, code >> (3u * (MAX_LEVEL - level)));
    if (leaf == NONE || level == MAX_LEVEL) return leaf;
    return (child_mask(leaf) >> (code >> (3u * (MAX_LEVEL - 1u - level)) & 7u) & 1u) != 0u ? leaf : NONE;
}

// The level of the largest cell around a finest-grid cell, given by its code, that no tetrahedron is near: a missing
// node, or an octant of a leaf. 0 if there is none; `node`, the node of level `from` around it, then becomes the leaf.
uint empty_level(uint level, uint code, uint from, inout uint node) {
    for (uint at = from + 1u; at <= min(level + 1u, MAX_LEVEL); ++at) {
        uint digit = code >> (3u * (MAX_LEVEL - at)) & 7u, mask = child_mask(node);
        if ((mask >> digit & 1u) == 0u) return at;
        if (at <= level) node = child_of(node, mask, digit);
    }
    return 0u;
}

// The tetrahedron of an entry; the bits above it are quarters.
uint listed_tet(uint entry) { return p.at[entry] & grid.at[0].ids; }

// The first entry of a leaf, and one past its last.
uvec2 entry_range(uint leaf) {
    uint i = leaf - grid.at[0].first_leaf;
    return uvec2(po.at[i], po.at[i + 1u]);
}

// Whether the tree holds nothing: one without tetrahedra, or one that did not fit.
bool is_empty_tree(uint level) { return level == 0u ? entry_range(0u).y == 0u : child_mask(0u) == 0u; }
