#version 460
// Radix sort, one tile per workgroup, of which every subgroup takes consecutive rows: equal digits of a row find each
// other by ballots, so the order within a tile is kept. Subgroups count by themselves and meet only once, for the
// places.
#include "shared/kernel.glsl"
#include "shared/sort.glsl"
layout(constant_id = 3) const uint MAX_SUBGROUPS = 8; // at least WORKGROUP / subgroup size
ARGUMENTS(6)
    uint count;
    uint shift;
    uint mask; // of the digit: the last pass may have fewer bits
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, keys)
BUFFER(2, readonly, uint, values)
BUFFER(3, readonly, uint, places)
BUFFER(4, writeonly, uint, sorted_keys)
BUFFER(5, writeonly, uint, sorted_values)

// Per subgroup and digit: its pairs in the rows so far, and after all rows the place of its first pair.
shared uint held[MAX_SUBGROUPS * DIGITS];

void main() {
    uint n = min(count, live.at[0]);
    uint tile_items = WORKGROUP * ROWS;
    uint tiles = sort_tiles(n, tile_items);
    uint stride = sort_stride(tiles);
    uint tile = group_index();
    if (tile >= tiles) return;
    uint own = gl_SubgroupID * DIGITS;
    for (uint d = gl_SubgroupInvocationID; d < DIGITS; d += gl_SubgroupSize) held[own + d] = 0u;
    subgroupBarrier();
    uint first = tile * tile_items + gl_SubgroupID * gl_SubgroupSize * ROWS + gl_SubgroupInvocationID;
    uint key[ROWS], rank[ROWS]; // of the pair in each row: its key, and how many of the subgroup's are before it
    for (uint row = 0u; row < ROWS; ++row) {
        uint i = first + row * gl_SubgroupSize;
        bool live_item = i < n;
        key[row] = live_item ? keys.at[i] : 0u;
        uint d = key[row] >> shift & mask;
        uvec4 peers = subgroupBallot(live_item);
        for (uint b = 0u; b < DIGIT_BITS; ++b) {
            bool bit = (d >> b & 1u) != 0u;
            uvec4 set = subgroupBallot(bit);
            peers &= bit ? set : ~set;
        }
        uint before = subgroupBallotExclusiveBitCount(peers);
        uint earlier = held[own + d];
        rank[row] = earlier + before;
        subgroupBarrier();
        if (live_item && before == 0u) held[own + d] = earlier + subgroupBallotBitCount(peers);
        subgroupBarrier();
    }
    barrier();
    for (uint d = local_index(); d < DIGITS; d += WORKGROUP) {
        uint place = places.at[d * stride + tile];
        for (uint s = 0u; s < gl_NumSubgroups; ++s) {
            uint pairs = held[s * DIGITS + d];
            held[s * DIGITS + d] = place;
            place += pairs;
        }
    }
    barrier();
    for (uint row = 0u; row < ROWS; ++row) {
        uint i = first + row * gl_SubgroupSize;
        if (i >= n) break;
        uint place = held[own + (key[row] >> shift & mask)] + rank[row];
        sorted_keys.at[place] = key[row];
        sorted_values.at[place] = values.at[i];
    }
}
