#version 460
// Radix sort, serial tiles: every invocation counts the digits of its own ROWS pairs, without a barrier. For processors
// that run a workgroup as loops over wide vectors. Neighbouring invocations own neighbouring columns of the table.
#include "shared/kernel.glsl"
#include "shared/sort.glsl"
layout(constant_id = 3) const uint FROM_PAIRS = 0; // as sort_scatter_serial
ARGUMENTS(4)
    uint count;
    uint shift;
    uint mask; // of the digit: the last pass may have fewer bits
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, keys)
BUFFER8(2, readonly, PAIR, pairs)
BUFFER(3, READ_WRITE, uint, counts)

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
        uint key = FROM_PAIRS != 0u ? words(pairs.at[i]).x : keys.at[i];
        uint d = key >> shift & mask;
        counts.at[d * stride + tile] += 1u;
    }
}
