// Vertices and tetrahedra as 02_normalise_vertices leaves them. The including kernel declares `vertices`: normalised
// coordinates, and the cell of the finest grid.
#include "shared/tet.glsl"

vec3 vertex(uint v) { return floats(vertices.at[v]).xyz; }

uvec3 vertex_cell(uint v) { return unpack_cell(floatBitsToUint(floats(vertices.at[v]).w)); }

Tet load_tet(uvec4 ids) { return make_tet(ids, vertex(ids.x), vertex(ids.y), vertex(ids.z), vertex(ids.w)); }
