#version 460
#include "shared/kernel.glsl"
// From a number of bits to the number of words that hold them.
ARGUMENTS(2)
    uint most; // bits
END_ARGUMENTS
BUFFER(0, readonly, uint, bits)
BUFFER(1, writeonly, uint, words)

void main() {
    if (item_index() > 0u) return;
    uint n = min(bits.at[0], most);
    words.at[0] = n / 32u + uint(n % 32u != 0u);
}
