#version 460
// Radix sort, one tile per workgroup: equal digits of a subgroup find each other by ballots, so the order within a tile
// is kept. A tile is processed row by row; the next place of every digit stays in shared memory.
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

shared uint running[DIGITS];
shared uint row_counts[MAX_SUBGROUPS * DIGITS];

void main() {
    uint n = min(count, live.at[0]);
    uint tile_items = WORKGROUP * ROWS;
    uint tiles = sort_tiles(n, tile_items);
    uint stride = sort_stride(tiles);
    uint tile = group_index();
    if (tile >= tiles) return;
    for (uint d = local_index(); d < DIGITS; d += WORKGROUP) running[d] = places.at[d * stride + tile];
    for (uint row = 0u; row < ROWS; ++row) {
        uint i = tile * tile_items + row * WORKGROUP + local_index();
        bool live_item = i < n;
        uint key = live_item ? keys.at[i] : 0u;
        uint d = key >> shift & mask;
        uvec4 peers = subgroupBallot(live_item);
        for (uint b = 0u; b < DIGIT_BITS; ++b) {
            bool bit = (d >> b & 1u) != 0u;
            uvec4 set = subgroupBallot(bit);
            peers &= bit ? set : ~set;
        }
        uint before = subgroupBallotExclusiveBitCount(peers);
        uint size = subgroupBallotBitCount(peers);
        for (uint s = local_index(); s < gl_NumSubgroups * DIGITS; s += WORKGROUP) row_counts[s] = 0u;
        barrier();
        if (live_item && before == 0u) row_counts[gl_SubgroupID * DIGITS + d] = size;
        barrier();
        // Places of this row: for each digit, one invocation goes through the subgroups.
        for (uint digit = local_index(); digit < DIGITS; digit += WORKGROUP) {
            uint place = running[digit];
            for (uint s = 0u; s < gl_NumSubgroups; ++s) {
                uint c = row_counts[s * DIGITS + digit];
                row_counts[s * DIGITS + digit] = place;
                place += c;
            }
            running[digit] = place;
        }
        barrier();
        if (live_item) {
            uint place = row_counts[gl_SubgroupID * DIGITS + d] + before;
            sorted_keys.at[place] = key;
            sorted_values.at[place] = values.at[i];
        }
        barrier();
    }
}
