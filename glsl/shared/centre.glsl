// Centre and half size of a cell in normalised coordinates. Twin of `cell_centre` and `half_cell` in
// src/reference/assign.rs. Needs grid.glsl.

struct CellShape {
    vec3 centre;
    vec3 half_size;
};

// Half the size of the cells of a level, unless the grid is graded.
vec3 half_cell(Grid g, uint level) {
    precise vec3 cell = g.extent.xyz * two_to(-1 - int(level));
    precise vec3 whole = g.extent.xyz * 0.5;
    return vec3(g.inv.x == 0.0 ? whole.x : cell.x, g.inv.y == 0.0 ? whole.y : cell.y, g.inv.z == 0.0 ? whole.z : cell.z);
}

// The multiple of 2^-42 below x.
vec3 whole_steps(vec3 x) {
    precise vec3 r = floor(x * two_to(42)) * two_to(-42);
    return r;
}

// The centre of a cell of this half size, unless the grid is graded.
vec3 cell_centre(vec3 h, uvec3 cell) {
    precise vec3 a = vec3(2u * cell + 1u) * h;
    return whole_steps(a);
}

// The lower sides of a cell of the finest grid, if the grid is graded.
vec3 normalised_sides(Grid g, uvec3 k) {
    precise vec3 unit = graded_sides(k) * g.scale;
    unit = vec3(canonical(unit.x), canonical(unit.y), canonical(unit.z));
    precise vec3 r = floor(unit * two_to(82)) * two_to(-42);
    return r;
}

// A cell of a level in any grid.
CellShape cell_shape(Grid g, uint level, uvec3 cell) {
    vec3 h = half_cell(g, level);
    if (g.graded == 0u) return CellShape(cell_centre(h, cell), h);
    uint shift = MAX_LEVEL - level;
    vec3 lower = normalised_sides(g, cell << shift);
    precise vec3 size = normalised_sides(g, (cell + 1u) << shift) - lower;
    h = mix(0.5 * size, h, equal(g.inv.xyz, vec3(0.0)));
    precise vec3 middle = lower + h; // of a flat axis, too, whose lower side is 0
    return CellShape(whole_steps(middle), h);
}
