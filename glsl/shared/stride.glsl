// The hot part of a walk (SPEC 2.6). Twin of `stride_to` in src/reference/walk.rs. Needs tet.glsl, cells, vertices and neighbours.

uint xor_of(uvec4 ids) { return ids.x ^ ids.y ^ ids.z ^ ids.w; }

// Goes from `t` to the tetrahedron that holds x clearly, if it is not far; false, and anywhere, if not.
bool stride_to(inout uint t, vec3 x, uint most) {
    if (t == NONE) return false;
    uvec4 cell = cells.at[t], ids = cell;
    vec3 v0 = vertices.at[ids.x].xyz, v1 = vertices.at[ids.y].xyz, v2 = vertices.at[ids.z].xyz, v3 = vertices.at[ids.w].xyz;
    for (uint s = 0u; s < most; ++s) {
        Sides at = sides_of(v0, v1, v2, v3, x);
        if (at.clear) return true;
        uint face = outermost(at.w), left = ids[face];
        if (at.w[face] >= 0.0) break;
        t = neighbours.at[t][cell.x == left ? 0u : cell.y == left ? 1u : cell.z == left ? 2u : 3u];
        if (t == NONE) break;
        // Three corners are shared; the fourth takes the place of the one left behind.
        cell = cells.at[t];
        uint fresh = xor_of(cell) ^ xor_of(ids) ^ left;
        ids[face] = fresh;
        vec3 v = vertices.at[fresh].xyz;
        if (face == 0u) v0 = v;
        else if (face == 1u) v1 = v;
        else if (face == 2u) v2 = v;
        else v3 = v;
    }
    return false;
}
