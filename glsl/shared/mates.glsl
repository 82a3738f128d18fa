// What is known of each face (four per tetrahedron) while faces are matched: ALONE until another face with the same
// vertices is found; then that face's number plus 1; or CROWDED, the largest word, if more than two faces have these
// vertices.
const uint ALONE = 0u;
const uint CROWDED = 0xffffffffu;

uint mate(uint face) { return face + 1u; }

uint face_of_mate(uint mate) { return mate - 1u; }
