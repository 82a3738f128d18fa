// Two bits per tetrahedron: the sign of its volume with the vertices in ascending index.
const uint MIRRORED = 1u; // negative
const uint FLAT = 2u;     // without volume
