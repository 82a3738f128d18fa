#version 460
// Radix sort, serial tiles: every invocation moves its own pairs to the places in the scanned table.
#include "shared/kernel.glsl"
#include "shared/sort.glsl"
ARGUMENTS(6)
    uint count;
    uint shift;
    uint mask; // of the digit: the last pass may have fewer bits
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, keys)
BUFFER(2, readonly, uint, values)
BUFFER(3, READ_WRITE, uint, places)
BUFFER(4, writeonly, uint, sorted_keys)
BUFFER(5, writeonly, uint, sorted_values)

void main() {
    uint n = min(count, live.at[0]);
    uint tiles = sort_tiles(n, ROWS);
    uint stride = sort_stride(tiles);
    uint tile = item_index();
    if (tile >= tiles) return;
    uint first = tile * ROWS;
    uint end = min(n, first + ROWS);
    for (uint i = first; i < end; ++i) {
        uint key = keys.at[i];
        uint cell = (key >> shift & mask) * stride + tile;
        uint place = places.at[cell];
        places.at[cell] = place + 1u;
        sorted_keys.at[place] = key;
        sorted_values.at[place] = values.at[i];
    }
}
