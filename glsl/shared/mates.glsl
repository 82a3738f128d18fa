// What is known of each face (four per tetrahedron) while faces are matched: ALONE, or the number of another face with
// the same vertices plus 1. Where more than two faces have the same vertices, this is known for two of them, of which
// one is marked in `branches` (a bit per face).
const uint ALONE = 0u;

uint mate(uint face) { return face + 1u; }

uint face_of_mate(uint mate) { return mate - 1u; }
