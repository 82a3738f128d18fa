// Vertices of so many tetrahedra that a star could not hold them (SPEC 2.3). The tetrahedra of such a crowded vertex
// count as boundary, so it lies in leaves with whole lists, and no walk ends there. Twin of src/reference/corners.rs,
// which explains the bounds; the operations and their order are the same. Needs grid.glsl and tet.glsl.
const uint MOST_THIN = 46u; // Most thin corners at a vertex that is not crowded.

float squared_length(vec3 a, vec3 b, int e) {
    precise vec3 edge = ceil(abs(b - a) * two_to(20 - e)) * two_to(-20);
    return dot_product(edge, edge);
}

// A bit per vertex, in ascending global index: whether the corner there is thin.
uint thin_corners(Tet t, float vol) {
    Bounds box = bounds_of(t.v);
    precise vec3 size = box.hi - box.lo;
    int e = max(int(floatBitsToUint(max(max(size.x, size.y), size.z)) >> 23) - 127, -42);
    float ab = squared_length(t.v[0], t.v[1], e), ac = squared_length(t.v[0], t.v[2], e), ad = squared_length(t.v[0], t.v[3], e);
    float bc = squared_length(t.v[1], t.v[2], e), bd = squared_length(t.v[1], t.v[3], e), cd = squared_length(t.v[2], t.v[3], e);
    precise float scaled = ((vol * two_to(-e)) * two_to(-e)) * two_to(-e);
    float det = canonical(scaled);
    precise float square = det * det;
    precise vec4 room = vec4((ab * ac) * ad, (ab * bc) * bd, (ac * bc) * cd, (ad * bd) * cd) * 0.09375;
    uvec4 thin = uvec4(lessThanEqual(vec4(canonical(square)), room));
    return thin.x | thin.y << 1 | thin.z << 2 | thin.w << 3;
}
