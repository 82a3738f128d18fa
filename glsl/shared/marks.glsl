// Marks of the cells that the boundary touches under Lists::Boundary (SPEC 2.6), one bit each, x fastest, so that a row
// of candidates is a run of consecutive bits. Twin of src/reference/marks.rs, which explains them. Needs marks.

uint mark_place(uint level, uvec3 cell) { return (cell.z << level | cell.y) << level | cell.x; }

bool is_marked(uint level, uvec3 cell) {
    uint place = mark_place(level, cell);
    return (marks.at[place >> 5u] >> (place & 31u) & 1u) != 0u;
}

uint low_bits(uint n) { return n >= 32u ? NONE : (1u << n) - 1u; }

// The marks of n cells from `cell` on along x, n up to 32.
uint marked_row(uint level, uvec3 cell, uint n) {
    uint place = mark_place(level, cell), shift = place & 31u;
    uint row = marks.at[place >> 5u] >> shift;
    if (shift + n > 32u) row |= marks.at[(place >> 5u) + 1u] << (32u - shift);
    return row & low_bits(n);
}
