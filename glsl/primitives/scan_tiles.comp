#version 460
#include "shared/kernel.glsl"
#include "shared/workgroup.glsl"
// Exclusive scan, 1 of 3: the sum of every tile of WORKGROUP * ROWS values.
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
    // Folding into two dimensions may add groups behind the last tile.
    if (local_index() == 0u && first < n) sums.at[group_index()] = sum;
}
