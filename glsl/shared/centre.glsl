// Centre and half size of a cell in normalised coordinates. Twin of `cell_centre` and `half_cell` in
// src/reference/assign.rs. Needs grid.glsl.

// The lower side of a cell of the finest grid, if the grid is graded.
float normalised_side(Grid g, uint c, uint k) {
    precise float unit = graded_side(c, k) * g.scale;
    precise float whole = floor(canonical(unit) * two_to(82)) * two_to(-42);
    return whole;
}

// Half the size of a cell of a level; in grids that are not graded, all of a level have the same.
vec3 half_cell(Grid g, uint level, uvec3 cell) {
    precise vec3 part = g.extent.xyz * two_to(-1 - int(level));
    precise vec3 whole = g.extent.xyz * 0.5;
    vec3 h = vec3(g.inv.x == 0.0 ? whole.x : part.x, g.inv.y == 0.0 ? whole.y : part.y, g.inv.z == 0.0 ? whole.z : part.z);
    if (g.graded == 0u) return h;
    for (uint c = 0u; c < 3u; ++c) {
        if (g.inv[c] == 0.0) continue;
        uint shift = MAX_LEVEL - level;
        precise float size = normalised_side(g, c, (cell[c] + 1u) << shift) - normalised_side(g, c, cell[c] << shift);
        h[c] = size * 0.5;
    }
    return h;
}

// The centre of a cell of a level, with its half size.
vec3 cell_centre(Grid g, uint level, vec3 h, uvec3 cell) {
    precise vec3 a = vec3(2u * cell + 1u) * h;
    for (uint c = 0u; c < 3u && g.graded != 0u; ++c) {
        precise float middle = normalised_side(g, c, cell[c] << (MAX_LEVEL - level)) + h[c];
        if (g.inv[c] != 0.0) a[c] = middle;
    }
    precise vec3 b = floor(a * two_to(42)) * two_to(-42);
    return b;
}
