// Centre and half size of a cell in normalised coordinates. Twin of `cell_centre` and `half_cell` in
// src/reference/assign.rs.

vec3 half_cell(Grid g, uint level) {
    precise vec3 cell = g.extent.xyz * two_to(-1 - int(level));
    precise vec3 whole = g.extent.xyz * 0.5;
    return vec3(g.inv.x == 0.0 ? whole.x : cell.x, g.inv.y == 0.0 ? whole.y : cell.y, g.inv.z == 0.0 ? whole.z : cell.z);
}

vec3 cell_centre(vec3 h, uvec3 cell) {
    precise vec3 a = vec3(2u * cell + 1u) * h;
    precise vec3 b = floor(a * two_to(42)) * two_to(-42);
    return b;
}
