#version 460
// Interpolates a field at located points. A point without an owner gets NaN.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
layout(constant_id = 2) const uint ON_CELLS = 0;
ARGUMENTS(5)
    uint count;
END_ARGUMENTS
RECORDS(0, uvec4, cells)
BUFFER(1, readonly, float, field)
BUFFER(2, readonly, uint, owners)
BUFFER16(3, readonly, vec4, barycentrics)
BUFFER(4, writeonly, uint, values) // floats, by their bits: compilers may take it that no float is NaN

void main() {
    uint i = item_index();
    if (i >= count) return;
    uint owner = owners.at[i];
    uint value = 0x7fc00000u; // NaN
    if (owner != NONE && ON_CELLS != 0u) {
        value = floatBitsToUint(field.at[owner]);
    } else if (owner != NONE) {
        uvec4 ids = words(cells.at[owner]);
        vec4 b = barycentrics.at[i];
        value = floatBitsToUint(weighed(b, vec4(field.at[ids.x], field.at[ids.y], field.at[ids.z], field.at[ids.w])));
    }
    values.at[i] = value;
}
