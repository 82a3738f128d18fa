#version 460
// Sets every word to one value, ROWS per invocation; neighbouring invocations write neighbouring words.
#include "shared/kernel.glsl"
ARGUMENTS(1)
    uint count;
    uint value;
END_ARGUMENTS
BUFFER(0, writeonly, uint, to)

void main() {
    uint first = group_index() * WORKGROUP * ROWS + local_index();
    for (uint row = 0u; row < ROWS; ++row) {
        uint i = first + row * WORKGROUP;
        if (i < count) to.at[i] = value;
    }
}
