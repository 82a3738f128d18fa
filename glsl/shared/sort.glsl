// The table that the kernels of the serial sort share: counts[digit * stride + tile]. The stride is odd, so that the
// digits of a tile do not all fall into the same cache set.
layout(constant_id = 2) const uint DIGIT_BITS = 8;
const uint DIGITS = 1u << DIGIT_BITS;

uint sort_tiles(uint n, uint tile) { return n / tile + uint(n % tile != 0u); }
uint sort_stride(uint tiles) { return tiles | 1u; }
