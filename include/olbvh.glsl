// olbvh for the shaders of other programs, in any stage: point location (SPEC 3.1), walks (SPEC 2.6), all owners of a
// point, value and gradient of a field, and traversal with the host's own predicates (the paper's Alg. 3).
//
//     #version 460
//     #include "olbvh.glsl"                     first of all, since it enables extensions
//     layout(push_constant) uniform Push { uvec2 tree; };
//     ...
//     olbvh_open(tree);                         once per invocation
//     vec4 weights;
//     uint owner = olbvh_locate(place, 1e-5, weights);
//     if (owner != OLBVH_NONE) value = olbvh_value(owner, weights);
//
// `tree` is the address of a SceneAddresses that the host has filled (olbvh::glsl::SceneBuffers). On devices without
// buffer addresses, define OLBVH_DESCRIPTORS before the inclusion: the arrays are then storage buffers of set OLBVH_SET
// (0 unless defined) from binding OLBVH_BINDING (0 unless defined) on, in the order of SceneBuffers::list, and the
// argument of olbvh_open is ignored.
//
// The crate exports this file with its includes in place and with the prefix olbvh_ before all names. src/glsl.rs has
// the guide.
#ifndef OLBVH_GLSL
#define OLBVH_GLSL
#ifndef OLBVH_SET
#define OLBVH_SET 0
#endif
#ifndef OLBVH_BINDING
#define OLBVH_BINDING 0
#endif
#extension GL_EXT_control_flow_attributes : require
#ifdef OLBVH_DESCRIPTORS
#define OLBVH_BUFFER(slot, alignment, T, name)                                                                                  \
    layout(set = OLBVH_SET, binding = OLBVH_BINDING + slot, std430) readonly buffer name##Block { T at[]; } name;
#else
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#define OLBVH_BUFFER(slot, alignment, T, name)                                                                                  \
    layout(buffer_reference, std430, buffer_reference_align = alignment) readonly buffer name##Block { T at[]; };               \
    name##Block name;
#endif
#define OLBVH_NONE 0xffffffffu

const uint olbvh_NONE = OLBVH_NONE;
// Records of four words are read as they are. Kernels of the library can also read them as two 64-bit words.
uvec4 olbvh_words(uvec4 record) { return record; }
vec4 olbvh_floats(vec4 record) { return record; }
// The structs by which shaders of other programs, too, know a tree.

// The grid of a mesh (SPEC 2.1).
struct olbvh_Grid {
    vec4 lo;      // Lower corner of the bounds.
    vec4 hi;      // Upper corner of the bounds.
    vec4 inv;     // Finest cells per unit of length, 0 on a flat axis.
    vec4 extent;  // Upper corner in normalised coordinates.
    float scale;  // Power of two that brings the largest extent into [1, 2).
    uint level;   // Level of the leaves, l.
    uint first_leaf; // Node index of the first leaf, n_ni.
    uint ids;     // Bits of an entry of P that hold its tetrahedron; the bits above are its quarters, if there are any.
    uint slabs;   // Word of PO where the slabs of the leaves begin; 0: there are none.
    uint longest; // Entries of the longest leaf.
    uint graded;  // Not 0: cells are smaller where the mesh has more tetrahedra, see src/mesh/grading.rs.
    uint pad;     // Unused.
    vec4 knots[17]; // If it is graded: where the stretches of each axis begin, as distances from `lo`, and the extent.
    vec4 rates[16]; // If it is graded: finest cells per unit of length in each stretch, 0 on a flat axis.
};

// Device addresses of a mesh and its tree, for the shaders of other programs, low word first. See src/glsl.rs.
struct olbvh_SceneAddresses {
    uvec2 grid;       // Grid with the level of the leaves.
    uvec2 masks;      // Child masks.
    uvec2 co;         // Child offsets.
    uvec2 po;         // Offsets of the leaves in `p`, and the slabs of the leaves.
    uvec2 p;          // Entries: ids of tetrahedra, and their quarters above them.
    uvec2 flags;      // Boundary flags.
    uvec2 cells;      // Vertex indices.
    uvec2 vertices;   // Normalised coordinates.
    uvec2 neighbours; // Neighbour table.
    uvec2 field;      // One float per point; any address if there is no field.
    uint lists;       // 1: leaves within the mesh have a seed instead of a list.
    uint has_field;   // Not 0: there is a field.
};

OLBVH_BUFFER(0, 8, olbvh_SceneAddresses, olbvh_scene)
OLBVH_BUFFER(1, 16, olbvh_Grid, olbvh_grid)
OLBVH_BUFFER(2, 4, uint, olbvh_masks)
OLBVH_BUFFER(3, 4, uint, olbvh_co)
OLBVH_BUFFER(4, 4, uint, olbvh_po)
OLBVH_BUFFER(5, 4, uint, olbvh_p)
OLBVH_BUFFER(6, 4, uint, olbvh_flags)
OLBVH_BUFFER(7, 16, uvec4, olbvh_cells)
OLBVH_BUFFER(8, 16, vec4, olbvh_vertices)
OLBVH_BUFFER(9, 16, uvec4, olbvh_neighbours)
OLBVH_BUFFER(10, 4, float, olbvh_field)
uint olbvh_LISTS;

vec4 olbvh_knot(uint i) { return olbvh_grid.at[0].knots[i]; }
vec4 olbvh_rate(uint i) { return olbvh_grid.at[0].rates[i]; }
// Quantization and Morton codes (SPEC 2.1). Twin of src/grid.rs; the operations and their order are the same.

const uint olbvh_MAX_LEVEL = 10u; // Level of the finest grid, and number of bits per axis of its 32-bit Morton codes.

const uint olbvh_STRETCHES = 16u;      // Of an axis of a graded grid: intervals with equally many cells, each as wide.
const uint olbvh_STRETCH_CELLS = 64u;  // Cells of the finest grid in a stretch.

float olbvh_two_to(int n) { return uintBitsToFloat(uint(n + 127) << 23); }

// x, or 0 if it is denormal.
float olbvh_canonical(float x) { return (floatBitsToUint(x) & 0x7f800000u) == 0u ? 0.0 : x; }

// The integer part of x in [0, 2^23), taken from the bits of a sum, since drivers for CPUs convert floats lane by lane,
// with tests for values that are no integers. For other x, any word below 2^23.
uint olbvh_whole_of(float x) {
    precise float sum = floor(x) + 8388608.0;
    return floatBitsToUint(sum) & 0x7fffffu;
}

// Distance from the lower corner, per axis.
vec3 olbvh_from_corner(olbvh_Grid g, vec3 x) {
    precise vec3 d = vec3(olbvh_canonical(x.x), olbvh_canonical(x.y), olbvh_canonical(x.z)) - g.lo.xyz;
    return vec3(olbvh_canonical(d.x), olbvh_canonical(d.y), olbvh_canonical(d.z));
}

// Whether x may lie in a mesh: false far outside of the bounds, and for what is not finite, by its bits, since drivers
// may compare NaN as they like.
bool olbvh_near_bounds(olbvh_Grid g, vec3 x) {
    precise vec3 t = olbvh_from_corner(g, x) * g.scale;
    bool finite = all(notEqual(floatBitsToUint(x) & 0x7f800000u, uvec3(0x7f800000u)));
    return finite && all(greaterThanEqual(t, vec3(-1.0))) && all(lessThanEqual(t, vec3(3.0)));
}

// The arrays of a graded grid. They are read from memory where they are needed, since few grids are graded; whoever
// includes this file defines them.
vec4 olbvh_knot(uint i);
vec4 olbvh_rate(uint i);

// Distance from the lower corner in cells of the finest grid, monotone, and in a graded grid in [0, 1024].
vec3 olbvh_in_cells(olbvh_Grid g, vec3 d) {
    precise vec3 q = d * g.inv.xyz;
    if (g.graded == 0u) return q;
    precise vec3 sum = vec3(0.0);
    [[dont_unroll]] for (uint i = 0u; i < olbvh_STRETCHES; ++i) {
        precise vec3 part = (d - olbvh_knot(i).xyz) * olbvh_rate(i).xyz;
        sum = sum + clamp(part, vec3(0.0), vec3(float(olbvh_STRETCH_CELLS)));
    }
    return sum;
}

// Where the lower sides of a cell of the finest grid are in a graded grid: their distances from the lower corner.
vec3 olbvh_graded_sides(uvec3 k) {
    uvec3 i = k / olbvh_STRETCH_CELLS, j = min(i + 1u, olbvh_STRETCHES);
    vec3 from = vec3(olbvh_knot(i.x).x, olbvh_knot(i.y).y, olbvh_knot(i.z).z);
    precise vec3 width = (vec3(olbvh_knot(j.x).x, olbvh_knot(j.y).y, olbvh_knot(j.z).z) - from) * olbvh_two_to(-6);
    precise vec3 at = from + width * vec3(k % olbvh_STRETCH_CELLS);
    return at;
}

// The cell of the finest grid at this distance from the lower corner, in cells of that grid, clamped into the grid.
uvec3 olbvh_cell_at(vec3 q) {
    vec3 r = clamp(q, vec3(0.0), vec3(1023.0));
    return min(uvec3(olbvh_whole_of(r.x), olbvh_whole_of(r.y), olbvh_whole_of(r.z)), 1023u);
}

// The cell of the finest grid that contains a point, clamped into the grid.
uvec3 olbvh_quantize(olbvh_Grid g, vec3 x) {
    return olbvh_cell_at(olbvh_in_cells(g, olbvh_from_corner(g, x)));
}

// Packs a cell of the finest grid into one word, and unpacks it.
uint olbvh_pack_cell(uvec3 q) { return q.x | q.y << 10 | q.z << 20; }
uvec3 olbvh_unpack_cell(uint word) { return uvec3(word, word >> 10, word >> 20) & 1023u; }

// Normalised coordinates: multiples of 2^-42, with the largest extent of the mesh in [2^40, 2^41).
vec3 olbvh_normalise(olbvh_Grid g, vec3 x) {
    precise vec3 unit = olbvh_from_corner(g, x) * g.scale;
    unit = vec3(olbvh_canonical(unit.x), olbvh_canonical(unit.y), olbvh_canonical(unit.z));
    precise vec3 whole = floor(unit * olbvh_two_to(82));
    precise vec3 r = whole * olbvh_two_to(-42);
    return r;
}

uint olbvh_spread(uint v) {
    v = (v | v << 16) & 0x030000ffu;
    v = (v | v << 8) & 0x0300f00fu;
    v = (v | v << 4) & 0x030c30c3u;
    return (v | v << 2) & 0x09249249u;
}

uint olbvh_gather(uint v) {
    v &= 0x09249249u;
    v = (v | v >> 2) & 0x030c30c3u;
    v = (v | v >> 4) & 0x0300f00fu;
    v = (v | v >> 8) & 0x030000ffu;
    return (v | v >> 16) & 0x000003ffu;
}

// Morton code of a cell (Eq. 1), and back.
uint olbvh_morton(uvec3 q) { return olbvh_spread(q.x) << 2 | olbvh_spread(q.y) << 1 | olbvh_spread(q.z); }
uvec3 olbvh_unmorton(uint code) { return uvec3(olbvh_gather(code >> 2), olbvh_gather(code >> 1), olbvh_gather(code)); }

// Deterministic reciprocal: see src/grid.rs.
float olbvh_reciprocal(float x) {
    float a = abs(x);
    precise float r = uintBitsToFloat(0x7ef311c7u - floatBitsToUint(a));
    for (int i = 0; i < 4; ++i) {
        precise float e = a * r;
        precise float f = 2.0 - e;
        r = r * f;
    }
    return x < 0.0 ? -r : r;
}
// Orientation, containment and barycentric coordinates in normalised coordinates (SPEC 2.1, 3.1). Twin of
// src/reference/tet.rs; the operations and their order are the same.

// The vertices of the face opposite to each vertex.
const uvec3 olbvh_FACES[4] = uvec3[4](uvec3(1, 2, 3), uvec3(0, 2, 3), uvec3(0, 1, 3), uvec3(0, 1, 2));
// Edges, and the two vertices that are not on them.
const uvec4 olbvh_EDGES[6] =
    uvec4[6](uvec4(0, 1, 2, 3), uvec4(0, 2, 1, 3), uvec4(0, 3, 1, 2), uvec4(1, 2, 0, 3), uvec4(1, 3, 0, 2), uvec4(2, 3, 0, 1));

vec3 olbvh_cross_product(vec3 a, vec3 b) {
    precise vec3 r = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
    return r;
}

// What the products in `cross_product` amount to: a bound for its error.
vec3 olbvh_sum_of_products(vec3 a, vec3 b) {
    a = abs(a);
    b = abs(b);
    precise vec3 r = vec3(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x);
    return r;
}

float olbvh_dot_product(vec3 a, vec3 b) {
    precise float r = (a.x * b.x + a.y * b.y) + a.z * b.z;
    return r;
}

// Six times the signed volume of (a, b, c, p). It is computed relative to p, so that it is exactly 0 where p is one of
// the others.
float olbvh_orient(vec3 a, vec3 b, vec3 c, vec3 olbvh_p) {
    precise vec3 pa = a - olbvh_p, pb = b - olbvh_p, pc = c - olbvh_p;
    return -olbvh_dot_product(olbvh_cross_product(pa, pb), pc);
}

// A tetrahedron with its vertices in ascending global index.
struct olbvh_Tet {
    vec3 v[4];
    uvec4 rank; // place in v of each vertex in the caller's order
};

// A point relative to a tetrahedron.
struct olbvh_Weights {
    vec4 w;      // signed volumes opposite to the vertices in ascending index, positive inside
    float sum;
    bool in_box; // inside the closed box of the vertices
    bool inside; // the closed tetrahedron contains the point, and is not flat
    bool clear;  // inside by more than the margin, so that rounding cannot put the point into a neighbour as well
    float margin; // of the tetrahedron, see Bounds
};

// The place of each of four different vertex indices in ascending order.
uvec4 olbvh_ranks(uvec4 ids) {
    uint yx = uint(ids.y < ids.x), zx = uint(ids.z < ids.x), wx = uint(ids.w < ids.x);
    uint zy = uint(ids.z < ids.y), wy = uint(ids.w < ids.y), wz = uint(ids.w < ids.z);
    return uvec4(yx + zx + wx, (1u - yx) + zy + wy, (1u - zx) + (1u - zy) + wz, (1u - wx) + (1u - wy) + (1u - wz));
}

vec3 olbvh_select_rank(uvec4 rank, uint r, vec3 a, vec3 b, vec3 c, vec3 d) {
    return rank.x == r ? a : rank.y == r ? b : rank.z == r ? c : d;
}

// A Tet from corners in the caller's order.
olbvh_Tet olbvh_make_tet(uvec4 ids, vec3 a, vec3 b, vec3 c, vec3 d) {
    olbvh_Tet t;
    t.rank = olbvh_ranks(ids);
    for (uint r = 0u; r < 4u; ++r) t.v[r] = olbvh_select_rank(t.rank, r, a, b, c, d);
    return t;
}

float olbvh_volume(olbvh_Tet t) { return olbvh_orient(t.v[0], t.v[1], t.v[2], t.v[3]); }

// The box of a tetrahedron, and its margin: if a weight is this close to 0, rounding may have put the point on either
// side of the face.
struct olbvh_Bounds {
    vec3 lo;
    vec3 hi;
    float margin;
};

// Minimum and maximum of coordinates. These are not negative, so their order is that of their bits, and integer
// operations need no care for NaN.
vec3 olbvh_smaller(vec3 a, vec3 b) { return uintBitsToFloat(min(floatBitsToUint(a), floatBitsToUint(b))); }
vec3 olbvh_larger(vec3 a, vec3 b) { return uintBitsToFloat(max(floatBitsToUint(a), floatBitsToUint(b))); }

olbvh_Bounds olbvh_bounds_of(vec3 v[4]) {
    olbvh_Bounds r;
    r.lo = olbvh_smaller(olbvh_smaller(v[0], v[1]), olbvh_smaller(v[2], v[3]));
    r.hi = olbvh_larger(olbvh_larger(v[0], v[1]), olbvh_larger(v[2], v[3]));
    precise vec3 size = r.hi - r.lo;
    precise float margin = ((size.x * size.y) * size.z) * olbvh_two_to(-16);
    r.margin = margin;
    return r;
}

bool olbvh_holds(olbvh_Bounds box, vec3 olbvh_p) { return all(lessThanEqual(box.lo, olbvh_p)) && all(lessThanEqual(olbvh_p, box.hi)); }

olbvh_Weights olbvh_weights(olbvh_Tet t, vec3 olbvh_p) {
    float vol = olbvh_volume(t);
    float s = vol < 0.0 ? -1.0 : 1.0;
    // `orient` of the four faces and p; its sign alternates with the opposite vertex.
    precise vec3 a = t.v[0] - olbvh_p, b = t.v[1] - olbvh_p, c = t.v[2] - olbvh_p, d = t.v[3] - olbvh_p;
    vec3 ab = olbvh_cross_product(a, b);
    olbvh_Weights r;
    r.w = vec4(s * olbvh_dot_product(olbvh_cross_product(b, c), d), -s * olbvh_dot_product(olbvh_cross_product(a, c), d), s * olbvh_dot_product(ab, d), -s * olbvh_dot_product(ab, c));
    precise float sum = (r.w.x + r.w.y) + (r.w.z + r.w.w);
    r.sum = sum;
    olbvh_Bounds box = olbvh_bounds_of(t.v);
    r.in_box = olbvh_holds(box, olbvh_p);
    r.inside = r.in_box && vol != 0.0 && all(greaterThanEqual(r.w, vec4(0.0)));
    r.clear = r.inside && all(greaterThan(r.w, vec4(box.margin)));
    r.margin = box.margin;
    return r;
}

float olbvh_least_of(vec4 w) { return min(min(w.x, w.y), min(w.z, w.w)); }

// Whether the point lies outside of no face by more than the margin.
bool olbvh_near(olbvh_Weights r) { return olbvh_least_of(r.w) >= -r.margin; }

// Whether the point is within the margin of one face, and inside of all others by more than the margin.
bool olbvh_near_one_face(olbvh_Weights r) {
    uvec4 close = uvec4(lessThanEqual(r.w, vec4(r.margin)));
    return olbvh_near(r) && close.x + close.y + close.z + close.w == 1u;
}

// Weights in the caller's order of vertices, which is that of the faces.
vec4 olbvh_own_weights(olbvh_Weights w, olbvh_Tet tet) { return vec4(w.w[tet.rank.x], w.w[tet.rank.y], w.w[tet.rank.z], w.w[tet.rank.w]); }

// The face with the smallest weight: the one that the point lies farthest outside of.
uint olbvh_outermost(vec4 own) {
    uint face = 0u;
    for (uint f = 1u; f < 4u; ++f) face = own[f] < own[face] ? f : face;
    return face;
}

// What a step of a walk needs. It is cheaper than `weights`, but by rounding, two neighbours may disagree on which side
// of their shared face a point lies.
struct olbvh_Sides {
    vec4 w;     // as in Weights, opposite to the vertices in the order given
    float sum;  // of the weights
    bool clear; // as in Weights
    bool near;  // outside of no face by more than the margin
};

olbvh_Sides olbvh_sides_of(vec3 v[4], olbvh_Bounds box, vec3 olbvh_p) {
    precise vec3 a = v[0] - olbvh_p, b = v[1] - olbvh_p, c = v[2] - olbvh_p, d = v[3] - olbvh_p;
    vec3 ab = olbvh_cross_product(a, b), cd = olbvh_cross_product(c, d);
    vec4 w = vec4(olbvh_dot_product(cd, b), -olbvh_dot_product(cd, a), olbvh_dot_product(ab, d), -olbvh_dot_product(ab, c));
    precise float sum = (w.x + w.y) + (w.z + w.w);
    olbvh_Sides r;
    r.w = sum < 0.0 ? -w : w;
    r.sum = abs(sum);
    r.clear = olbvh_holds(box, olbvh_p) && all(greaterThan(r.w, vec4(box.margin)));
    r.near = all(greaterThanEqual(r.w, vec4(-box.margin)));
    return r;
}

// Barycentric coordinates in the order of the vertices.
vec4 olbvh_barycentric(olbvh_Sides r) {
    float k = r.sum <= 0.0 ? 0.0 : olbvh_reciprocal(r.sum);
    precise vec4 b = r.w * k;
    return b;
}

// Barycentric coordinates of any point in the caller's order: those reported with an owner, however it was found. A zero
// has no sign, which Vulkan does not promise to keep.
vec4 olbvh_barycentric(olbvh_Tet t, vec3 olbvh_p) {
    vec4 b = olbvh_barycentric(olbvh_sides_of(t.v, olbvh_bounds_of(t.v), olbvh_p));
    return vec4(olbvh_canonical(b[t.rank.x]), olbvh_canonical(b[t.rank.y]), olbvh_canonical(b[t.rank.z]), olbvh_canonical(b[t.rank.w]));
}

// The value at barycentric coordinates, interpolated from the values at the corners; exact where these are equal.
float olbvh_weighed(vec4 b, vec4 at_corners) {
    precise vec3 beside = at_corners.xyz - at_corners.w;
    precise float r = ((b.x * beside.x + b.y * beside.y) + b.z * beside.z) + at_corners.w;
    return r;
}

const float olbvh_SMALLEST_FLOAT = -3.40282347e38;

// Smallest barycentric coordinate; SMALLEST_FLOAT for a flat tetrahedron. It is 0 where rounding may have put the point
// outside: 2^-18 of the box is the most that it can change a weight by (at most 54 half units in the last place, of
// products of three sides of the box). In thin tetrahedra, this exceeds the usual tolerance.
float olbvh_smallest(olbvh_Weights r) {
    precise float rounding = r.margin * 0.25;
    if (r.in_box && olbvh_least_of(r.w) >= -rounding) return 0.0;
    if (r.sum <= 0.0) return olbvh_SMALLEST_FLOAT;
    precise float b = olbvh_least_of(r.w) * olbvh_reciprocal(r.sum);
    return b;
}

// Barycentric coordinates in the caller's order of vertices.
vec4 olbvh_barycentric(olbvh_Weights r, uvec4 rank) {
    float k = r.sum <= 0.0 ? 0.0 : olbvh_reciprocal(r.sum);
    precise vec4 b = vec4(r.w[rank.x], r.w[rank.y], r.w[rank.z], r.w[rank.w]) * k;
    return b;
}
// A node as predicates see it.
struct olbvh_Node {
    uint index;
    uint level;
    uint code; // Morton code of its cell at that level
};
// A tree as queries see it (SPEC 2.5). The including kernel declares grid, masks, co, po, p and, where used, flags,
// cells, vertices.

// The children of a node. The including kernel declares masks and co.

// One bit per 3-bit Morton digit: the children that an internal node has, or the octants of a leaf that its tetrahedra
// are near.
uint olbvh_child_mask(uint node) { return olbvh_masks.at[node >> 2u] >> (8u * (node & 3u)) & 0xffu; }

uint olbvh_child_of(uint node, uint mask, uint digit) { return olbvh_co.at[node] + 1u + bitCount(mask & ((1u << digit) - 1u)); }

// The node of the cell with Morton code `code` on `level`, found below `node` of level `from`; NONE if there is none.
uint olbvh_find_node(uint node, uint from, uint level, uint code) {
    for (uint k = level - from; k > 0u; --k) {
        uint digit = code >> (3u * (k - 1u)) & 7u, mask = olbvh_child_mask(node);
        if ((mask >> digit & 1u) == 0u) return olbvh_NONE;
        node = olbvh_child_of(node, mask, digit);
    }
    return node;
}

// The leaf that contains a cell of the finest grid, found by descent over child masks. NONE if there is none, or if
// none of its tetrahedra is near the cell.
uint olbvh_find_leaf(uint level, uvec3 finest) {
    uint code = olbvh_morton(finest), leaf = olbvh_find_node(0u, 0u, level, code >> (3u * (olbvh_MAX_LEVEL - level)));
    if (leaf == olbvh_NONE || level == olbvh_MAX_LEVEL) return leaf;
    return (olbvh_child_mask(leaf) >> (code >> (3u * (olbvh_MAX_LEVEL - 1u - level)) & 7u) & 1u) != 0u ? leaf : olbvh_NONE;
}

// The level of the largest cell around a finest-grid cell, given by its code, that no tetrahedron is near: a missing
// node, or an octant of a leaf. 0 if there is none; `node`, the node of level `from` around it, then becomes the leaf.
uint olbvh_empty_level(uint level, uint code, uint from, inout uint node) {
    for (uint at = from + 1u; at <= min(level + 1u, olbvh_MAX_LEVEL); ++at) {
        uint digit = code >> (3u * (olbvh_MAX_LEVEL - at)) & 7u, mask = olbvh_child_mask(node);
        if ((mask >> digit & 1u) == 0u) return at;
        if (at <= level) node = olbvh_child_of(node, mask, digit);
    }
    return 0u;
}

// The tetrahedron of an entry; the bits above it are quarters.
uint olbvh_listed_tet(uint entry) { return olbvh_p.at[entry] & olbvh_grid.at[0].ids; }

// The first entry of a leaf, and one past its last.
uvec2 olbvh_entry_range(uint leaf) {
    uint i = leaf - olbvh_grid.at[0].first_leaf;
    return uvec2(olbvh_po.at[i], olbvh_po.at[i + 1u]);
}

// Whether the tree holds nothing: one without tetrahedra, or one that did not fit.
bool olbvh_is_empty_tree(uint level) { return level == 0u ? olbvh_entry_range(0u).y == 0u : olbvh_child_mask(0u) == 0u; }
// Point location in a leaf's list (SPEC 3.1). Twin of `listed` in src/reference/locate.rs. Needs tree.glsl, tet.glsl,
// and flags, cells, vertices.

// Whether the surface of the mesh may pass through a node's cell. The including kernel declares flags.
bool olbvh_is_boundary_node(uint node) { return (olbvh_flags.at[node >> 5u] >> (node & 31u) & 1u) != 0u; }
// Candidate owners of a point. Twin of src/reference/best_owner.rs. Needs grid.glsl and vertices.
// Vertices and tetrahedra as 02_normalise_vertices leaves them. The including kernel declares `vertices`: normalised
// coordinates, and the cell of the finest grid.

vec3 olbvh_vertex(uint v) { return olbvh_floats(olbvh_vertices.at[v]).xyz; }

uvec3 olbvh_vertex_cell(uint v) { return olbvh_unpack_cell(floatBitsToUint(olbvh_floats(olbvh_vertices.at[v]).w)); }

olbvh_Tet olbvh_load_tet(uvec4 ids) { return olbvh_make_tet(ids, olbvh_vertex(ids.x), olbvh_vertex(ids.y), olbvh_vertex(ids.z), olbvh_vertex(ids.w)); }
// The quarters of its leaf's cell that an entry is near, one bit each, axis by axis, in the top bits of its word in P;
// or the halves, where ids leave fewer bits. Twin of src/reference/quarters.rs, which explains them. Needs grid.glsl.
const uint olbvh_ALL_OCTANTS = 0xffu; // The mask of all octants.

uint olbvh_id_bits(olbvh_Grid g) { return uint(bitCount(g.ids)); }

// How often a leaf's cell is halved along each axis. Cells of the finest grid are not cut.
uint olbvh_cuts(olbvh_Grid g) { return min((32u - olbvh_id_bits(g)) / 6u, olbvh_MAX_LEVEL - g.level); }

// By how many finest-grid cells boxes grow along each axis: by `least`, or by all cells where normalised coordinates
// are too coarse to tell these cells apart.
uvec3 olbvh_reach_of(olbvh_Grid g, uint least) { return mix(uvec3(least), uvec3(1024u), lessThan(g.extent.xyz, vec3(olbvh_two_to(-30)))); }

// The quarters of each axis, packed as in an entry.
uint olbvh_in_entry(olbvh_Grid g, uvec3 quarters) {
    uint n = olbvh_cuts(g), width = 1u << n;
    return n == 0u ? 0u : (quarters.x | quarters.y << width | quarters.z << 2u * width) << olbvh_id_bits(g);
}

// The quarters of a leaf's cell that the box of finest-grid cells [lo, hi] meets, or else is nearest to.
uvec3 olbvh_quarters_met(olbvh_Grid g, uint code, uvec3 lo, uvec3 hi) {
    uint n = olbvh_cuts(g), shift = olbvh_MAX_LEVEL - g.level - n;
    uvec3 first = olbvh_unmorton(code) << n, last = first + ((1u << n) - 1u);
    uvec3 from = clamp(lo >> shift, first, last) - first, to = clamp(hi >> shift, first, last) - first;
    return (uvec3(2u) << to) - (uvec3(1u) << from);
}

// The quarters that the box meets once it has grown, packed as in an entry.
uint olbvh_quarters_near(olbvh_Grid g, uint code, uvec3 lo, uvec3 hi) {
    uvec3 reach = olbvh_reach_of(g, 1u);
    return olbvh_in_entry(g, olbvh_quarters_met(g, code, lo - min(lo, reach), hi + reach));
}

// The quarters that contain a finest-grid cell, packed as in an entry.
uint olbvh_quarters_around(olbvh_Grid g, uvec3 cell) {
    uint n = olbvh_cuts(g);
    return olbvh_in_entry(g, uvec3(1u) << (cell >> olbvh_MAX_LEVEL - g.level - n & (1u << n) - 1u));
}

// One bit per octant (3-bit Morton digit) that lies in these halves of each axis: 1 is the lower half, 2 the upper, 3
// both.
uint olbvh_octants_of(uvec3 halves) {
    uint x = (halves.x & 1u) * 0x0fu | (halves.x >> 1u) * 0xf0u;
    uint y = (halves.y & 1u) * 0x33u | (halves.y >> 1u) * 0xccu;
    return x & y & ((halves.z & 1u) * 0x55u | (halves.z >> 1u) * 0xaau);
}

// The octants of its leaf's cell that an entry is near.
uint olbvh_octants_near(olbvh_Grid g, uint entry) {
    uint n = olbvh_cuts(g), width = 1u << n;
    if (n == 0u) return olbvh_ALL_OCTANTS;
    uint quarters = entry >> olbvh_id_bits(g);
    uvec3 each = uvec3(quarters, quarters >> width, quarters >> 2u * width) & (1u << width) - 1u;
    uint lower = (1u << width / 2u) - 1u;
    return olbvh_octants_of(uvec3(notEqual(each & lower, uvec3(0u))) + 2u * uvec3(greaterThan(each, uvec3(lower))));
}

// A point whose owner is searched for.
struct olbvh_Sought {
    vec3 x;             // in normalised coordinates
    uvec3 least, most;  // range of finest-grid cells that the box of an owner must meet
    uint quarters;      // quarters of its leaf's cell that contain it, packed as in an entry; 0: not tested
};

// How many finest cells a box grows by on every side so that it contains all points that its tetrahedron may own.
// Those of a graded grid may be 64 times as small.
uint olbvh_cells_beyond(olbvh_Grid g, float tolerance) {
    precise float olbvh_cells = clamp(tolerance, 0.0, 1.0) * (g.graded == 0u ? 4096.0 : 262144.0);
    return 1u + olbvh_whole_of(olbvh_cells);
}

// Whether quarters and slabs leave room for a tolerance.
bool olbvh_leaves_room(olbvh_Grid g, float tolerance) { return olbvh_cells_beyond(g, tolerance) == 1u; }

// The point `at`, in the units of the mesh. A point with barycentric coordinates of at least -t lies outside of the
// tetrahedron's box by at most 3 t times the size of the box.
olbvh_Sought olbvh_sought_at(olbvh_Grid g, vec3 at, vec3 x, float tolerance) {
    uvec3 cell = olbvh_quantize(g, at);
    uvec3 reach = olbvh_reach_of(g, olbvh_cells_beyond(g, tolerance));
    return olbvh_Sought(x, cell - min(cell, reach), cell + reach, olbvh_leaves_room(g, tolerance) ? olbvh_quarters_around(g, cell) : 0u);
}

// Whether a tetrahedron's quantized box is near enough for it to own the point. This reads one word per vertex, its
// cell of the finest grid.
bool olbvh_is_near(uvec4 ids, olbvh_Sought s) {
    uvec3 a = olbvh_vertex_cell(ids.x), b = olbvh_vertex_cell(ids.y), c = olbvh_vertex_cell(ids.z), d = olbvh_vertex_cell(ids.w);
    return all(lessThanEqual(min(min(a, b), min(c, d)), s.most)) && all(greaterThanEqual(max(max(a, b), max(c, d)), s.least));
}

// The best candidate owner so far.
struct olbvh_Best {
    uint owner; // NONE: none yet
    bool inside;
    bool in_box;
    float smallest;
};

olbvh_Best olbvh_no_best() { return olbvh_Best(olbvh_NONE, false, false, olbvh_SMALLEST_FLOAT); }

// Takes candidate t if it is better. Tetrahedra that contain the point come first, ordered by id; then those whose box
// contains it; then those with a larger smallest barycentric coordinate; then those with a lower id. Flat tetrahedra
// are never taken.
void olbvh_consider(inout olbvh_Best best, uint t, olbvh_Tet tet, olbvh_Weights w) {
    if (w.inside) {
        if (!best.inside || t < best.owner) best = olbvh_Best(t, true, true, 0.0);
        return;
    }
    if (best.inside) return;
    float s = olbvh_smallest(w);
    bool closer = s > best.smallest || (s == best.smallest && t < best.owner);
    bool better = best.owner == olbvh_NONE || (w.in_box && !best.in_box) || (w.in_box == best.in_box && closer);
    if (better && olbvh_volume(tet) != 0.0) best = olbvh_Best(t, false, w.in_box, s);
}
// Points beside the mesh, as the slabs of the leaves tell. Needs tree.glsl.
// Slabs: two parallel planes per leaf between which all tetrahedra of its list lie. Twin of src/reference/slabs.rs, which
// explains them; the operations and their order are the same. Needs grid.glsl and tet.glsl.
// Centre and half size of a cell in normalised coordinates. Twin of `cell_centre` and `half_cell` in
// src/reference/assign.rs. Needs grid.glsl.

struct olbvh_CellShape {
    vec3 centre;
    vec3 half_size;
};

// Half the size of the cells of a level, unless the grid is graded.
vec3 olbvh_half_cell(olbvh_Grid g, uint level) {
    precise vec3 cell = g.extent.xyz * olbvh_two_to(-1 - int(level));
    precise vec3 whole = g.extent.xyz * 0.5;
    return vec3(g.inv.x == 0.0 ? whole.x : cell.x, g.inv.y == 0.0 ? whole.y : cell.y, g.inv.z == 0.0 ? whole.z : cell.z);
}

// The multiple of 2^-42 below x.
vec3 olbvh_whole_steps(vec3 x) {
    precise vec3 r = floor(x * olbvh_two_to(42)) * olbvh_two_to(-42);
    return r;
}

// The centre of a cell of this half size, unless the grid is graded.
vec3 olbvh_cell_centre(vec3 h, uvec3 cell) {
    precise vec3 a = vec3(2u * cell + 1u) * h;
    return olbvh_whole_steps(a);
}

// The lower sides of a cell of the finest grid, if the grid is graded.
vec3 olbvh_normalised_sides(olbvh_Grid g, uvec3 k) {
    precise vec3 unit = olbvh_graded_sides(k) * g.scale;
    unit = vec3(olbvh_canonical(unit.x), olbvh_canonical(unit.y), olbvh_canonical(unit.z));
    precise vec3 r = floor(unit * olbvh_two_to(82)) * olbvh_two_to(-42);
    return r;
}

// A cell of a level in any grid.
olbvh_CellShape olbvh_cell_shape(olbvh_Grid g, uint level, uvec3 cell) {
    vec3 h = olbvh_half_cell(g, level);
    if (g.graded == 0u) return olbvh_CellShape(olbvh_cell_centre(h, cell), h);
    uint shift = olbvh_MAX_LEVEL - level;
    vec3 lower = olbvh_normalised_sides(g, cell << shift);
    precise vec3 size = olbvh_normalised_sides(g, (cell + 1u) << shift) - lower;
    h = mix(0.5 * size, h, equal(g.inv.xyz, vec3(0.0)));
    precise vec3 middle = lower + h; // of a flat axis, too, whose lower side is 0
    return olbvh_CellShape(olbvh_whole_steps(middle), h);
}

const uint olbvh_EVERYTHING = 0xff00u; // A slab that contains every point.

// The coordinates in a leaf's cell that slabs are given in.
struct olbvh_SlabCell {
    vec3 centre;
    vec3 inverse;
};

// Reciprocals of the half sizes of a leaf's cell (leaves of a graded grid have no slabs), 0 on axes that normalised coordinates are too coarse for.
vec3 olbvh_slab_scale(olbvh_Grid g) {
    vec3 h = olbvh_half_cell(g, g.level), r;
    for (uint c = 0u; c < 3u; ++c) r[c] = g.extent[c] < olbvh_two_to(-30) ? 0.0 : olbvh_reciprocal(h[c]);
    return r;
}

olbvh_SlabCell olbvh_slab_cell(olbvh_Grid g, vec3 scale, uvec3 cell) { return olbvh_SlabCell(olbvh_cell_centre(olbvh_half_cell(g, g.level), cell), scale); }

vec3 olbvh_in_cell(olbvh_SlabCell cell, vec3 x) {
    precise vec3 y = (x - cell.centre) * cell.inverse;
    return y;
}

// The place of a plane or a point at distance d.
uint olbvh_slab_place(float d) {
    precise float at = d * 42.0 + 127.5;
    return olbvh_whole_of(clamp(at, 0.0, 255.0));
}

// The normal of a slab, whose largest component is 1.
vec3 olbvh_slab_normal(uint slab) {
    float u = (float(slab >> 16 & 127u) - 64.0) * olbvh_two_to(-6), v = (float(slab >> 23 & 127u) - 64.0) * olbvh_two_to(-6);
    uint axis = slab >> 30;
    return axis == 0u ? vec3(1.0, u, v) : axis == 1u ? vec3(v, 1.0, u) : vec3(u, v, 1.0);
}

// On which side of a slab a point is: -1 below, 1 above, 0 within.
int olbvh_side_of(uint slab, olbvh_SlabCell cell, vec3 x) {
    uint at = olbvh_slab_place(olbvh_dot_product(olbvh_slab_normal(slab), olbvh_in_cell(cell, x)));
    return at < (slab & 255u) ? -1 : at > (slab >> 8 & 255u) ? 1 : 0;
}

// The slab of a leaf, if there are slabs.
uint olbvh_leaf_slab(olbvh_Grid g, uint leaf) { return olbvh_po.at[g.slabs + (leaf - g.first_leaf)]; }

// On which side of its leaf's slab x is, in a cell of the finest grid that lies in this leaf. If it is not 0, no
// tetrahedron owns x (for tolerances below 2^-12). `scale` is slab_scale(g).
int olbvh_side_of_slab(olbvh_Grid g, vec3 scale, uint leaf, uvec3 finest, vec3 x) {
    return g.slabs == 0u ? 0 : olbvh_side_of(olbvh_leaf_slab(g, leaf), olbvh_slab_cell(g, scale, finest >> (olbvh_MAX_LEVEL - g.level)), x);
}

// Of up to 32 entries from `begin` on and before `end`, those that are near the point's quarters of the leaf's cell,
// one bit each. Most entries fail this test, and most of the others fail that of `near_of`. Each test is done for all
// entries before the next test, so that invocations wait less for each other.
uint olbvh_in_quarters(uint begin, uint end, olbvh_Sought s) {
    uint count = min(32u, end - begin), left = 0u;
    for (uint k = 0u; k < count; ++k) left |= uint((olbvh_p.at[begin + k] & s.quarters) == s.quarters) << k;
    return left;
}

// Of the entries in `left`, those whose quantized box is near the point.
uint olbvh_near_of(uint begin, uint left, olbvh_Sought s) {
    uint ids = olbvh_grid.at[0].ids, olbvh_near = 0u;
    for (; left != 0u; left &= left - 1u) {
        if (olbvh_is_near(olbvh_words(olbvh_cells.at[olbvh_p.at[begin + findLSB(left)] & ids]), s)) olbvh_near |= left & -left;
    }
    return olbvh_near;
}

uint olbvh_near_among(uint begin, uint end, olbvh_Sought s) { return olbvh_near_of(begin, olbvh_in_quarters(begin, end, s), s); }

// Considers the entries [begin, end) in order, up to the first that contains the point.
void olbvh_search(inout olbvh_Best best, uint begin, uint end, olbvh_Sought s) {
    for (; begin < end && !best.inside; begin += 32u) {
        for (uint olbvh_near = olbvh_near_among(begin, end, s); olbvh_near != 0u && !best.inside; olbvh_near &= olbvh_near - 1u) {
            uint t = olbvh_listed_tet(begin + findLSB(olbvh_near));
            olbvh_Tet tet = olbvh_load_tet(olbvh_words(olbvh_cells.at[t]));
            olbvh_consider(best, t, tet, olbvh_weights(tet, s.x));
        }
    }
}

// Whether a point, x in normalised coordinates, is no farther outside of the bounds than it can be from its owner: by 3 t
// times their size, and what rounding adds. Farther away, the weights of a small tetrahedron are nothing but rounding.
bool olbvh_in_reach(olbvh_Grid g, vec3 at, vec3 x, float tolerance) {
    precise float grow = min(tolerance, 1e10) * 3.0 + olbvh_two_to(-16);
    precise vec3 beyond = g.extent.xyz * grow, most = g.extent.xyz + beyond;
    return olbvh_near_bounds(g, at) && all(greaterThanEqual(x, -beyond)) && all(lessThanEqual(x, most));
}

// The leaf whose tetrahedra may own the point `at`, x in normalised coordinates; NONE if none can.
uint olbvh_leaf_to_search(olbvh_Grid g, vec3 at, vec3 x, float tolerance) {
    if (!olbvh_in_reach(g, at, x, tolerance)) return olbvh_NONE;
    uvec3 finest = olbvh_quantize(g, at);
    uint leaf = olbvh_find_leaf(g.level, finest);
    return leaf == olbvh_NONE || (olbvh_leaves_room(g, tolerance) && olbvh_side_of_slab(g, olbvh_slab_scale(g), leaf, finest, x) != 0) ? olbvh_NONE : leaf;
}

// The owner, once the whole list has been searched; NONE if there is none.
uint olbvh_decide(olbvh_Best best, uint leaf, float tolerance) {
    if (best.owner == olbvh_NONE || best.inside) return best.owner;
    return !olbvh_is_boundary_node(leaf) || best.smallest >= -tolerance ? best.owner : olbvh_NONE;
}
// Point location by walking (SPEC 2.6). Twin of `walked` in src/reference/locate.rs. Needs owner_list.glsl, LISTS and
// neighbours.

// Walking to a point across shared faces (SPEC 2.6). Twin of src/reference/walk.rs, which explains it; the operations
// and their order are the same. Needs best_owner.glsl, cells and neighbours.
const uint olbvh_STAR = 128u;   // Most tetrahedra of a star. A vertex of more is crowded, and never walked to; see corners.glsl.
const uint olbvh_STEPS = 512u;  // Most steps of part 1.
const uint olbvh_HINTED = 16u;  // Most steps of a stride from a hint.
const uint olbvh_STRIDE = 64u;  // Most steps of a stride through a leaf.
const uint olbvh_LEG = 1024u;   // Most steps along one segment.
const uint olbvh_DETOURS = 8u;  // Points of the cell to go by in parts 2 and 3; the first one is the centre.
const uint olbvh_ARRIVALS = 2u; // Stars that part 1 searches.
// Most steps of part 1 after a star without an owner. Some tetrahedra round an edge may be too far from x to belong to
// its star, which then falls into parts; so the walk goes on until it comes to the tetrahedron that contains x, if there
// is one.
const uint olbvh_ROUND = olbvh_STAR;
// -2^-17. With a smallest barycentric coordinate of at least this, x lies in a gap between tetrahedra that is due to
// rounding, and the nearest tetrahedron owns it.
const float olbvh_GAP = -7.62939453125e-6;

// Strides, the hot part of a walk (SPEC 2.6). Twin of `Stand` in src/reference/walk.rs. Needs best_owner.glsl, cells,
// vertices and neighbours.

// The tetrahedron that a stride has reached. Its corners are kept in ascending index, so that what is computed from
// them does not depend on the path.
struct olbvh_Stand {
    uint t;
    uvec4 cell; // vertices in the caller's order
    uvec4 ids;  // vertices in ascending order
    // Neighbours across the faces opposite to `cell`, loaded together with it so that their cache misses overlap.
    uvec4 beside;
    vec4 x, y, z;
};

// How a step changes what is kept per corner.
struct olbvh_Exchange {
    uint fresh;   // the vertex that enters
    bvec3 beyond; // whether the place of the corner that leaves is 0; at most 1; at most 2
    bvec3 before; // whether the fresh vertex comes before each of the corners kept
};

// Tetrahedra tested by strides and walks so far, and passes over stars as a part of such a test, which count towards a
// kernel's budget.
uint olbvh_walked_tets = 0u;

olbvh_Stand olbvh_stand_nowhere() { return olbvh_Stand(olbvh_NONE, uvec4(0u), uvec4(0u), uvec4(0u), vec4(0.0), vec4(0.0), vec4(0.0)); }

vec3 olbvh_corner_of(olbvh_Stand s, uint k) { return vec3(s.x[k], s.y[k], s.z[k]); }

vec3[4] olbvh_corners_of(olbvh_Stand s) { return vec3[4](olbvh_corner_of(s, 0u), olbvh_corner_of(s, 1u), olbvh_corner_of(s, 2u), olbvh_corner_of(s, 3u)); }

olbvh_Stand olbvh_stand_in(uint t) {
    olbvh_Stand s;
    s.t = t;
    s.cell = olbvh_words(olbvh_cells.at[t]);
    s.beside = olbvh_words(olbvh_neighbours.at[t]);
    uvec4 rank = olbvh_ranks(s.cell);
    for (uint r = 0u; r < 4u; ++r) s.ids[r] = rank.x == r ? s.cell.x : rank.y == r ? s.cell.y : rank.z == r ? s.cell.z : s.cell.w;
    vec3 a = olbvh_vertex(s.ids.x), b = olbvh_vertex(s.ids.y), c = olbvh_vertex(s.ids.z), d = olbvh_vertex(s.ids.w);
    s.x = vec4(a.x, b.x, c.x, d.x);
    s.y = vec4(a.y, b.y, c.y, d.y);
    s.z = vec4(a.z, b.z, c.z, d.z);
    return s;
}

olbvh_Tet olbvh_tet_of(olbvh_Stand s) { return olbvh_Tet(olbvh_corners_of(s), olbvh_ranks(s.cell)); }

olbvh_Sides olbvh_sides_of(olbvh_Stand s, vec3 x) {
    vec3 v[4] = olbvh_corners_of(s);
    return olbvh_sides_of(v, olbvh_bounds_of(v), x); // kept bounds would save a few operations and take seven registers
}

float olbvh_of_vertex(olbvh_Stand s, vec4 ascending, uint id) {
    return s.ids.x == id ? ascending.x : s.ids.y == id ? ascending.y : s.ids.z == id ? ascending.z : ascending.w;
}

// Barycentric coordinates of the point that `at` was computed for, in the caller's order.
vec4 olbvh_barycentric(olbvh_Stand s, olbvh_Sides at) {
    vec4 b = olbvh_barycentric(at);
    return vec4(olbvh_of_vertex(s, b, s.cell.x), olbvh_of_vertex(s, b, s.cell.y), olbvh_of_vertex(s, b, s.cell.z), olbvh_of_vertex(s, b, s.cell.w));
}

uvec3 olbvh_kept(uvec4 held, bvec3 beyond) { return mix(held.xyz, held.yzw, beyond); }

// Data per corner after a step, with that of the fresh corner.
uvec4 olbvh_exchange(uvec4 held, olbvh_Exchange e, uint fresh) {
    uvec3 k = olbvh_kept(held, e.beyond);
    return uvec4(e.before.x ? fresh : k.x, e.before.x ? k.x : e.before.y ? fresh : k.y, e.before.y ? k.y : e.before.z ? fresh : k.z,
                 e.before.z ? k.z : fresh);
}

vec4 olbvh_exchange(vec4 held, olbvh_Exchange e, float fresh) {
    return uintBitsToFloat(olbvh_exchange(floatBitsToUint(held), e, floatBitsToUint(fresh)));
}

uint olbvh_xor_of(uvec4 ids) { return ids.x ^ ids.y ^ ids.z ^ ids.w; }

// Steps through the face with the most negative weight. Returns false if no weight is negative or nothing lies beyond
// that face; the stand must then not be used.
bool olbvh_step_on(inout olbvh_Stand s, olbvh_Sides at, out olbvh_Exchange e) {
    float least = min(min(at.w.x, at.w.y), min(at.w.z, at.w.w));
    e.beyond.x = at.w.x == least;
    e.beyond.y = e.beyond.x || at.w.y == least;
    e.beyond.z = e.beyond.y || at.w.z == least;
    e.before = bvec3(false);
    e.fresh = 0u;
    if (least >= 0.0) return false;
    uint left = e.beyond.x ? s.ids.x : e.beyond.y ? s.ids.y : e.beyond.z ? s.ids.z : s.ids.w;
    s.t = s.cell.x == left ? s.beside.x : s.cell.y == left ? s.beside.y : s.cell.z == left ? s.beside.z : s.beside.w;
    if (s.t == olbvh_NONE) return false;
    // Three corners are shared; the fresh one replaces the fourth.
    s.cell = olbvh_words(olbvh_cells.at[s.t]);
    s.beside = olbvh_words(olbvh_neighbours.at[s.t]);
    e.fresh = olbvh_xor_of(s.cell) ^ olbvh_xor_of(s.ids) ^ left;
    vec3 v = olbvh_vertex(e.fresh);
    e.before = lessThan(uvec3(e.fresh), olbvh_kept(s.ids, e.beyond));
    s.ids = olbvh_exchange(s.ids, e, e.fresh);
    s.x = olbvh_exchange(s.x, e, v.x);
    s.y = olbvh_exchange(s.y, e, v.y);
    s.z = olbvh_exchange(s.z, e, v.z);
    return true;
}

bool olbvh_step_on(inout olbvh_Stand s, olbvh_Sides at) {
    olbvh_Exchange e;
    return olbvh_step_on(s, at, e);
}

// The part of a straight way that lies before a face, whose weight is `here` at the start and `there`, below 0, at the
// end.
float olbvh_way_before(float here, float there) {
    float from = max(here, 0.0);
    precise float length = from - there;
    precise float part = from * olbvh_reciprocal(length);
    return part;
}

// The owner of x, where x is near one face of the stand and far from all other faces of the two tetrahedra that share
// it; else NONE.
uint olbvh_owner_at_face(olbvh_Stand s, vec3 x) {
    olbvh_Tet tet = olbvh_tet_of(s);
    olbvh_Weights here = olbvh_weights(tet, x);
    uint u = olbvh_near_one_face(here) ? s.beside[olbvh_outermost(olbvh_own_weights(here, tet))] : olbvh_NONE;
    if (u == olbvh_NONE) return olbvh_NONE;
    olbvh_Weights there = olbvh_weights(olbvh_load_tet(olbvh_words(olbvh_cells.at[u])), x);
    // Both sides compute the same magnitude of the weight at their shared face.
    if (!olbvh_near_one_face(there) || olbvh_least_of(there.w) != -olbvh_least_of(here.w)) return olbvh_NONE;
    return here.inside && (!there.inside || s.t < u) ? s.t : there.inside ? u : olbvh_NONE;
}

// The owner of x where a stride ends: the stand if it clearly contains x, or the owner at its face; else NONE.
uint olbvh_owner_of(olbvh_Stand s, olbvh_Sides at, vec3 x) { return at.clear ? s.t : at.near ? olbvh_owner_at_face(s, x) : olbvh_NONE; }

// Moves `t` towards x, to its owner if at most `most` steps lead there and x is not near an edge. Otherwise returns
// false and sets `t` to NONE.
bool olbvh_stride_to(inout uint t, vec3 x, uint most) {
    if (t == olbvh_NONE) return false;
    olbvh_Stand s = olbvh_stand_in(t);
    uint owner = olbvh_NONE;
    for (uint k = 0u; k < most; ++k) {
        ++olbvh_walked_tets;
        olbvh_Sides at = olbvh_sides_of(s, x);
        owner = olbvh_owner_of(s, at, x);
        if (owner != olbvh_NONE || at.near || !olbvh_step_on(s, at)) break;
    }
    t = owner;
    return owner != olbvh_NONE;
}

uint olbvh_star[olbvh_STAR];
uint olbvh_star_size;

// Looks at four at a time: some drivers end the loops of an invocation after 65,535 passes in all.
bool olbvh_in_star(uint t) {
    for (uint i = 0u; i < olbvh_star_size; i += 4u) {
        uint left = olbvh_star_size - i;
        if (olbvh_star[i] == t || (left > 1u && olbvh_star[i + 1u] == t) || (left > 2u && olbvh_star[i + 2u] == t) || (left > 3u && olbvh_star[i + 3u] == t)) return true;
    }
    return false;
}

// Adds to the star of x the neighbours of its member `t` that x is near, across faces that x is near. Others must not take
// a place: there are as many as corners.glsl counts on.
void olbvh_grow_star(uint t, olbvh_Tet tet, olbvh_Weights w, vec3 x) {
    vec4 own = olbvh_own_weights(w, tet);
    uvec4 beside = olbvh_words(olbvh_neighbours.at[t]);
    [[dont_unroll]] for (uint f = 0u; f < 4u; ++f) { // every iteration contains a whole containment test
        uint u = beside[f];
        if (own[f] > w.margin || u == olbvh_NONE || olbvh_star_size == olbvh_STAR || olbvh_in_star(u)) continue;
        ++olbvh_walked_tets;
        if (olbvh_near(olbvh_weights(olbvh_load_tet(olbvh_words(olbvh_cells.at[u])), x))) olbvh_star[olbvh_star_size++] = u;
    }
}

// Considers all tetrahedra of the star of x as its owner, starting with `first`.
void olbvh_arrive(uint first, vec3 x, inout olbvh_Best best) {
    olbvh_star[0] = first;
    olbvh_star_size = 1u;
    for (uint i = 0u; i < olbvh_star_size; ++i) {
        uint t = olbvh_star[i];
        ++olbvh_walked_tets;
        olbvh_Tet tet = olbvh_load_tet(olbvh_words(olbvh_cells.at[t]));
        olbvh_Weights w = olbvh_weights(tet, x);
        olbvh_consider(best, t, tet, w);
        olbvh_grow_star(t, tet, w, x);
    }
    olbvh_walked_tets += olbvh_star_size * olbvh_star_size / 16u; // the passes of `in_star` are work as well
}

bool olbvh_settled(olbvh_Best best) { return best.inside || (best.in_box && best.smallest >= olbvh_GAP); }

// Part 1, from `t`, which step number `s` has reached. Returns whether `t` is now near x or, if one star has been
// searched without an owner, contains it. A tetrahedron that clearly contains x becomes the best one, and ends the
// walk.
bool olbvh_walk_towards(inout uint t, inout uint s, bool arrived, vec3 x, inout olbvh_Best best) {
    if (arrived) s = max(s, olbvh_STEPS - olbvh_ROUND);
    for (; s < olbvh_STEPS; ++s) {
        ++olbvh_walked_tets;
        olbvh_Tet tet = olbvh_load_tet(olbvh_words(olbvh_cells.at[t]));
        olbvh_Weights w = olbvh_weights(tet, x);
        if (w.clear) best = olbvh_Best(t, true, true, 0.0);
        if (w.clear || (arrived ? w.inside : olbvh_near(w))) return !w.clear;
        vec4 own = olbvh_own_weights(w, tet);
        uint face = olbvh_outermost(own), next = own[face] < 0.0 ? olbvh_words(olbvh_neighbours.at[t])[face] : olbvh_NONE;
        if (next == olbvh_NONE) return false;
        t = next;
    }
    return false;
}

// Walks straight from `a`, which lies in `t`, to `b`. Returns the tetrahedron where the segment ends, or the last one
// before it leaves the mesh, through the face opposite to vertex number `left`; else `left` is NONE.
uint olbvh_walk_leg(uint t, vec3 a, vec3 b, out uint left) {
    uint from = t;
    left = olbvh_NONE;
    for (uint s = 0u; s < olbvh_LEG; ++s) {
        ++olbvh_walked_tets;
        olbvh_Tet tet = olbvh_load_tet(olbvh_words(olbvh_cells.at[t]));
        vec4 before = olbvh_own_weights(olbvh_weights(tet, a), tet), behind = olbvh_own_weights(olbvh_weights(tet, b), tet);
        uvec4 beside = olbvh_words(olbvh_neighbours.at[t]);
        float first = 3.40282347e38;
        uint face = olbvh_NONE;
        for (uint f = 0u; f < 4u; ++f) {
            if (behind[f] >= 0.0 || beside[f] == from) continue;
            float at = olbvh_way_before(before[f], behind[f]);
            if (at < first) {
                first = at;
                face = f;
            }
        }
        if (face == olbvh_NONE || beside[face] == olbvh_NONE) {
            left = face;
            break;
        }
        from = t;
        t = beside[face];
    }
    return t;
}

// Point number k of the cell; the first is its centre.
vec3 olbvh_cell_point(olbvh_CellShape cell, uint k) {
    vec3 olbvh_p;
    for (uint c = 0u; c < 3u; ++c) {
        precise float part = float((3u * k + c) * 0x9e3779b9u >> 8) * olbvh_two_to(-23) - 1.0;
        float away = k == 0u ? 0.0 : part;
        precise float at = cell.centre[c] + cell.half_size[c] * away;
        precise float whole = floor(at * olbvh_two_to(42)) * olbvh_two_to(-42);
        olbvh_p[c] = whole;
    }
    return olbvh_p;
}

// Walks to a point x of a cell that is full of mesh, from its seed: directly, through up to ARRIVALS stars, then by
// DETOURS points. The owner may be in another part of the first star, so x counts as in a gap only after the second.
// All of it is one loop, so that a kernel contains each part only once.
olbvh_Best olbvh_walk_from_seed(uint seed, olbvh_CellShape cell, vec3 x) {
    olbvh_Best best = olbvh_no_best();
    uint t = seed, s = 0u;
    [[dont_unroll]] for (uint way = 0u; way < olbvh_ARRIVALS + olbvh_DETOURS && !(way < olbvh_ARRIVALS ? best.inside : olbvh_settled(best)); ++way) {
        if (way < olbvh_ARRIVALS) {
            if (!olbvh_walk_towards(t, s, way > 0u, x, best)) {
                way = olbvh_ARRIVALS - 1u;
                continue;
            }
        } else {
            uint k = way - olbvh_ARRIVALS;
            vec3 by = olbvh_cell_point(cell, k);
            uint left; // the cell is full of mesh: nothing leads out of it
            t = seed;
            // The first point is the centre, where the walk starts.
            [[dont_unroll]] for (uint leg = k == 0u ? 1u : 0u; leg < 2u; ++leg) t = olbvh_walk_leg(t, leg == 0u ? cell.centre : by, leg == 0u ? by : x, left);
        }
        olbvh_arrive(t, x, best);
    }
    return best;
}

// Whether a leaf is searched by walking: it is full of mesh and has a seed instead of a list.
bool olbvh_walks_in(uint leaf, uvec2 range) { return olbvh_LISTS != 0u && range.x < range.y && !olbvh_is_boundary_node(leaf); }

// The tetrahedron where a stride through a leaf with these entries starts.
uint olbvh_middle_of(uvec2 range) { return olbvh_listed_tet(range.x + (range.y - range.x) / 2u); }

// The owner of the point `at`, x in normalised coordinates, in a leaf that is full of mesh, found by a whole walk.
olbvh_Best olbvh_walked_through(olbvh_Grid g, uvec2 range, vec3 at, vec3 x) {
    uvec3 cell = olbvh_quantize(g, at) >> (olbvh_MAX_LEVEL - g.level);
    return olbvh_walk_from_seed(olbvh_listed_tet(range.x), olbvh_cell_shape(g, g.level, cell), x);
}

// The owner of x in a leaf with these entries, found by a stride from the middle of the list or, if that fails and the
// leaf is full of mesh, by a whole walk. Without an owner, the list must be searched.
olbvh_Best olbvh_walked(olbvh_Grid g, uint leaf, uvec2 range, vec3 at, vec3 x) {
    if (olbvh_LISTS == 0u || range.x >= range.y) return olbvh_no_best();
    uint t = olbvh_middle_of(range);
    if (olbvh_stride_to(t, x, olbvh_STRIDE)) return olbvh_Best(t, true, true, 0.0);
    return olbvh_is_boundary_node(leaf) ? olbvh_no_best() : olbvh_walked_through(g, range, at, x);
}

// Selects the tree that the functions below use.
void olbvh_open(uvec2 tree) {
#ifndef OLBVH_DESCRIPTORS
    olbvh_scene = olbvh_sceneBlock(tree);
    olbvh_SceneAddresses a = olbvh_scene.at[0];
    olbvh_grid = olbvh_gridBlock(a.grid);
    olbvh_masks = olbvh_masksBlock(a.masks);
    olbvh_co = olbvh_coBlock(a.co);
    olbvh_po = olbvh_poBlock(a.po);
    olbvh_p = olbvh_pBlock(a.p);
    olbvh_flags = olbvh_flagsBlock(a.flags);
    olbvh_cells = olbvh_cellsBlock(a.cells);
    olbvh_vertices = olbvh_verticesBlock(a.vertices);
    olbvh_neighbours = olbvh_neighboursBlock(a.neighbours);
    olbvh_field = olbvh_fieldBlock(a.field);
#endif
    olbvh_LISTS = olbvh_scene.at[0].lists;
}

// The tetrahedron that owns a point (in the units of the mesh), or OLBVH_NONE, and the point's barycentric coordinates
// in the order of the tetrahedron's vertices. A point outside of the mesh is found if its smallest coordinate in the
// nearest tetrahedron is at least -tolerance.
uint olbvh_locate(vec3 place, float tolerance, out vec4 weights_of_owner) {
    weights_of_owner = vec4(0.0);
    olbvh_Grid g = olbvh_grid.at[0];
    vec3 x = olbvh_normalise(g, place);
    uint leaf = olbvh_leaf_to_search(g, place, x, tolerance);
    if (leaf == olbvh_NONE) return olbvh_NONE;
    uvec2 range = olbvh_entry_range(leaf);
    olbvh_Best best = olbvh_walked(g, leaf, range, place, x);
    if (!best.inside && !olbvh_walks_in(leaf, range)) olbvh_search(best, range.x, range.y, olbvh_sought_at(g, place, x, tolerance));
    uint owner = olbvh_decide(best, leaf, tolerance);
    if (owner == olbvh_NONE) return olbvh_NONE;
    weights_of_owner = olbvh_barycentric(olbvh_load_tet(olbvh_words(olbvh_cells.at[owner])), x);
    return owner;
}

// Walks straight from a point `start` in the tetrahedron `from` to the point `end`, as a particle moves. Returns the
// owner of the end, and its barycentric coordinates. If the way leads out of the mesh, it returns OLBVH_NONE, and `left`
// is the last tetrahedron and the number of the vertex opposite to the face through which it leaves; otherwise `left` is
// OLBVH_NONE twice. So are both for points farther outside the bounds of the mesh than half their largest extent, and
// where `from` is OLBVH_NONE.
uint olbvh_walk(uint from, vec3 start, vec3 end, out vec4 weights_of_owner, out uvec2 left) {
    weights_of_owner = vec4(0.0);
    left = uvec2(olbvh_NONE);
    olbvh_Grid g = olbvh_grid.at[0];
    if (from == olbvh_NONE || !olbvh_near_bounds(g, start) || !olbvh_near_bounds(g, end)) return olbvh_NONE;
    vec3 x = olbvh_normalise(g, end);
    uint face;
    uint t = olbvh_walk_leg(from, olbvh_normalise(g, start), x, face);
    if (face != olbvh_NONE) {
        left = uvec2(t, face);
        return olbvh_NONE;
    }
    olbvh_Best best = olbvh_no_best();
    olbvh_arrive(t, x, best);
    // Rounding may lead a walk astray round an edge, and a walk of many steps ends early.
    if (!best.inside) return olbvh_locate(end, 0.0, weights_of_owner);
    weights_of_owner = olbvh_barycentric(olbvh_load_tet(olbvh_words(olbvh_cells.at[best.owner])), x);
    return best.owner;
}

// The number of tetrahedra that contain a point; `owners` receives the first OLBVH_OWNERS of them, in no particular
// order.
#ifndef OLBVH_OWNERS
#define OLBVH_OWNERS 32
#endif
uint olbvh_owners(vec3 place, out uint owners[OLBVH_OWNERS]) {
    olbvh_Grid g = olbvh_grid.at[0];
    vec3 x = olbvh_normalise(g, place);
    uint leaf = olbvh_leaf_to_search(g, place, x, 0.0);
    if (leaf == olbvh_NONE) return 0u;
    uvec2 range = olbvh_entry_range(leaf);
    bool by_walk = olbvh_walks_in(leaf, range);
    if (by_walk) {
        olbvh_Best first = olbvh_walked(g, leaf, range, place, x), unused = olbvh_no_best();
        if (first.owner == olbvh_NONE) return 0u;
        olbvh_arrive(first.owner, x, unused);
        range = uvec2(0u, olbvh_star_size);
    }
    olbvh_Sought sought = olbvh_sought_at(g, place, x, 0.0);
    uint n = 0u;
    for (uint begin = range.x; begin < range.y; begin += 32u) {
        uint count = min(32u, range.y - begin);
        for (uint olbvh_near = by_walk ? olbvh_NONE >> (32u - count) : olbvh_near_among(begin, range.y, sought); olbvh_near != 0u; olbvh_near &= olbvh_near - 1u) {
            uint i = begin + findLSB(olbvh_near), t = by_walk ? olbvh_star[i] : olbvh_listed_tet(i);
            if (!olbvh_weights(olbvh_load_tet(olbvh_words(olbvh_cells.at[t])), x).inside) continue;
            if (n < OLBVH_OWNERS) owners[n] = t;
            ++n;
        }
    }
    return n;
}

float olbvh_no_value() { return uintBitsToFloat(0x7fc00000u); } // NaN

// The value of the field, which has one value per point of the mesh, in a tetrahedron; NaN without a field.
float olbvh_value(uint owner, vec4 weights_of_owner) {
    if (olbvh_scene.at[0].has_field == 0u) return olbvh_no_value();
    uvec4 v = olbvh_words(olbvh_cells.at[owner]);
    return olbvh_weighed(weights_of_owner, vec4(olbvh_field.at[v.x], olbvh_field.at[v.y], olbvh_field.at[v.z], olbvh_field.at[v.w]));
}

// The numbers of a tetrahedron's vertices, for fields in buffers of the host, of any number of components:
// olbvh_weighed(weights, values at these vertices) is what olbvh_value computes.
uvec4 olbvh_corners(uint owner) { return olbvh_words(olbvh_cells.at[owner]); }

// The gradient of the field in a tetrahedron, per unit of length of the mesh; 0 in a flat one, NaN without a field.
vec3 olbvh_gradient(uint owner) {
    if (olbvh_scene.at[0].has_field == 0u) return vec3(olbvh_no_value());
    uvec4 v = olbvh_words(olbvh_cells.at[owner]);
    vec3 a = olbvh_vertex(v.x), e1 = olbvh_vertex(v.y) - a, e2 = olbvh_vertex(v.z) - a, e3 = olbvh_vertex(v.w) - a;
    // Normalised coordinates lie in [0, 2^41).
    const float UNIT = 1.0 / 1099511627776.0;
    e1 *= UNIT;
    e2 *= UNIT;
    e3 *= UNIT;
    float six_volumes = dot(e1, cross(e2, e3)), f = olbvh_field.at[v.x];
    if (six_volumes == 0.0) return vec3(0.0);
    vec3 sum = (olbvh_field.at[v.y] - f) * cross(e2, e3) + (olbvh_field.at[v.z] - f) * cross(e3, e1) + (olbvh_field.at[v.w] - f) * cross(e1, e2);
    return sum / six_volumes * olbvh_grid.at[0].scale;
}

// Traversal with the host's predicates: define OLBVH_TRAVERSE before the inclusion, and after it
//     bool olbvh_visit_node(olbvh_Node node);  descend? Also asked for leaves; may become stricter during a traversal
//     bool olbvh_visit_leaf(olbvh_Node node);  called for an accepted leaf; returns true to end the traversal
// olbvh_node_box gives the box of a node, olbvh_entries the entries [x, y) of a leaf, and olbvh_primitive(i) the
// tetrahedron of entry i.
#ifdef OLBVH_TRAVERSE
#ifndef OLBVH_STACK
#define OLBVH_STACK 8
#endif
const uint olbvh_STACK = OLBVH_STACK;
bool olbvh_visit_node(olbvh_Node node);
bool olbvh_visit_leaf(olbvh_Node node);
// Traversal with predicates, using a short stack and a bit trail (SPEC 3.2, the paper's Alg. 3). Twin of
// src/reference/traverse.rs, which explains the trail. Before including this file, a kernel declares what tree.glsl
// needs and defines
//     bool visit_node(Node node);  // F_N: descend? Also asked for leaves. It may become stricter during a traversal.
//     bool visit_leaf(Node node);  // called for a leaf that F_N accepted; returns true to end the traversal
// and may define
//     ENTER_NODE(node, mask, first)  // done before F_N is asked about the children of the node; `first` is the first
//     KEEPS(node)                    // whether a node that F_N accepted earlier is still to be visited
//     FLIP                           // the children of a node are visited in the order of their digits XOR this
// STACK is the number of nodes on the short stack. Any size, from 0 on, gives the same leaves; a small one asks F_N more
// often.
#ifndef olbvh_ENTER_NODE
#define olbvh_ENTER_NODE(node, mask, first)
#endif
#ifndef olbvh_KEEPS
#define olbvh_KEEPS(node) true
#endif
#ifndef olbvh_FLIP
#define olbvh_FLIP 0u
#endif
const uint olbvh_MAX_VISITS = 24000u; // loop limit; a traversal that reaches it returns false

// True if the traversal ended by itself, false at the loop limit.
bool olbvh_traverse(uint level) {
    olbvh_Node node = olbvh_Node(0u, 0u, 0u);
    if (!olbvh_visit_node(node)) return true;
    if (level == 0u) {
        olbvh_visit_leaf(node);
        return true;
    }
    olbvh_Node stack[olbvh_STACK + uint(olbvh_STACK == 0u)]; // no array is empty
    uint top = 0u, held = 0u; // ring buffer: if it is full, the oldest node is dropped
    uint trail = 0u, resume = 0u;
    for (uint visits = 0u; visits < olbvh_MAX_VISITS; ++visits) {
        bool leaves = node.level + 1u == level;
        uint mask = olbvh_child_mask(node.index), first = olbvh_co.at[node.index] + 1u;
        uint accepted = 0u; // one bit per child, in the order of visits
        olbvh_ENTER_NODE(node, mask, first);
        for (uint k = 0u; k < 8u; ++k) {
            uint digit = k ^ olbvh_FLIP;
            if ((mask >> digit & 1u) == 0u) continue;
            olbvh_Node child = olbvh_Node(first + bitCount(mask & ((1u << digit) - 1u)), node.level + 1u, node.code << 3 | digit);
            if (!olbvh_visit_node(child)) continue;
            if (!leaves) accepted |= 1u << k;
            else if (olbvh_visit_leaf(child)) return true;
        }
        uint n = bitCount(accepted);
        if (n > 0u) {
            uint shift = 3u * node.level;
            if (node.level >= resume) trail |= (n - 1u) << shift;
            uint recorded = trail >> shift & 7u, left = min(recorded, n - 1u);
            if (left < recorded) {
                // F_N has become stricter, so the path may lead elsewhere, and the trail below it is another node's.
                trail = (trail & ((1u << shift) - 1u)) | left << shift;
                resume = node.level;
            }
            // Pushes the siblings after the next node, the last first; then takes the next node itself.
            olbvh_Node parent = node;
            for (uint k = 0u; k <= left; ++k) {
                uint highest = uint(findMSB(accepted)), digit = highest ^ olbvh_FLIP;
                accepted ^= 1u << highest;
                node = olbvh_Node(first + bitCount(mask & ((1u << digit) - 1u)), parent.level + 1u, parent.code << 3 | digit);
                if (olbvh_STACK > 0u && k < left) {
                    stack[top] = node;
                    top = top + 1u == olbvh_STACK ? 0u : top + 1u;
                    held = min(held + 1u, olbvh_STACK);
                }
            }
            continue;
        }
        do {
            if (trail == 0u) return true;
            uint at = uint(findMSB(trail)) / 3u;
            trail -= 1u << (3u * at);
            if (held > 0u) {
                top = top == 0u ? olbvh_STACK - 1u : top - 1u;
                --held;
                node = stack[top];
                resume = 0u;
            } else {
                node = olbvh_Node(0u, 0u, 0u);
                resume = at + 1u;
            }
        } while (resume == 0u && !olbvh_KEEPS(node));
    }
    return false;
}
// Box of a cell in the units of the mesh (SPEC 2.1). Twin of `cell_box` in src/reference/leaves.rs.

// The lower sides of cell k of a level; k may be one beyond the last cell.
vec3 olbvh_cell_sides(olbvh_Grid g, uint level, uvec3 k) {
    precise vec3 extent = g.hi.xyz - g.lo.xyz;
    precise vec3 along = vec3(k) * olbvh_two_to(-int(level));
    precise vec3 offset = vec3(olbvh_canonical(extent.x), olbvh_canonical(extent.y), olbvh_canonical(extent.z)) * along;
    if (g.graded != 0u) offset = olbvh_graded_sides(k << (olbvh_MAX_LEVEL - level));
    precise vec3 x = g.lo.xyz + offset;
    x = vec3(olbvh_canonical(x.x), olbvh_canonical(x.y), olbvh_canonical(x.z));
    x = mix(x, g.hi.xyz, equal(k, uvec3(1u << level)));
    x = mix(x, g.hi.xyz, equal(g.inv.xyz, vec3(0.0)));
    return mix(x, g.lo.xyz, equal(k, uvec3(0u)));
}

// Lower and upper corner of the cell with this Morton code.
void olbvh_cell_box(olbvh_Grid g, uint level, uint code, out vec3 lo, out vec3 hi) {
    uvec3 k = olbvh_unmorton(code);
    lo = olbvh_cell_sides(g, level, k);
    hi = olbvh_cell_sides(g, level, k + 1u);
}

// Traverses the tree. Returns false if it has too many nodes to visit in one call (24,000 internal nodes).
bool olbvh_traverse() { return olbvh_traverse(olbvh_grid.at[0].level); }

void olbvh_node_box(olbvh_Node node, out vec3 lo, out vec3 hi) { olbvh_cell_box(olbvh_grid.at[0], node.level, node.code, lo, hi); }

bool olbvh_is_boundary(olbvh_Node node) { return olbvh_is_boundary_node(node.index); }

uvec2 olbvh_entries(olbvh_Node node) { return olbvh_entry_range(node.index); }

uint olbvh_primitive(uint entry) { return olbvh_listed_tet(entry); }
#endif
#endif
