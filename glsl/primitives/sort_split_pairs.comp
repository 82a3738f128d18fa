#version 460
// Radix sort, serial tiles: splits pairs into keys and values, after an odd number of passes.
#include "shared/kernel.glsl"
ARGUMENTS(4)
    uint count;
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER8(1, readonly, PAIR, pairs)
BUFFER(2, writeonly, uint, keys)
BUFFER(3, writeonly, uint, values)

void main() {
    uvec2 items = items_of_tile(WORKGROUP * ROWS, min(count, live.at[0]));
    for (uint i = items.x; i < items.y; i += gl_SubgroupSize) {
        uvec2 moved = words(pairs.at[i]);
        keys.at[i] = moved.x;
        values.at[i] = moved.y;
    }
}
