#version 460
// Radix sort, serial tiles: every invocation moves its own pairs to the places in the scanned table. Passes take turns:
// one reads keys and values and writes pairs, the next reads pairs and writes keys and values.
#include "shared/kernel.glsl"
#include "shared/sort.glsl"
layout(constant_id = 3) const uint FROM_PAIRS = 0;
ARGUMENTS(5)
    uint count;
    uint shift;
    uint mask; // of the digit: the last pass may have fewer bits
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, READ_WRITE, uint, keys)
BUFFER(2, READ_WRITE, uint, values)
BUFFER8(3, READ_WRITE, PAIR, pairs)
BUFFER(4, READ_WRITE, uint, places)

void main() {
    uint n = min(count, live.at[0]);
    uint tiles = sort_tiles(n, ROWS);
    uint stride = sort_stride(tiles);
    uint tile = item_index();
    if (tile >= tiles) return;
    uint first = tile * ROWS;
    uint end = min(n, first + ROWS);
    for (uint i = first; i < end; ++i) {
        uvec2 moved = FROM_PAIRS != 0u ? words(pairs.at[i]) : uvec2(keys.at[i], values.at[i]);
        uint cell = (moved.x >> shift & mask) * stride + tile;
        uint place = places.at[cell];
        places.at[cell] = place + 1u;
        if (FROM_PAIRS != 0u) {
            keys.at[place] = moved.x;
            values.at[place] = moved.y;
        } else {
            pairs.at[place] = pair(moved.x, moved.y);
        }
    }
}
