// Floats as unsigned keys of the same order: maxima by integer atomics, no rounding, and the order of the atomics does not matter.
uint ordered(uint bits) { return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u; }
uint unordered(uint key) { return (key & 0x80000000u) != 0u ? key & 0x7fffffffu : ~key; }
