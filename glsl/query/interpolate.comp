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
BUFFER(4, writeonly, float, values)

void main() {
    uint i = item_index();
    if (i >= count) return;
    uint owner = owners.at[i];
    float value = uintBitsToFloat(0x7fc00000u);
    if (owner != NONE && ON_CELLS != 0u) {
        value = field.at[owner];
    } else if (owner != NONE) {
        uvec4 ids = words(cells.at[owner]);
        vec4 b = barycentrics.at[i];
        value = weighed(b, vec4(field.at[ids.x], field.at[ids.y], field.at[ids.z], field.at[ids.w]));
    }
    values.at[i] = value;
}
