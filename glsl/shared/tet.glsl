// Orientation, containment, barycentric coordinates in normalised coordinates (SPEC 2.1, 3.1). Twin of src/reference/tet.rs: the
// same operations in the same order.

vec3 cross_product(vec3 a, vec3 b) {
    precise vec3 r = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
    return r;
}

float dot_product(vec3 a, vec3 b) {
    precise float r = (a.x * b.x + a.y * b.y) + a.z * b.z;
    return r;
}

// Six times the signed volume of (a, b, c, p).
float orient(vec3 a, vec3 b, vec3 c, vec3 p) {
    precise vec3 ab = b - a;
    precise vec3 ac = c - a;
    precise vec3 ap = p - a;
    return dot_product(cross_product(ab, ac), ap);
}

// A tetrahedron with its vertices in ascending global index.
struct Tet {
    vec3 v[4];
    uvec4 rank; // place in v of each vertex as the caller numbered them
};

// A point relative to a tetrahedron.
struct Weights {
    vec4 w;      // signed volumes opposite to the vertices in ascending index, positive inside
    float sum;
    bool in_box; // inside the closed box of the vertices
    bool inside; // the closed, not flat cell holds the point
    bool clear;  // by more than the margin, so that rounding cannot put it into a neighbour as well
    float margin; // of the cell, see Bounds
};

// Ascending places of four different vertex indices.
uvec4 ranks(uvec4 ids) {
    uint yx = uint(ids.y < ids.x), zx = uint(ids.z < ids.x), wx = uint(ids.w < ids.x);
    uint zy = uint(ids.z < ids.y), wy = uint(ids.w < ids.y), wz = uint(ids.w < ids.z);
    return uvec4(yx + zx + wx, (1u - yx) + zy + wy, (1u - zx) + (1u - zy) + wz, (1u - wx) + (1u - wy) + (1u - wz));
}

vec3 select_rank(uvec4 rank, uint r, vec3 a, vec3 b, vec3 c, vec3 d) {
    return rank.x == r ? a : rank.y == r ? b : rank.z == r ? c : d;
}

// From corners in the caller's order.
Tet make_tet(uvec4 ids, vec3 a, vec3 b, vec3 c, vec3 d) {
    Tet t;
    t.rank = ranks(ids);
    for (uint r = 0u; r < 4u; ++r) t.v[r] = select_rank(t.rank, r, a, b, c, d);
    return t;
}

float volume(Tet t) { return orient(t.v[0], t.v[1], t.v[2], t.v[3]); }

// The box of a tetrahedron, and its margin: a weight this near to 0 may be that of a point on either side of the face, by rounding.
struct Bounds {
    vec3 lo;
    vec3 hi;
    float margin;
};

// Of coordinates, which are not negative and thus in the order of their bits: integers need no care for NaN.
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
    Weights r;
    r.w = vec4(-s * orient(t.v[1], t.v[2], t.v[3], p), s * orient(t.v[0], t.v[2], t.v[3], p), -s * orient(t.v[0], t.v[1], t.v[3], p),
               s * orient(t.v[0], t.v[1], t.v[2], p));
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

// Whether no face says outside by more than the margin.
bool near(Weights r) { return least_of(r.w) >= -r.margin; }

// Whether the point is that near to one face, and inside of all others by more.
bool near_one_face(Weights r) {
    uvec4 close = uvec4(lessThanEqual(r.w, vec4(r.margin)));
    return near(r) && close.x + close.y + close.z + close.w == 1u;
}

// Weights in the caller's order of vertices, which is that of the faces.
vec4 own_weights(Weights w, Tet tet) { return vec4(w.w[tet.rank.x], w.w[tet.rank.y], w.w[tet.rank.z], w.w[tet.rank.w]); }

// The face that says outside most.
uint outermost(vec4 own) {
    uint face = 0u;
    for (uint f = 1u; f < 4u; ++f) face = own[f] < own[face] ? f : face;
    return face;
}

// What a step of a walk needs: cheaper than `weights`, but neighbours may disagree about their face by rounding.
struct Sides {
    vec4 w;     // as in Weights, opposite to the vertices in their order here
    float sum;  // of them
    bool clear; // as in Weights
    bool near;  // no face says outside by more than the margin
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

// The same of any point, in the caller's order: what an owner comes with, whatever found it.
vec4 barycentric(Tet t, vec3 p) {
    vec4 b = barycentric(sides_of(t.v, bounds_of(t.v), p));
    return vec4(b[t.rank.x], b[t.rank.y], b[t.rank.z], b[t.rank.w]);
}

// What has these values at the corners, at barycentric coordinates.
float weighed(vec4 b, vec4 at_corners) {
    precise float r = (b.x * at_corners.x + b.y * at_corners.y) + (b.z * at_corners.z + b.w * at_corners.w);
    return r;
}

const float SMALLEST_FLOAT = -3.40282347e38;

// Smallest barycentric coordinate; the smallest float for a flat cell.
float smallest(Weights r) {
    if (r.sum <= 0.0) return SMALLEST_FLOAT;
    precise float b = min(min(r.w.x, r.w.y), min(r.w.z, r.w.w)) * reciprocal(r.sum);
    return b;
}

// Barycentric coordinates in the caller's order of vertices.
vec4 barycentric(Weights r, uvec4 rank) {
    float k = r.sum <= 0.0 ? 0.0 : reciprocal(r.sum);
    precise vec4 b = vec4(r.w[rank.x], r.w[rank.y], r.w[rank.z], r.w[rank.w]) * k;
    return b;
}
