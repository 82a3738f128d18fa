// The children of a node. The including kernel declares masks and co.

// One bit per 3-bit Morton digit: the children that an internal node has, or the octants of a leaf that its tetrahedra
// are near.
uint child_mask(uint node) { return masks.at[node >> 2u] >> (8u * (node & 3u)) & 0xffu; }

uint child_of(uint node, uint mask, uint digit) { return co.at[node] + 1u + bitCount(mask & ((1u << digit) - 1u)); }

// The node of the cell with Morton code `code` on `level`, found below `node` of level `from`; NONE if there is none.
uint find_node(uint node, uint from, uint level, uint code) {
    for (uint k = level - from; k > 0u; --k) {
        uint digit = code >> (3u * (k - 1u)) & 7u, mask = child_mask(node);
        if ((mask >> digit & 1u) == 0u) return NONE;
        node = child_of(node, mask, digit);
    }
    return node;
}
