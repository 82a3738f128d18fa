// Scrambles the bits of a word. Twin of `hash` in src/mesh/kuhn.rs.
uint mix_bits(uint h) {
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
}
