// The children of a node. The including kernel declares masks and co.

// Of an internal node the children that there are; of a leaf the octants that its primitives come near to, by the same digits.
uint child_mask(uint node) { return masks.at[node >> 2u] >> (8u * (node & 3u)) & 0xffu; }

uint child_of(uint node, uint mask, uint digit) { return co.at[node] + 1u + bitCount(mask & ((1u << digit) - 1u)); }

// The node of a cell of `level`, found below `node` of level `from`; NONE if there is none.
uint find_node(uint node, uint from, uint level, uint code) {
    for (uint k = level - from; k > 0u; --k) {
        uint digit = code >> (3u * (k - 1u)) & 7u, mask = child_mask(node);
        if ((mask >> digit & 1u) == 0u) return NONE;
        node = child_of(node, mask, digit);
    }
    return node;
}
