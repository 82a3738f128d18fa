// The halves of its leaf's cell that an entry is near to, per axis: bit 2 c the lower one along axis c, bit 2 c + 1 the upper. They stand in the
// top bits of its word in P. Twin of src/reference/halves.rs, which explains it. Needs grid.glsl.
const uint ID_BITS = 26u; // below the halves
const uint BOTH_HALVES = 0x3fu;
const uint ALL_OCTANTS = 0xffu;

// By how many finest cells per axis boxes grow: by all of them where normalised coordinates are too coarse to tell those cells apart.
uvec3 reach_of(Grid g, uint least) { return mix(uvec3(least), uvec3(1024u), lessThan(g.extent.xyz, vec3(two_to(-30)))); }

// Those that the box of finest cells [lo, hi] meets once it has grown.
uint halves_near(Grid g, uint code, uvec3 lo, uvec3 hi) {
    if (g.level == MAX_LEVEL) return BOTH_HALVES;
    uvec3 middle = (2u * unmorton(code) + 1u) << (MAX_LEVEL - 1u - g.level), reach = reach_of(g, 1u);
    uvec3 met = uvec3(lessThan(lo, middle + reach)) + 2u * uvec3(greaterThanEqual(hi + reach, middle));
    return met.x | met.y << 2u | met.z << 4u;
}

// Those around a finest cell.
uint halves_around(uint level, uvec3 cell) {
    if (level == MAX_LEVEL) return 0u;
    uvec3 around = 1u + (cell >> (MAX_LEVEL - 1u - level) & 1u);
    return around.x | around.y << 2u | around.z << 4u;
}

// The octants of the cell that an entry is near to, one bit for each 3-bit Morton digit.
uint octants_of(uint halves) {
    uint x = (halves & 1u) * 0x0fu | (halves >> 1u & 1u) * 0xf0u;
    uint y = (halves >> 2u & 1u) * 0x33u | (halves >> 3u & 1u) * 0xccu;
    return x & y & ((halves >> 4u & 1u) * 0x55u | (halves >> 5u & 1u) * 0xaau);
}
