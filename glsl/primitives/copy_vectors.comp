#version 460
// Copies vectors of four words, ROWS per invocation; neighbouring invocations copy neighbouring vectors. Its rate is
// what other kernels are compared with.
#include "shared/kernel.glsl"
ARGUMENTS(2)
    uint count; // vectors
END_ARGUMENTS
BUFFER16(0, readonly, uvec4, from)
BUFFER16(1, writeonly, uvec4, to)

void main() {
    uvec2 items = items_of_tile(WORKGROUP * ROWS, count);
    for (uint i = items.x; i < items.y; i += gl_SubgroupSize) to.at[i] = from.at[i];
}
