// Bad tetrahedra, which are left out (SPEC 2.3). The including kernel declares bad.
bool is_bad(uint t) { return (bad.at[t >> 5u] >> (t & 31u) & 1u) != 0u; }
