// Ranges of cells of the finest grid. Twin of src/reference/leaf_walk.rs. Needs grid.glsl.

// The cells of the finest grid that the box around `centre` with half extent `reach` meets. Returns false if the box
// lies outside of the bounds.
bool reached_cells(Grid g, vec3 centre, vec3 reach, out uvec3 lo, out uvec3 hi) {
    vec3 d = from_corner(g, centre);
    precise vec3 a = d - reach, b = d + reach, size = g.hi.xyz - g.lo.xyz;
    a = vec3(canonical(a.x), canonical(a.y), canonical(a.z));
    b = vec3(canonical(b.x), canonical(b.y), canonical(b.z));
    size = vec3(canonical(size.x), canonical(size.y), canonical(size.z));
    lo = cell_at(in_cells(g, a));
    hi = cell_at(in_cells(g, b));
    return all(greaterThanEqual(b, vec3(0.0))) && all(lessThanEqual(a, size));
}
