#version 460
// Radix sort, one tile per workgroup, of which every subgroup takes consecutive rows: equal digits of a row find each
// other by ballots, so the order within a tile is kept. The tile is sorted in shared memory before it is written, since
// pairs of a digit then go to consecutive places, and whole sectors of memory are written at once.
//
// Where a tile's pairs of a digit go follows from those of the tiles before it, which other workgroups count at the same
// time (decoupled look-back: Merrill and Garland 2016, Adinets and Merrill 2022). Vulkan does not promise that these make
// progress, so a workgroup that has waited for long counts the digits of the tile that it waits for by itself.
#include "shared/kernel.glsl"
#include "shared/workgroup.glsl"
#include "shared/sort.glsl"
#include "shared/sort_chain.glsl"
layout(constant_id = 3) const uint MAX_SUBGROUPS = 8; // at least WORKGROUP / subgroup size
layout(constant_id = 4) const uint BACKWARDS = 0; // for tests, not 0: the last tile begins first, and waits for all others
ARGUMENTS(8)
    uint count;
    uint pass;
    uint ticket; // word of `totals` that counts the tiles of this pass that have begun
    uint shift;
    uint mask; // of the digit: the last pass may have fewer bits
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, keys)
BUFFER(2, readonly, uint, values)
BUFFER(3, READ_WRITE, uint, totals)    // pairs of every digit of every pass, and tickets
BUFFER(4, CHAINED, uint, chain)        // see sort_chain.glsl
BUFFER(5, writeonly, uint, next_chain) // that of the next pass, cleared here
BUFFER(6, writeonly, uint, sorted_keys)
BUFFER(7, writeonly, uint, sorted_values)

const uint TILE = WORKGROUP * ROWS;
const uint HELD = MAX_SUBGROUPS * DIGITS;
// First, per subgroup and digit: its pairs in the rows so far, then those of the subgroups before it. Later the keys of
// the tile in order, and then its values.
shared uint held[HELD > TILE ? HELD : TILE];
// Per digit: the place of its first pair in the tile, and what leads from a place in the tile to that among all pairs.
shared uint start[DIGITS];
shared uint move[DIGITS];
shared uint begun;   // tiles that had begun before this one
shared uint missing; // 0, or 1 + a tile that has been waited for too long
const uint DIGITS_EACH = (DIGITS + WORKGROUP - 1u) / WORKGROUP; // that an invocation sums up

uint digit_of(uint key) { return key >> shift & mask; }

// Counts the digits of a tile, and tells the tiles after it, unless it has done so itself; `told` is what they read then. The
// first tile also knows where its pairs go, which `to_digit` receives. `move` is not used otherwise yet.
void tell(uint tile, uint n, out uint counts[DIGITS_EACH], out uint to_digit[DIGITS_EACH], out uint told[DIGITS_EACH]) {
    for (uint d = local_index(); d < DIGITS; d += WORKGROUP) move[d] = 0u;
    // All loads first: a loop of loads and atomics would wait for one after the other.
    uint key[ROWS], first = tile * TILE + local_index();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        uint i = first + row * WORKGROUP;
        key[row] = i < n ? keys.at[i] : 0u;
    }
    barrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        if (first + row * WORKGROUP < n) atomicAdd(move[digit_of(key[row])], 1u);
    }
    barrier();
    uint before = 0u, all;
    [[unroll]] for (uint k = 0u; k < DIGITS_EACH; ++k) {
        uint d = k * WORKGROUP + local_index();
        counts[k] = d < DIGITS ? move[d] : 0u;
        to_digit[k] = 0u;
        if (tile == 0u) {
            to_digit[k] = before + workgroup_exclusive_add(d < DIGITS ? totals.at[pass * DIGITS + d] : 0u, all);
            before += all;
        }
        uint word = tile == 0u ? all_up_to(to_digit[k] + counts[k]) : own_count(counts[k]);
        uint before_that = d < DIGITS ? atomicCompSwap(chain.at[tile * DIGITS + d], NOTHING, word) : NOTHING;
        told[k] = before_that == NOTHING ? word : before_that;
    }
}

void main() {
    uint n = min(count, live.at[0]);
    uint tiles = sort_tiles(n, TILE);
    if (group_index() >= tiles) return;
    // In the order in which workgroups begin, so that a tile waits for those only that have begun, wherever they run.
    if (local_index() == 0u) {
        begun = atomicAdd(totals.at[ticket], 1u);
        missing = 0u;
    }
    uint own = gl_SubgroupID * DIGITS;
    for (uint d = gl_SubgroupInvocationID; d < DIGITS; d += gl_SubgroupSize) held[own + d] = 0u;
    for (uint d = local_index(); d < DIGITS; d += WORKGROUP) next_chain.at[group_index() * DIGITS + d] = NOTHING;
    barrier();
    uint tile = BACKWARDS == 0u ? begun : tiles - 1u - begun;
    // Early, so that others need not wait.
    uint counts[DIGITS_EACH], to_digit[DIGITS_EACH], told[DIGITS_EACH];
    tell(tile, n, counts, to_digit, told);
    uint first = tile * TILE + gl_SubgroupID * gl_SubgroupSize * ROWS + gl_SubgroupInvocationID;
    // Of the pair in each row; its place is first how many of the subgroup's are before it, then that in the tile.
    uint key[ROWS], place[ROWS];
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        uint i = first + row * gl_SubgroupSize;
        key[row] = i < n ? keys.at[i] : 0u;
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
        uint earlier = held[own + d];
        place[row] = earlier + before;
        subgroupBarrier();
        if (live_item && before == 0u) held[own + d] = earlier + subgroupBallotBitCount(peers);
        subgroupBarrier();
    }
    barrier();
    uint pairs = 0u; // of smaller digits, and finally of the tile
    [[unroll]] for (uint k = 0u; k < DIGITS_EACH; ++k) {
        uint d = k * WORKGROUP + local_index(), sum = 0u, all;
        for (uint s = 0u; s < gl_NumSubgroups && d < DIGITS; ++s) {
            uint of_subgroup = held[s * DIGITS + d];
            held[s * DIGITS + d] = sum;
            sum += of_subgroup;
        }
        uint first_place = pairs + workgroup_exclusive_add(sum, all);
        pairs += all;
        if (d < DIGITS) start[d] = first_place;
    }
    barrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        uint d = digit_of(key[row]);
        place[row] += start[d] + held[own + d];
    }
    barrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        if (first + row * gl_SubgroupSize < n) held[place[row]] = key[row];
    }
    // The values are not loaded before, so that they take no registers while digits are counted.
    uint value[ROWS];
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        uint i = first + row * gl_SubgroupSize;
        value[row] = i < n ? values.at[i] : 0u;
    }
    // Looks back for the pairs of each digit in the tiles before.
    uint from[DIGITS_EACH]; // 1 + the tile that is looked at next; 0: none
    [[unroll]] for (uint k = 0u; k < DIGITS_EACH; ++k) from[k] = k * WORKGROUP + local_index() < DIGITS ? tile : 0u;
    uint polls = 0u; // in all, since some drivers end the loops of an invocation after 65,535 passes
    for (;;) {
        [[unroll]] for (uint k = 0u; k < DIGITS_EACH; ++k) {
            uint d = k * WORKGROUP + local_index();
            while (from[k] > 0u) {
                // Some devices load from a cache that does not see what other workgroups write; atomics do.
                uint i = (from[k] - 1u) * DIGITS + d;
                uint word = (polls & 63u) == 63u ? atomicOr(chain.at[i], 0u) : chain.at[i];
                if (word != NOTHING) {
                    step_back(word, from[k], to_digit[k]);
                } else if (++polls >= MOST_POLLS) {
                    atomicMax(missing, from[k]);
                    break;
                }
            }
        }
        barrier();
        uint late = missing;
        barrier();
        if (late == 0u) break;
        if (local_index() == 0u) missing = 0u;
        uint their_counts[DIGITS_EACH], their_digits[DIGITS_EACH];
        tell(late - 1u, n, their_counts, their_digits, told);
        [[unroll]] for (uint k = 0u; k < DIGITS_EACH; ++k) {
            if (from[k] == late) step_back(told[k], from[k], to_digit[k]);
        }
        barrier();
    }
    [[unroll]] for (uint k = 0u; k < DIGITS_EACH; ++k) {
        uint d = k * WORKGROUP + local_index();
        if (d >= DIGITS) continue;
        if (tile > 0u) atomicExchange(chain.at[tile * DIGITS + d], all_up_to(to_digit[k] + counts[k]));
        move[d] = to_digit[k] - start[d];
    }
    uint to[ROWS];
    barrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        uint i = row * WORKGROUP + local_index();
        if (i >= pairs) continue;
        uint moved = held[i];
        to[row] = move[digit_of(moved)] + i;
        sorted_keys.at[to[row]] = moved;
    }
    barrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        if (first + row * gl_SubgroupSize < n) held[place[row]] = value[row];
    }
    barrier();
    [[unroll]] for (uint row = 0u; row < ROWS; ++row) {
        uint i = row * WORKGROUP + local_index();
        if (i < pairs) sorted_values.at[to[row]] = held[i];
    }
}
