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
    uint first = group_index() * WORKGROUP * ROWS + local_index();
    for (uint row = 0u; row < ROWS; ++row) {
        uint i = first + row * WORKGROUP;
        if (i < count) to.at[i] = from.at[i];
    }
}
