// Boundary tetrahedra (SPEC 2.3). The including kernel declares boundary.
bool is_boundary_tet(uint t) { return (boundary.at[t >> 5u] >> (t & 31u) & 1u) != 0u; }
