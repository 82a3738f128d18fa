// Vertices of so many tetrahedra that a star could not hold them (SPEC 2.6). The tetrahedra of such a crowded vertex count
// as boundary, so it lies in leaves with whole lists, and no walk ends there. Twin of src/reference/corners.rs, which
// explains the bounds; the operations and their order are the same. Needs grid.glsl and tet.glsl.
const uint MOST_THIN = 46u; // thin corners at a vertex that is not crowded

float squared_length(vec3 a, vec3 b, float scale) {
    precise vec3 edge = (b - a) * scale;
    return dot_product(edge, edge);
}

// A bit per vertex, in ascending global index: whether the corner there is thin.
uint thin_corners(Tet t, float vol) {
    Bounds box = bounds_of(t.v);
    precise vec3 size = box.hi - box.lo;
    int e = int(floatBitsToUint(max(max(size.x, size.y), size.z)) >> 23) - 127;
    float scale = two_to(-e);
    float ab = squared_length(t.v[0], t.v[1], scale), ac = squared_length(t.v[0], t.v[2], scale), ad = squared_length(t.v[0], t.v[3], scale);
    float bc = squared_length(t.v[1], t.v[2], scale), bd = squared_length(t.v[1], t.v[3], scale), cd = squared_length(t.v[2], t.v[3], scale);
    precise float det = ((vol * scale) * scale) * scale;
    precise float square = det * det;
    precise vec4 room = vec4((ab * ac) * ad, (ab * bc) * bd, (ac * bc) * cd, (ad * bd) * cd) * 0.09375;
    uvec4 thin = uvec4(lessThanEqual(vec4(square), room));
    return thin.x | thin.y << 1 | thin.z << 2 | thin.w << 3;
}
