// Orientation, containment and barycentric coordinates in normalised coordinates (SPEC 2.1, 3.1). Twin of
// src/reference/tet.rs; the operations and their order are the same.

// The vertices of the face opposite to each vertex.
const uvec3 FACES[4] = uvec3[4](uvec3(1, 2, 3), uvec3(0, 2, 3), uvec3(0, 1, 3), uvec3(0, 1, 2));
// Edges, and the two vertices that are not on them.
const uvec4 EDGES[6] =
    uvec4[6](uvec4(0, 1, 2, 3), uvec4(0, 2, 1, 3), uvec4(0, 3, 1, 2), uvec4(1, 2, 0, 3), uvec4(1, 3, 0, 2), uvec4(2, 3, 0, 1));

vec3 cross_product(vec3 a, vec3 b) {
    precise vec3 r = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
    return r;
}

// What the products in `cross_product` amount to: a bound for its error.
vec3 sum_of_products(vec3 a, vec3 b) {
    a = abs(a);
    b = abs(b);
    precise vec3 r = vec3(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x);
    return r;
}

float dot_product(vec3 a, vec3 b) {
    precise float r = (a.x * b.x + a.y * b.y) + a.z * b.z;
    return r;
}

// Six times the signed volume of (a, b, c, p). It is computed relative to p, so that it is exactly 0 where p is one of
// the others.
float orient(vec3 a, vec3 b, vec3 c, vec3 p) {
    precise vec3 pa = a - p, pb = b - p, pc = c - p;
    return -dot_product(cross_product(pa, pb), pc);
}

// A tetrahedron with its vertices in ascending global index.
struct Tet {
    vec3 v[4];
    uvec4 rank; // place in v of each vertex in the caller's order
};

// A point relative to a tetrahedron.
struct Weights {
    vec4 w;      // signed volumes opposite to the vertices in ascending index, positive inside
    float sum;
    bool in_box; // inside the closed box of the vertices
    bool inside; // the closed tetrahedron contains the point, and is not flat
    bool clear;  // inside by more than the margin, so that rounding cannot put the point into a neighbour as well
    float margin; // of the tetrahedron, see Bounds
};

// The place of each of four different vertex indices in ascending order.
uvec4 ranks(uvec4 ids) {
    uint yx = uint(ids.y < ids.x), zx = uint(ids.z < ids.x), wx = uint(ids.w < ids.x);
    uint zy = uint(ids.z < ids.y), wy = uint(ids.w < ids.y), wz = uint(ids.w < ids.z);
    return uvec4(yx + zx + wx, (1u - yx) + zy + wy, (1u - zx) + (1u - zy) + wz, (1u - wx) + (1u - wy) + (1u - wz));
}

vec3 select_rank(uvec4 rank, uint r, vec3 a, vec3 b, vec3 c, vec3 d) {
    return rank.x == r ? a : rank.y == r ? b : rank.z == r ? c : d;
}

// A Tet from corners in the caller's order.
Tet make_tet(uvec4 ids, vec3 a, vec3 b, vec3 c, vec3 d) {
    Tet t;
    t.rank = ranks(ids);
    for (uint r = 0u; r < 4u; ++r) t.v[r] = select_rank(t.rank, r, a, b, c, d);
    return t;
}

float volume(Tet t) { return orient(t.v[0], t.v[1], t.v[2], t.v[3]); }

// The box of a tetrahedron, and its margin: if a weight is this close to 0, rounding may have put the point on either
// side of the face.
struct Bounds {
    vec3 lo;
    vec3 hi;
    float margin;
};

// Minimum and maximum of coordinates. These are not negative, so their order is that of their bits, and integer
// operations need no care for NaN.
vec3 smaller(vec3 a, vec3 b) { return uintBitsToFloat(min(floatBitsToUint(a), floatBitsToUint(b))); }
vec3 larger(vec3 a, vec3 b) { return uintBitsToFloat(max(floatBitsToUint(a), floatBitsToUint(b))); }

Bounds bounds_of(vec3 v[4]) {
    Bounds r;
    r.lo = smaller(smaller(v[0], v[1]), smaller(v[2], v[3]));
    r.hi = larger(larger(v[0], v[1]), larger(v[2], v[3]));
    precise vec3 size = r.hi - r.lo;
    precise float margin = ((size.x * size.y) * size.z) * two_to(-16);
    r.margin = margin;
    return r;
}

bool holds(Bounds box, vec3 p) { return all(lessThanEqual(box.lo, p)) && all(lessThanEqual(p, box.hi)); }

Weights weights(Tet t, vec3 p) {
    float vol = volume(t);
    float s = vol < 0.0 ? -1.0 : 1.0;
    // `orient` of the four faces and p; its sign alternates with the opposite vertex.
    precise vec3 a = t.v[0] - p, b = t.v[1] - p, c = t.v[2] - p, d = t.v[3] - p;
    vec3 ab = cross_product(a, b);
    Weights r;
    r.w = vec4(s * dot_product(cross_product(b, c), d), -s * dot_product(cross_product(a, c), d), s * dot_product(ab, d), -s * dot_product(ab, c));
    precise float sum = (r.w.x + r.w.y) + (r.w.z + r.w.w);
    r.sum = sum;
    Bounds box = bounds_of(t.v);
    r.in_box = holds(box, p);
    r.inside = r.in_box && vol != 0.0 && all(greaterThanEqual(r.w, vec4(0.0)));
    r.clear = r.inside && all(greaterThan(r.w, vec4(box.margin)));
    r.margin = box.margin;
    return r;
}

float least_of(vec4 w) { return min(min(w.x, w.y), min(w.z, w.w)); }

// Whether the point lies outside of no face by more than the margin.
bool near(Weights r) { return least_of(r.w) >= -r.margin; }

// Whether the point is within the margin of one face, and inside of all others by more than the margin.
bool near_one_face(Weights r) {
    uvec4 close = uvec4(lessThanEqual(r.w, vec4(r.margin)));
    return near(r) && close.x + close.y + close.z + close.w == 1u;
}

// Weights in the caller's order of vertices, which is that of the faces.
vec4 own_weights(Weights w, Tet tet) { return vec4(w.w[tet.rank.x], w.w[tet.rank.y], w.w[tet.rank.z], w.w[tet.rank.w]); }

// The face with the smallest weight: the one that the point lies farthest outside of.
uint outermost(vec4 own) {
    uint face = 0u;
    for (uint f = 1u; f < 4u; ++f) face = own[f] < own[face] ? f : face;
    return face;
}

// What a step of a walk needs. It is cheaper than `weights`, but by rounding, two neighbours may disagree on which side
// of their shared face a point lies.
struct Sides {
    vec4 w;     // as in Weights, opposite to the vertices in the order given
    float sum;  // of the weights
    bool clear; // as in Weights
    bool near;  // outside of no face by more than the margin
};

Sides sides_of(vec3 v[4], Bounds box, vec3 p) {
    precise vec3 a = v[0] - p, b = v[1] - p, c = v[2] - p, d = v[3] - p;
    vec3 ab = cross_product(a, b), cd = cross_product(c, d);
    vec4 w = vec4(dot_product(cd, b), -dot_product(cd, a), dot_product(ab, d), -dot_product(ab, c));
    precise float sum = (w.x + w.y) + (w.z + w.w);
    Sides r;
    r.w = sum < 0.0 ? -w : w;
    r.sum = abs(sum);
    r.clear = holds(box, p) && all(greaterThan(r.w, vec4(box.margin)));
    r.near = all(greaterThanEqual(r.w, vec4(-box.margin)));
    return r;
}

// Barycentric coordinates in the order of the vertices.
vec4 barycentric(Sides r) {
    float k = r.sum <= 0.0 ? 0.0 : reciprocal(r.sum);
    precise vec4 b = r.w * k;
    return b;
}

// Barycentric coordinates of any point in the caller's order: those reported with an owner, however it was found. A zero
// has no sign, which Vulkan does not promise to keep.
vec4 barycentric(Tet t, vec3 p) {
    vec4 b = barycentric(sides_of(t.v, bounds_of(t.v), p));
    return vec4(canonical(b[t.rank.x]), canonical(b[t.rank.y]), canonical(b[t.rank.z]), canonical(b[t.rank.w]));
}

// The value at barycentric coordinates, interpolated from the values at the corners; exact where these are equal.
float weighed(vec4 b, vec4 at_corners) {
    precise vec3 beside = at_corners.xyz - at_corners.w;
    precise float r = ((b.x * beside.x + b.y * beside.y) + b.z * beside.z) + at_corners.w;
    return r;
}

const float SMALLEST_FLOAT = -3.40282347e38;

// Smallest barycentric coordinate; SMALLEST_FLOAT for a flat tetrahedron. It is 0 where rounding may have put the point
// outside: 2^-18 of the box is the most that it can change a weight by (at most 54 half units in the last place, of
// products of three sides of the box). In thin tetrahedra, this exceeds the usual tolerance.
float smallest(Weights r) {
    precise float rounding = r.margin * 0.25;
    if (r.in_box && least_of(r.w) >= -rounding) return 0.0;
    if (r.sum <= 0.0) return SMALLEST_FLOAT;
    precise float b = least_of(r.w) * reciprocal(r.sum);
    return b;
}

// Barycentric coordinates in the caller's order of vertices.
vec4 barycentric(Weights r, uvec4 rank) {
    float k = r.sum <= 0.0 ? 0.0 : reciprocal(r.sum);
    precise vec4 b = vec4(r.w[rank.x], r.w[rank.y], r.w[rank.z], r.w[rank.w]) * k;
    return b;
}
