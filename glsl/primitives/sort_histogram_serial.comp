#version 460
// Radix sort, serial tiles: every invocation counts the digits of its own ROWS pairs, without a barrier. For processors
// that run a workgroup as loops over wide vectors. Neighbouring invocations own neighbouring columns of the table.
#include "shared/kernel.glsl"
#include "shared/sort.glsl"
ARGUMENTS(3)
    uint count;
    uint shift;
    uint mask; // of the digit: the last pass may have fewer bits
    uint spacing; // words from one key to the next
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, keys)
BUFFER(2, READ_WRITE, uint, counts)

void main() {
    uint n = min(count, live.at[0]);
    uint tiles = sort_tiles(n, ROWS);
    uint stride = sort_stride(tiles);
    uint tile = item_index();
    if (tiles == 0u || tile >= stride) return;
    for (uint d = 0u; d < DIGITS; ++d) counts.at[d * stride + tile] = 0u;
    if (tile >= tiles) return;
    uint first = tile * ROWS;
    uint end = min(n, first + ROWS);
    for (uint i = first; i < end; ++i) {
        uint d = keys.at[i * spacing] >> shift & mask;
        counts.at[d * stride + tile] += 1u;
    }
}
