// What is known of a face, four to a tetrahedron, while faces are matched: nothing yet; or one more than the number of the face that it shares vertices with,
// and whether both tetrahedra lie on one side; or, which is the largest word, that there are more than two.
const uint ALONE = 0u;
const uint CROWDED = 0xffffffffu;
const uint SIDE = 0x80000000u; // of a face: its tetrahedron lies on the positive one; of a mate: both lie on the same

// Of two faces with their sides, a as the mate of b.
uint mate(uint a, uint b) { return ((a & ~SIDE) + 1u) | (~(a ^ b) & SIDE); }

uint face_of_mate(uint mate) { return (mate & ~SIDE) - 1u; }
