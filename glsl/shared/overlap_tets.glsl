// Loads tetrahedra of both meshes, and decides in which leaf two of them are compared. Needs overlap.glsl and
// own_cells, own_positions, cells, positions, frame.
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

// Whether two tetrahedra are compared in the leaf with this code. With the assignment `Aabb` (EACH_ONCE), a pair is
// compared once: in the cell of the lower corner of the intersection of their boxes.
bool compared_in(Grid g, uint code, RawTet own, RawTet other) {
    if (!boxes_meet(own.lo, own.hi, other.lo, other.hi)) return false;
    if (EACH_ONCE == 0u) return true;
    return morton(quantize(g, max(own.lo, other.lo))) >> (3u * (MAX_LEVEL - g.level)) == code;
}
