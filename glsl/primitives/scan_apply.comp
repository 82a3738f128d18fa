#version 460
// Exclusive scan, 3 of 3: scans every tile, starting from its scanned sum. The output may be the input.
#include "shared/kernel.glsl"
#include "shared/workgroup.glsl"
layout(constant_id = 2) const uint IN_PLACE = 0; // 1: `scanned` is `values`
// 1: every invocation takes ROWS consecutive values, as suits processors. 0: a subgroup takes its values row by row, so
// that its loads and stores are to consecutive words.
layout(constant_id = 3) const uint SERIAL = 0;
ARGUMENTS(4)
    uint count;
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, sums)
BUFFER(2, readonly, uint, values)
BUFFER(3, READ_WRITE, uint, scanned)

// Two buffer variables are assumed not to alias, so a load of one might move past a store to the other. In place, only
// one of them is used.
uint value_at(uint i) { return IN_PLACE != 0u ? scanned.at[i] : values.at[i]; }

void main() {
    uint n = min(count, live.at[0]);
    uvec2 items = items_of_tile(WORKGROUP * ROWS, n);
    if (SERIAL != 0u) items = uvec2(first_item(), min(n, first_item() + ROWS));
    uint step = SERIAL != 0u ? 1u : gl_SubgroupSize;
    uint sum = 0u;
    for (uint i = items.x; i < items.y; i += step) sum += value_at(i);
    uint all, tile = group_index();
    // Workgroups after the last tile, which folding into two dimensions may add, have no sum.
    uint running = tile * WORKGROUP * ROWS < n ? sums.at[tile] : 0u;
    if (SERIAL != 0u) {
        running += workgroup_exclusive_add(sum, all);
        for (uint i = items.x; i < items.y; ++i) {
            uint v = value_at(i);
            scanned.at[i] = running;
            running += v;
        }
        return;
    }
    running += subgroups_exclusive_add(sum, all);
    // The whole subgroup takes part in every row, also in one that ends within it.
    for (uint i = items.x, row = i - gl_SubgroupInvocationID; row < items.y; row += gl_SubgroupSize, i += gl_SubgroupSize) {
        uint v = i < items.y ? value_at(i) : 0u;
        uint before = running + subgroupExclusiveAdd(v);
        if (i < items.y) scanned.at[i] = before;
        running += subgroupAdd(v);
    }
}
