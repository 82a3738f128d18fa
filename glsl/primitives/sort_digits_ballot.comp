#version 460
// Radix sort by tiles of workgroups: counts the digits of all passes at once, in shared memory, and clears the chain of
// the first pass.
#include "shared/kernel.glsl"
#include "shared/sort.glsl"
#include "shared/sort_chain.glsl"
layout(constant_id = 3) const uint PASSES = 4;
ARGUMENTS(4)
    uint count;
    uint last_mask; // of the digit of the last pass, which may have fewer bits
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, keys)
BUFFER(2, READ_WRITE, uint, totals) // pairs of every digit of every pass, and then a word per pass; zeroed
BUFFER(3, writeonly, uint, chain)   // see sort_chain.glsl

const uint TILE = WORKGROUP * ROWS;
const uint MOST_GROUPS = 512u; // that count, several tiles each: every one adds to all totals
shared uint digit_counts[PASSES * DIGITS];

void main() {
    uint n = min(count, live.at[0]), tiles = sort_tiles(n, TILE), groups = min(tiles, MOST_GROUPS);
    if (group_index() >= groups) return;
    for (uint d = local_index(); d < PASSES * DIGITS; d += WORKGROUP) digit_counts[d] = 0u;
    barrier();
    for (uint tile = group_index(); tile < tiles; tile += groups) {
        for (uint d = local_index(); d < DIGITS; d += WORKGROUP) chain.at[tile * DIGITS + d] = NOTHING;
        // All loads first: a loop of loads and atomics would wait for one after the other.
        uint key[ROWS], first = tile * TILE + local_index();
        [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
            uint i = first + row * WORKGROUP;
            key[row] = i < n ? keys.at[i] : 0u;
        }
        [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
            if (first + row * WORKGROUP >= n) continue;
            for (uint pass = 0u; pass < PASSES; ++pass) {
                uint digit = key[row] >> pass * DIGIT_BITS & (pass + 1u == PASSES ? last_mask : DIGITS - 1u);
                atomicAdd(digit_counts[pass * DIGITS + digit], 1u);
            }
        }
    }
    barrier();
    for (uint d = local_index(); d < PASSES * DIGITS; d += WORKGROUP) {
        if (digit_counts[d] > 0u) atomicAdd(totals.at[d], digit_counts[d]);
    }
}
