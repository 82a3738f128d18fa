#version 460
// LBVH baseline, codes: the Morton code of the middle of every tetrahedron's box on the finest level. Bad tetrahedra
// sort after all others.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(6)
    uint tets;
    uint stride;
END_ARGUMENTS
GRID(0, readonly)
BUFFER(1, readonly, float, positions)
RECORDS(2, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, writeonly, uint, codes)
BUFFER(5, writeonly, uint, ids)
#include "shared/positions.glsl"
#include "shared/bad.glsl"

void main() {
    uint t = item_index();
    if (t >= tets) return;
    uint code = 1u << 30;
    if (!is_bad(t)) {
        uvec4 v = words(cells.at[t]);
        vec3 a = position(v.x, stride), b = position(v.y, stride), c = position(v.z, stride), d = position(v.w, stride);
        precise vec3 middle = min(min(a, b), min(c, d)) * 0.5 + max(max(a, b), max(c, d)) * 0.5;
        code = morton(quantize(grid.at[0], middle));
    }
    codes.at[t] = code;
    ids.at[t] = t;
}
