// What is known of a face (four per tetrahedron) once faces are matched: another face with the same vertices (faces are
// numbered, from 0 to below 2^31); or the slot of the table that holds this face or another one; or NONE. Where more than
// two faces have the same vertices, this may lead from one to another of them, but one of the two is marked in `branches`
// (a bit per face).
const uint MATED = 0x80000000u;   // above a face in the table: another face has its vertices
const uint IN_SLOT = 0x80000000u; // above a slot
