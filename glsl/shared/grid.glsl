// Quantization and Morton codes (SPEC 2.1). Twin of src/grid.rs; the operations and their order are the same.

const uint MAX_LEVEL = 10u; // Level of the finest grid, and number of bits per axis of its 32-bit Morton codes.

const uint STRETCHES = 16u;      // Of an axis of a graded grid: intervals with equally many cells, each as wide.
const uint STRETCH_CELLS = 64u;  // Cells of the finest grid in a stretch.

float two_to(int n) { return uintBitsToFloat(uint(n + 127) << 23); }

// x, or 0 if it is denormal.
float canonical(float x) { return (floatBitsToUint(x) & 0x7f800000u) == 0u ? 0.0 : x; }

// The integer part of x in [0, 2^23), taken from the bits of a sum, since drivers for CPUs convert floats lane by lane,
// with tests for values that are no integers. For other x, any word below 2^23.
uint whole_of(float x) {
    precise float sum = floor(x) + 8388608.0;
    return floatBitsToUint(sum) & 0x7fffffu;
}

// Distance from the lower corner, per axis.
vec3 from_corner(Grid g, vec3 x) {
    precise vec3 d = vec3(canonical(x.x), canonical(x.y), canonical(x.z)) - g.lo.xyz;
    return vec3(canonical(d.x), canonical(d.y), canonical(d.z));
}

// Whether x may lie in a mesh: false far outside of the bounds, and for what is not finite, by its bits, since drivers
// may compare NaN as they like.
bool near_bounds(Grid g, vec3 x) {
    precise vec3 t = from_corner(g, x) * g.scale;
    bool finite = all(notEqual(floatBitsToUint(x) & 0x7f800000u, uvec3(0x7f800000u)));
    return finite && all(greaterThanEqual(t, vec3(-1.0))) && all(lessThanEqual(t, vec3(3.0)));
}

// The arrays of a graded grid. They are read from memory where they are needed, since few grids are graded; whoever
// includes this file defines them.
vec4 knot(uint i);
vec4 rate(uint i);

// Distance from the lower corner in cells of the finest grid, monotone, and in a graded grid in [0, 1024].
vec3 in_cells(Grid g, vec3 d) {
    precise vec3 q = d * g.inv.xyz;
    if (g.graded == 0u) return q;
    precise vec3 sum = vec3(0.0);
    [[dont_unroll]] for (uint i = 0u; i < STRETCHES; ++i) {
        precise vec3 part = (d - knot(i).xyz) * rate(i).xyz;
        sum = sum + clamp(part, vec3(0.0), vec3(float(STRETCH_CELLS)));
    }
    return sum;
}

// Where the lower sides of a cell of the finest grid are in a graded grid: their distances from the lower corner.
vec3 graded_sides(uvec3 k) {
    uvec3 i = k / STRETCH_CELLS, j = min(i + 1u, STRETCHES);
    vec3 from = vec3(knot(i.x).x, knot(i.y).y, knot(i.z).z);
    precise vec3 width = (vec3(knot(j.x).x, knot(j.y).y, knot(j.z).z) - from) * two_to(-6);
    precise vec3 at = from + width * vec3(k % STRETCH_CELLS);
    return at;
}

// The cell of the finest grid at this distance from the lower corner, in cells of that grid, clamped into the grid.
uvec3 cell_at(vec3 q) {
    vec3 r = clamp(q, vec3(0.0), vec3(1023.0));
    return min(uvec3(whole_of(r.x), whole_of(r.y), whole_of(r.z)), 1023u);
}

// The cell of the finest grid that contains a point, clamped into the grid.
uvec3 quantize(Grid g, vec3 x) {
    return cell_at(in_cells(g, from_corner(g, x)));
}

// Packs a cell of the finest grid into one word, and unpacks it.
uint pack_cell(uvec3 q) { return q.x | q.y << 10 | q.z << 20; }
uvec3 unpack_cell(uint word) { return uvec3(word, word >> 10, word >> 20) & 1023u; }

// Normalised coordinates: multiples of 2^-42, with the largest extent of the mesh in [2^40, 2^41).
vec3 normalise(Grid g, vec3 x) {
    precise vec3 unit = from_corner(g, x) * g.scale;
    unit = vec3(canonical(unit.x), canonical(unit.y), canonical(unit.z));
    precise vec3 whole = floor(unit * two_to(82));
    precise vec3 r = whole * two_to(-42);
    return r;
}

uint spread(uint v) {
    v = (v | v << 16) & 0x030000ffu;
    v = (v | v << 8) & 0x0300f00fu;
    v = (v | v << 4) & 0x030c30c3u;
    return (v | v << 2) & 0x09249249u;
}

uint gather(uint v) {
    v &= 0x09249249u;
    v = (v | v >> 2) & 0x030c30c3u;
    v = (v | v >> 4) & 0x0300f00fu;
    v = (v | v >> 8) & 0x030000ffu;
    return (v | v >> 16) & 0x000003ffu;
}

// Morton code of a cell (Eq. 1), and back.
uint morton(uvec3 q) { return spread(q.x) << 2 | spread(q.y) << 1 | spread(q.z); }
uvec3 unmorton(uint code) { return uvec3(gather(code >> 2), gather(code >> 1), gather(code)); }

// Deterministic reciprocal: see src/grid.rs.
float reciprocal(float x) {
    float a = abs(x);
    precise float r = uintBitsToFloat(0x7ef311c7u - floatBitsToUint(a));
    for (int i = 0; i < 4; ++i) {
        precise float e = a * r;
        precise float f = 2.0 - e;
        r = r * f;
    }
    return x < 0.0 ? -r : r;
}
