#version 460
#include "shared/kernel.glsl"
// Values of a field at located points; NaN without an owner.
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
        precise float v = (b.x * field.at[ids.x] + b.y * field.at[ids.y]) + (b.z * field.at[ids.z] + b.w * field.at[ids.w]);
        value = v;
    }
    values.at[i] = value;
}
