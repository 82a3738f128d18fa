// Whether the surface of the mesh may pass through a node's cell. The including kernel declares flags.
bool is_boundary_node(uint node) { return (flags.at[node >> 5u] >> (node & 31u) & 1u) != 0u; }
