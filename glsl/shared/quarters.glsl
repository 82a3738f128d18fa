// The quarters of its leaf's cell that an entry is near, one bit each, axis by axis, in the top bits of its word in P;
// or the halves, where ids leave fewer bits. Twin of src/reference/quarters.rs, which explains them. Needs grid.glsl.
const uint ALL_OCTANTS = 0xffu; // The mask of all octants.

uint id_bits(Grid g) { return uint(bitCount(g.ids)); }

// How often a leaf's cell is halved along each axis. Cells of the finest grid are not cut.
uint cuts(Grid g) { return min((32u - id_bits(g)) / 6u, MAX_LEVEL - g.level); }

// By how many finest-grid cells boxes grow along each axis: by `least`, or by all cells where normalised coordinates
// are too coarse to tell these cells apart.
uvec3 reach_of(Grid g, uint least) { return mix(uvec3(least), uvec3(1024u), lessThan(g.extent.xyz, vec3(two_to(-30)))); }

// The quarters of each axis, packed as in an entry.
uint in_entry(Grid g, uvec3 quarters) {
    uint n = cuts(g), width = 1u << n;
    return n == 0u ? 0u : (quarters.x | quarters.y << width | quarters.z << 2u * width) << id_bits(g);
}

// The quarters of a leaf's cell that the box of finest-grid cells [lo, hi] meets, or else is nearest to.
uvec3 quarters_met(Grid g, uint code, uvec3 lo, uvec3 hi) {
    uint n = cuts(g), shift = MAX_LEVEL - g.level - n;
    uvec3 first = unmorton(code) << n, last = first + ((1u << n) - 1u);
    uvec3 from = clamp(lo >> shift, first, last) - first, to = clamp(hi >> shift, first, last) - first;
    return (uvec3(2u) << to) - (uvec3(1u) << from);
}

// The quarters that the box meets once it has grown, packed as in an entry.
uint quarters_near(Grid g, uint code, uvec3 lo, uvec3 hi) {
    uvec3 reach = reach_of(g, 1u);
    return in_entry(g, quarters_met(g, code, lo - min(lo, reach), hi + reach));
}

// The quarters that contain a finest-grid cell, packed as in an entry.
uint quarters_around(Grid g, uvec3 cell) {
    uint n = cuts(g);
    return in_entry(g, uvec3(1u) << (cell >> MAX_LEVEL - g.level - n & (1u << n) - 1u));
}

// One bit per octant (3-bit Morton digit) that lies in these halves of each axis: 1 is the lower half, 2 the upper, 3
// both.
uint octants_of(uvec3 halves) {
    uint x = (halves.x & 1u) * 0x0fu | (halves.x >> 1u) * 0xf0u;
    uint y = (halves.y & 1u) * 0x33u | (halves.y >> 1u) * 0xccu;
    return x & y & ((halves.z & 1u) * 0x55u | (halves.z >> 1u) * 0xaau);
}

// The octants of its leaf's cell that an entry is near.
uint octants_near(Grid g, uint entry) {
    uint n = cuts(g), width = 1u << n;
    if (n == 0u) return ALL_OCTANTS;
    uint quarters = entry >> id_bits(g);
    uvec3 each = uvec3(quarters, quarters >> width, quarters >> 2u * width) & (1u << width) - 1u;
    uint lower = (1u << width / 2u) - 1u;
    return octants_of(uvec3(notEqual(each & lower, uvec3(0u))) + 2u * uvec3(greaterThan(each, uvec3(lower))));
}
