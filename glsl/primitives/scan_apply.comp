#version 460
#include "shared/kernel.glsl"
#include "shared/workgroup.glsl"
// Exclusive scan, 3 of 3: every tile once more, from its sum. Output may be the input.
ARGUMENTS(4)
    uint count;
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, sums)
BUFFER(2, readonly, uint, values)
BUFFER(3, writeonly, uint, scanned)

void main() {
    uint n = min(count, live.at[0]);
    uint first = first_item();
    uint end = min(n, first + ROWS);
    uint sum = 0u;
    for (uint i = first; i < end; ++i) sum += values.at[i];
    uint all;
    uint running = sums.at[group_index()] + workgroup_exclusive_add(sum, all);
    for (uint i = first; i < end; ++i) {
        uint v = values.at[i];
        scanned.at[i] = running;
        running += v;
    }
}
