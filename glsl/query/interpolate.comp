#version 460
// Interpolates a field of one or several components at located points. A point without an owner gets NaN.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
layout(constant_id = 2) const uint ON_CELLS = 0;
ARGUMENTS(5)
    uint count;
    uint components; // floats per point or tetrahedron, and per answer
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
    bool weigh = owner != NONE && ON_CELLS == 0u;
    uvec4 from = components * (weigh ? words(cells.at[owner]) : uvec4(owner));
    vec4 b = weigh ? barycentrics.at[i] : vec4(0.0);
    for (uint k = 0u; k < components; ++k) {
        uint value = 0x7fc00000u; // NaN
        if (weigh) {
            uvec4 at = from + k;
            value = floatBitsToUint(weighed(b, vec4(field.at[at.x], field.at[at.y], field.at[at.z], field.at[at.w])));
        } else if (owner != NONE) {
            value = floatBitsToUint(field.at[from.x + k]);
        }
        values.at[i * components + k] = value;
    }
}
