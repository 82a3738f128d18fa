// Loads tetrahedra of both meshes. Needs overlap.glsl and own_cells, own_positions, cells, positions, frame.
layout(constant_id = 2) const uint OWN_STRIDE = 3; // words from one point to the next
layout(constant_id = 3) const uint STRIDE = 3;

Grid joint; // of the joint grid, only lo and scale are set

RawTet own_tet(uint t) {
    uvec4 i = words(own_cells.at[t]);
    vec3 v[4];
    for (uint k = 0u; k < 4u; ++k) {
        uint at = i[k] * OWN_STRIDE;
        v[k] = vec3(own_positions.at[at], own_positions.at[at + 1u], own_positions.at[at + 2u]);
    }
    return raw_tet(i, v[0], v[1], v[2], v[3]);
}

RawTet other_tet(uint t) {
    uvec4 i = words(cells.at[t]);
    vec3 v[4];
    for (uint k = 0u; k < 4u; ++k) {
        uint at = i[k] * STRIDE;
        v[k] = vec3(positions.at[at], positions.at[at + 1u], positions.at[at + 2u]);
    }
    return raw_tet(i, v[0], v[1], v[2], v[3]);
}

void to_joint(RawTet t, out vec3 v[4]) {
    for (uint k = 0u; k < 4u; ++k) v[k] = normalise(joint, t.v[k]);
}
