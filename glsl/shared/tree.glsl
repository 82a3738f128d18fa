// A tree as queries see it (SPEC 2.5). The including kernel declares: grid, masks, co, po, p, and where used flags, cells, vertices.

uint child_mask(uint node) { return masks.at[node >> 2u] >> (8u * (node & 3u)) & 0xffu; }

uint child_of(uint node, uint mask, uint digit) { return co.at[node] + 1u + bitCount(mask & ((1u << digit) - 1u)); }

// The leaf that stands for a cell of the finest grid, by descent over child masks; NONE if there is none.
uint find_leaf(uint level, uvec3 finest) {
    uint code = morton(finest) >> (3u * (MAX_LEVEL - level));
    uint node = 0u;
    for (uint k = level; k > 0u; --k) {
        uint digit = code >> (3u * (k - 1u)) & 7u;
        uint mask = child_mask(node);
        if ((mask >> digit & 1u) == 0u) return NONE;
        node = child_of(node, mask, digit);
    }
    return node;
}

// First entry of a node and the one behind its last.
uvec2 entry_range(uint node) {
    uint begin = po.at[node], end = po.at[node + 1u];
    return uvec2(begin >= end ? 0u : begin, end);
}
