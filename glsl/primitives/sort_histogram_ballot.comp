#version 460
// Radix sort, one tile per workgroup: digits are counted in shared memory. For processors with many narrow cores.
#include "shared/kernel.glsl"
#include "shared/sort.glsl"
ARGUMENTS(3)
    uint count;
    uint shift;
    uint mask; // of the digit: the last pass may have fewer bits
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, keys)
BUFFER(2, writeonly, uint, counts)

shared uint digit_counts[DIGITS];

void main() {
    uint n = min(count, live.at[0]);
    uint tile_items = WORKGROUP * ROWS;
    uint tiles = sort_tiles(n, tile_items);
    uint stride = sort_stride(tiles);
    uint tile = group_index();
    if (tiles == 0u || tile >= stride) return;
    for (uint d = local_index(); d < DIGITS; d += WORKGROUP) digit_counts[d] = 0u;
    // All loads first: a loop of loads and atomics would wait for one after the other.
    uint key[ROWS], first = tile * tile_items + local_index();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        uint i = first + row * WORKGROUP;
        key[row] = i < n ? keys.at[i] : 0u;
    }
    barrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        if (first + row * WORKGROUP < n) atomicAdd(digit_counts[key[row] >> shift & mask], 1u);
    }
    barrier();
    for (uint d = local_index(); d < DIGITS; d += WORKGROUP) counts.at[d * stride + tile] = digit_counts[d];
}
