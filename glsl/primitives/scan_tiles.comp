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
    uint first = first_item();
    uint end = min(n, first + ROWS);
    uint sum = 0u;
    for (uint i = first; i < end; ++i) sum += values.at[i];
    sum = workgroup_add(sum);
    // Folding into two dimensions may add workgroups after the last tile.
    if (local_index() == 0u && first < n) sums.at[group_index()] = sum;
}
