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
    uint each = (tiles + WORKGROUP - 1u) / WORKGROUP;
    uint first = local_index() * each;
    uint end = min(tiles, first + each);
    uint sum = 0u;
    for (uint i = first; i < end; ++i) sum += sums.at[i];
    uint all;
    uint running = workgroup_exclusive_add(sum, all);
    for (uint i = first; i < end; ++i) {
        uint v = sums.at[i];
        sums.at[i] = running;
        running += v;
    }
    if (local_index() == 0u) total.at[0] = all;
}
