// What a tetrahedron has of the surface of the mesh: its faces that have no neighbour, one bit each, and its vertices around
// a point. Needs separate.glsl; the including kernel declares cells and vertices.
struct Patch {
    uint faces;
    uvec4 rank;
    vec3 v[4];
};

uint surface_of(uvec4 rank, uvec4 beside) {
    uint faces = 0u;
    for (uint k = 0u; k < 4u; ++k) faces |= uint(beside[k] == NONE) << rank[k];
    return faces;
}

// That of tetrahedron t, whose neighbours are given, around the point x.
Patch patch_of(uint t, uvec4 beside, vec3 x) {
    Tet tet = load_tet(words(cells.at[t]));
    vec3 v[4] = vec3[4](difference(tet.v[0], x), difference(tet.v[1], x), difference(tet.v[2], x), difference(tet.v[3], x));
    return Patch(surface_of(tet.rank, beside), tet.rank, v);
}
