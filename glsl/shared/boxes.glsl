// Box of a cell in the units of the mesh (SPEC 2.1). Twin of `cell_box` in src/reference/leaves.rs.

// The lower sides of cell k of a level; k may be one beyond the last cell.
vec3 cell_sides(Grid g, uint level, uvec3 k) {
    precise vec3 extent = g.hi.xyz - g.lo.xyz;
    precise vec3 along = vec3(k) * two_to(-int(level));
    precise vec3 offset = vec3(canonical(extent.x), canonical(extent.y), canonical(extent.z)) * along;
    if (g.graded != 0u) offset = graded_sides(k << (MAX_LEVEL - level));
    precise vec3 x = g.lo.xyz + offset;
    x = vec3(canonical(x.x), canonical(x.y), canonical(x.z));
    x = mix(x, g.hi.xyz, equal(k, uvec3(1u << level)));
    x = mix(x, g.hi.xyz, equal(g.inv.xyz, vec3(0.0)));
    return mix(x, g.lo.xyz, equal(k, uvec3(0u)));
}

// Lower and upper corner of the cell with this Morton code.
void cell_box(Grid g, uint level, uint code, out vec3 lo, out vec3 hi) {
    uvec3 k = unmorton(code);
    lo = cell_sides(g, level, k);
    hi = cell_sides(g, level, k + 1u);
}
