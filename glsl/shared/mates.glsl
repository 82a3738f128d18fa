// What is known of each face (four per tetrahedron) while faces are matched: ALONE until another face with the same
// vertices is found; then that face's number plus 1, with SIDE if both tetrahedra lie on the same side; or CROWDED, the
// largest word, if more than two faces have these vertices.
const uint ALONE = 0u;
const uint CROWDED = 0xffffffffu;
// In a face: its tetrahedron lies on the positive side. In a mate: both tetrahedra lie on the same side.
const uint SIDE = 0x80000000u;

// Face a as the mate of face b, both with their SIDE bit.
uint mate(uint a, uint b) { return ((a & ~SIDE) + 1u) | (~(a ^ b) & SIDE); }

uint face_of_mate(uint mate) { return (mate & ~SIDE) - 1u; }
