#version 460
// Exclusive scan, 2 of 3: one workgroup scans the sums of the tiles in place and writes the total.
#include "shared/kernel.glsl"
#include "shared/workgroup.glsl"
ARGUMENTS(3)
    uint count;
    uint tile; // values per tile
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, READ_WRITE, uint, sums)
BUFFER(2, writeonly, uint, total)

void main() {
    uint n = min(count, live.at[0]);
    uint tiles = n / tile + uint(n % tile != 0u);
    uvec2 items = items_of_tile((tiles + WORKGROUP - 1u) / WORKGROUP * WORKGROUP, tiles);
    uint sum = 0u, all;
    for (uint i = items.x; i < items.y; i += gl_SubgroupSize) sum += sums.at[i];
    uint running = subgroups_exclusive_add(sum, all);
    for (uint i = items.x, row = i - gl_SubgroupInvocationID; row < items.y; row += gl_SubgroupSize, i += gl_SubgroupSize) {
        uint v = i < items.y ? sums.at[i] : 0u;
        uint before = running + subgroupExclusiveAdd(v);
        if (i < items.y) sums.at[i] = before;
        running += subgroupAdd(v);
    }
    if (local_index() == 0u) total.at[0] = all;
}
