#version 460
// Plans the passes of a sort from the number of pairs: their workgroups, and the length of the table of counts.
#include "shared/kernel.glsl"
#include "shared/sort.glsl"
ARGUMENTS(3)
    uint count;
    uint tile;      // pairs per tile
    uint per_group; // tiles that one workgroup takes
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, writeonly, uint, groups) // x, y, z of the passes
BUFFER(2, writeonly, uint, table)  // length of the table of counts
#include "shared/groups.glsl"

void main() {
    if (item_index() > 0u) return;
    uint n = min(count, live.at[0]);
    uint tiles = sort_tiles(n, tile);
    uint stride = tiles == 0u ? 0u : sort_stride(tiles);
    write_groups(0u, stride, per_group);
    table.at[0] = stride * DIGITS;
}
