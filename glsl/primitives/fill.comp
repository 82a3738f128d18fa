#version 460
// Sets every word to one value, ROWS per invocation; neighbouring invocations write neighbouring words.
#include "shared/kernel.glsl"
ARGUMENTS(1)
    uint count;
    uint value;
END_ARGUMENTS
BUFFER(0, writeonly, uint, to)

void main() {
    uvec2 items = items_of_tile(WORKGROUP * ROWS, count);
    for (uint i = items.x; i < items.y; i += gl_SubgroupSize) to.at[i] = value;
}
