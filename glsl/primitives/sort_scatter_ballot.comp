#version 460
// Radix sort, one tile per workgroup, of which every subgroup takes consecutive rows: equal digits of a row find each
// other by ballots, so the order within a tile is kept. The tile is sorted in shared memory before it is written, since
// pairs of a digit then go to consecutive places, and whole sectors of memory are written at once.
#include "shared/kernel.glsl"
#include "shared/workgroup.glsl"
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

const uint TILE = WORKGROUP * ROWS;
const uint HELD = MAX_SUBGROUPS * DIGITS;
// First, per subgroup and digit: its pairs in the rows so far, then those of the subgroups before it. Later the keys of
// the tile in order.
shared uint tile_keys[HELD > TILE ? HELD : TILE];
shared uint tile_values[TILE];
// Per digit: the place of its first pair in the tile, and what leads from a place in the tile to that among all pairs.
shared uint start[DIGITS];
shared uint move[DIGITS];
const uint DIGITS_EACH = (DIGITS + WORKGROUP - 1u) / WORKGROUP; // that an invocation sums up

uint digit_of(uint key) { return key >> shift & mask; }

void main() {
    uint n = min(count, live.at[0]);
    uint tiles = sort_tiles(n, TILE);
    uint stride = sort_stride(tiles);
    uint tile = group_index();
    if (tile >= tiles) return;
    uint own = gl_SubgroupID * DIGITS;
    for (uint d = gl_SubgroupInvocationID; d < DIGITS; d += gl_SubgroupSize) tile_keys[own + d] = 0u;
    uint first = tile * TILE + gl_SubgroupID * gl_SubgroupSize * ROWS + gl_SubgroupInvocationID;
    // Of the pair in each row; its place is first how many of the subgroup's are before it, then that in the tile.
    uint key[ROWS], value[ROWS], place[ROWS];
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        uint i = first + row * gl_SubgroupSize;
        key[row] = i < n ? keys.at[i] : 0u;
        value[row] = i < n ? values.at[i] : 0u;
    }
    uint digit_place[DIGITS_EACH];
    [[unroll]] for (uint k = 0u; k < DIGITS_EACH; ++k) {
        uint d = k * WORKGROUP + local_index();
        digit_place[k] = d < DIGITS ? places.at[d * stride + tile] : 0u;
    }
    subgroupBarrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        bool live_item = first + row * gl_SubgroupSize < n;
        uint d = digit_of(key[row]);
        uvec4 peers = subgroupBallot(live_item);
        for (uint b = 0u; b < DIGIT_BITS; ++b) {
            uint clear = (d >> b & 1u) - 1u; // all ones if the bit is 0
            peers &= subgroupBallot(clear == 0u) ^ clear;
        }
        uint before = subgroupBallotExclusiveBitCount(peers);
        uint earlier = tile_keys[own + d];
        place[row] = earlier + before;
        subgroupBarrier();
        if (live_item && before == 0u) tile_keys[own + d] = earlier + subgroupBallotBitCount(peers);
        subgroupBarrier();
    }
    barrier();
    uint pairs = 0u; // of smaller digits, and finally of the tile
    [[unroll]] for (uint k = 0u; k < DIGITS_EACH; ++k) {
        uint d = k * WORKGROUP + local_index(), held = 0u, all;
        for (uint s = 0u; s < gl_NumSubgroups && d < DIGITS; ++s) {
            uint of_subgroup = tile_keys[s * DIGITS + d];
            tile_keys[s * DIGITS + d] = held;
            held += of_subgroup;
        }
        uint first_place = pairs + workgroup_exclusive_add(held, all);
        pairs += all;
        if (d < DIGITS) {
            start[d] = first_place;
            move[d] = digit_place[k] - first_place;
        }
    }
    barrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        uint d = digit_of(key[row]);
        place[row] += start[d] + tile_keys[own + d];
    }
    barrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        if (first + row * gl_SubgroupSize >= n) continue;
        tile_keys[place[row]] = key[row];
        tile_values[place[row]] = value[row];
    }
    barrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        uint i = row * WORKGROUP + local_index();
        if (i >= pairs) continue;
        uint moved = tile_keys[i], to = move[digit_of(moved)] + i;
        sorted_keys.at[to] = moved;
        sorted_values.at[to] = tile_values[i];
    }
}
