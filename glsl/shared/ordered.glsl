// Converts the bits of floats to unsigned keys of the same order, and back. Integer atomics on keys give maxima without
// rounding, whatever the order of the atomics.
uint ordered(uint bits) { return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u; }
uint unordered(uint key) { return (key & 0x80000000u) != 0u ? key & 0x7fffffffu : ~key; }
