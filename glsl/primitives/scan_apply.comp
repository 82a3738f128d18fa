#version 460
// Exclusive scan, 3 of 3: scans every tile, starting from its scanned sum. The output may be the input.
#include "shared/kernel.glsl"
#include "shared/workgroup.glsl"
layout(constant_id = 2) const uint IN_PLACE = 0; // 1: `scanned` is `values`
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
    uint first = first_item();
    uint end = min(n, first + ROWS);
    uint sum = 0u;
    for (uint i = first; i < end; ++i) sum += value_at(i);
    uint all;
    // Workgroups after the last tile, which folding into two dimensions may add, have no sum.
    uint before = first < n ? sums.at[group_index()] : 0u;
    uint running = before + workgroup_exclusive_add(sum, all);
    for (uint i = first; i < end; ++i) {
        uint v = value_at(i);
        scanned.at[i] = running;
        running += v;
    }
}
