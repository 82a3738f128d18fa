// The first and the last cell of the finest grid between which the vertices of a tetrahedron lie. Needs grid.glsl and
// vertices.
#include "shared/vertices.glsl"

void cells_spanned(uvec4 ids, out uvec3 lo, out uvec3 hi) {
    lo = uvec3(1023u);
    hi = uvec3(0u);
    for (uint i = 0u; i < 4u; ++i) {
        uvec3 q = vertex_cell(ids[i]);
        lo = min(lo, q);
        hi = max(hi, q);
    }
}
