#version 460
// Makes the grid from the bounds (SPEC 2.1). Where the host divides floats, this kernel divides integers, since
// Vulkan's division is not correctly rounded.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/ordered.glsl"
NO_SCALARS(2)
BUFFER(0, readonly, MeshStatus, status)
BUFFER16(1, writeonly, Grid, grid)

float from_ordered(uint key) { return uintBitsToFloat(unordered(key)); }

// 1024 / e for a normal e, correctly rounded (to nearest, ties to even): long division of the mantissas.
float divide_1024(float e) {
    uint bits = floatBitsToUint(e);
    uint divisor = (bits & 0x007fffffu) | 0x00800000u;
    int exponent = int(bits >> 23) - 127;
    // The quotient 2^23 / (2^23 * m), m in [1, 2), lies in (1/2, 1]. It is doubled unless it is 1, so that its first
    // bit is set.
    uint remainder = 0x00800000u;
    int scale = 10 - exponent + 127;
    if (divisor != 0x00800000u) {
        remainder <<= 1;
        scale -= 1;
    }
    uint quotient = 0u;
    for (int i = 0; i < 25; ++i) { // 24 bits, and one for rounding
        quotient = quotient << 1 | uint(remainder >= divisor);
        if (remainder >= divisor) remainder -= divisor;
        remainder <<= 1;
    }
    bool up = (quotient & 1u) != 0u && (remainder != 0u || (quotient & 2u) != 0u);
    quotient = (quotient >> 1) + uint(up);
    // A carry out of the mantissa increments the exponent.
    return uintBitsToFloat((uint(scale) << 23) + (quotient - 0x00800000u));
}

void main() {
    if (item_index() > 0u) return;
    Grid g;
    g.lo = vec4(0.0);
    g.hi = vec4(0.0);
    g.inv = vec4(0.0);
    g.extent = vec4(0.0);
    const float MIN_EXTENT = uintBitsToFloat((127u - 103u) << 23);
    float largest = MIN_EXTENT;
    bool any_cell = status.at[0].hi[0] != 0u;
    for (uint c = 0u; any_cell && c < 3u; ++c) {
        g.lo[c] = from_ordered(~status.at[0].lo[c]);
        g.hi[c] = from_ordered(status.at[0].hi[c]);
        precise float d = g.hi[c] - g.lo[c];
        float e = canonical(d);
        largest = max(largest, e);
        g.inv[c] = e < MIN_EXTENT ? 0.0 : divide_1024(e);
    }
    uint exponent = floatBitsToUint(largest) >> 23;
    g.scale = uintBitsToFloat((254u - exponent) << 23);
    g.level = MAX_LEVEL;
    g.first_leaf = 0u;
    g.slabs = 0u;
    g.longest = 0u;
    g.pad = uint[2](0u, 0u);
    g.ids = NONE;
    g.extent = vec4(normalise(g, g.hi.xyz), 0.0);
    grid.at[0] = g;
}
