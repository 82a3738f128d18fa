#version 460
// Computes the keys that points are sorted by: the CODE_BITS highest bits of the Morton code of their cell. Points
// where no mesh can be come last. Twin of `order_of` in src/reference/locate.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
layout(constant_id = 2) const uint CODE_BITS = 22;
ARGUMENTS(4)
    uint count;
    uint stride; // floats from one point to the next
END_ARGUMENTS
GRID(0, readonly)
BUFFER(1, readonly, float, points)
BUFFER(2, writeonly, uint, codes)
BUFFER(3, writeonly, uint, order)
#include "shared/points.glsl"

void main() {
    uint i = item_index();
    if (i >= count) return;
    Grid g = grid.at[0];
    vec3 at = point(i, stride);
    codes.at[i] = (near_bounds(g, at) ? morton(quantize(g, at)) : NONE) >> (3u * MAX_LEVEL - CODE_BITS) & (1u << CODE_BITS) - 1u;
    order.at[i] = i;
}
