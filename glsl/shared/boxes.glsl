// Box of a cell in the units of the mesh (SPEC 2.1). Twin of `cell_box` in src/reference/leaves.rs.

float cell_side(Grid g, uint c, uint level, uint k) {
    if (k == 0u) return g.lo[c];
    if (k == 1u << level || g.inv[c] == 0.0) return g.hi[c];
    precise float extent = g.hi[c] - g.lo[c];
    precise float along = float(k) * two_to(-int(level));
    precise float offset = canonical(extent) * along;
    if (g.graded != 0u) offset = graded_side(c, k << (MAX_LEVEL - level));
    precise float x = g.lo[c] + offset;
    return canonical(x);
}

// Lower and upper corner of the cell with this Morton code.
void cell_box(Grid g, uint level, uint code, out vec3 lo, out vec3 hi) {
    uvec3 k = unmorton(code);
    for (uint c = 0u; c < 3u; ++c) {
        lo[c] = cell_side(g, c, level, k[c]);
        hi[c] = cell_side(g, c, level, k[c] + 1u);
    }
}
