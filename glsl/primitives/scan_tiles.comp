#version 460
// Exclusive scan, 1 of 3: sums every tile of WORKGROUP * ROWS values.
#include "shared/kernel.glsl"
#include "shared/workgroup.glsl"
ARGUMENTS(3)
    uint count;
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, values)
BUFFER(2, writeonly, uint, sums)

void main() {
    uint n = min(count, live.at[0]);
    uvec2 items = items_of_tile(WORKGROUP * ROWS, n);
    uint sum = 0u;
    for (uint i = items.x; i < items.y; i += gl_SubgroupSize) sum += values.at[i];
    sum = workgroup_add(sum);
    // Folding into two dimensions may add workgroups after the last tile.
    if (local_index() == 0u && items.x < n) sums.at[group_index()] = sum;
}
