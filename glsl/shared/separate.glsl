// Separating axes of tetrahedra and boxes, and closest points (SPEC 3.4, 3.5). Twin of src/reference/separate.rs, which
// explains the allowance for rounding; the operations and their order are the same. Needs grid.glsl, tet.glsl.

vec3 difference(vec3 a, vec3 b) {
    precise vec3 r = a - b;
    return r;
}

vec3 touch_slack(vec3 v[4], vec3 h[3]) {
    vec3 lo = min(min(v[0], v[1]), min(v[2], v[3])), hi = max(max(v[0], v[1]), max(v[2], v[3]));
    vec3 far = max(abs(hi), abs(lo));
    precise vec3 extent = (abs(h[0]) + abs(h[1])) + abs(h[2]);
    precise vec3 slack = (far + extent) * two_to(-20) + two_to(-42);
    return slack;
}

// Whether an axis separates the tetrahedron from the box around 0.
bool axis_apart(vec3 v[4], vec3 h[3], vec3 slack, vec3 axis, vec3 bound) {
    float a = dot_product(axis, v[0]), b = dot_product(axis, v[1]), c = dot_product(axis, v[2]), d = dot_product(axis, v[3]);
    float lo = min(min(a, b), min(c, d)), hi = max(max(a, b), max(c, d));
    precise float radius = (abs(dot_product(axis, h[0])) + abs(dot_product(axis, h[1]))) + abs(dot_product(axis, h[2]));
    precise float limit = radius + dot_product(bound, slack);
    return lo > limit || hi < -limit;
}

// Whether the tetrahedron and the box with its centre at 0 and the half axes h touch.
bool box_touches(vec3 v[4], vec3 h[3], vec3 slack) {
    for (uint i = 0u; i < 3u; ++i) {
        if (axis_apart(v, h, slack, h[i], abs(h[i]))) return false;
    }
    for (uint f = 0u; f < 4u; ++f) {
        uvec3 face = FACES[f];
        vec3 a = difference(v[face.y], v[face.x]), b = difference(v[face.z], v[face.x]);
        if (axis_apart(v, h, slack, cross_product(a, b), sum_of_products(a, b))) return false;
    }
    for (uint e = 0u; e < 6u; ++e) {
        vec3 along = difference(v[EDGES[e].y], v[EDGES[e].x]);
        for (uint i = 0u; i < 3u; ++i) {
            if (axis_apart(v, h, slack, cross_product(along, h[i]), sum_of_products(along, h[i]))) return false;
        }
    }
    return true;
}

// Ends of the interval of four vertices on an axis; the first vertex is at 0.
float low_end(vec3 others) { return min(min(0.0, others.x), min(others.y, others.z)); }
float high_end(vec3 others) { return max(max(0.0, others.x), max(others.y, others.z)); }

// Whether a face normal of a separates it from b.
bool face_separates(vec3 a[4], vec3 b[4]) {
    for (uint i = 0u; i < 4u; ++i) {
        uvec3 face = FACES[i];
        vec3 at = a[face.x];
        vec3 y_side = difference(a[face.y], at), z_side = difference(a[face.z], at);
        vec3 normal = cross_product(y_side, z_side);
        vec3 own = vec3(dot_product(normal, difference(a[i], at)), dot_product(normal, y_side), dot_product(normal, z_side));
        float w = dot_product(normal, difference(b[0], at)), x = dot_product(normal, difference(b[1], at));
        float y = dot_product(normal, difference(b[2], at)), z = dot_product(normal, difference(b[3], at));
        if (min(min(w, x), min(y, z)) > high_end(own) || max(max(w, x), max(y, z)) < low_end(own)) return true;
    }
    return false;
}

// Whether a vertex of one is a vertex of the other.
bool share_vertex(vec3 a[4], vec3 b[4]) {
    bool met = false;
    for (uint i = 0u; i < 4u; ++i) met = met || a[i] == b[0] || a[i] == b[1] || a[i] == b[2] || a[i] == b[3];
    return met;
}

// Whether two closed tetrahedra touch.
bool tets_touch(vec3 a[4], vec3 b[4]) {
    if (share_vertex(a, b)) return true;
    if (face_separates(a, b) || face_separates(b, a)) return false;
    for (uint e = 0u; e < 6u; ++e) {
        uvec4 ea = EDGES[e];
        vec3 pa = a[ea.x];
        vec3 along = difference(a[ea.y], pa), am = difference(a[ea.z], pa), an = difference(a[ea.w], pa);
        for (uint f = 0u; f < 6u; ++f) {
            uvec4 eb = EDGES[f];
            vec3 pb = b[eb.x];
            vec3 along_b = difference(b[eb.y], pb);
            vec3 axis = cross_product(along, along_b);
            vec3 t = vec3(dot_product(axis, along), dot_product(axis, am), dot_product(axis, an));
            vec3 u = vec3(dot_product(axis, along_b), dot_product(axis, difference(b[eb.z], pb)), dot_product(axis, difference(b[eb.w], pb)));
            precise float above = high_end(t) - low_end(u);
            precise float below = low_end(t) - high_end(u);
            float offset = dot_product(axis, difference(pb, pa));
            if (offset > above || offset < below) return false;
        }
    }
    return true;
}

// Squared distance of the tetrahedron's box to 0, scaled by 2^-42.
float box_square(vec3 v[4]) {
    vec3 lo = min(min(v[0], v[1]), min(v[2], v[3])), hi = max(max(v[0], v[1]), max(v[2], v[3]));
    precise vec3 d = max(max(lo, -hi), vec3(0.0)) * two_to(-21);
    return dot_product(d, d);
}

float part_of(float x, float whole) {
    if (whole <= 0.0) return 0.0;
    precise float r = x * reciprocal(whole);
    return clamp(canonical(r), 0.0, 1.0);
}

float area(float x, float y, float z, float w) {
    precise float a = x * y, b = z * w;
    precise float r = canonical(a) - canonical(b);
    return canonical(r);
}

// Weights of the point of the triangle nearest to 0.
vec3 closest_in_triangle(vec3 a, vec3 b, vec3 c) {
    vec3 ab = difference(b, a), ac = difference(c, a);
    float d1 = -dot_product(ab, a), d2 = -dot_product(ac, a);
    if (d1 <= 0.0 && d2 <= 0.0) return vec3(1.0, 0.0, 0.0);
    float d3 = -dot_product(ab, b), d4 = -dot_product(ac, b);
    if (d3 >= 0.0 && d4 <= d3) return vec3(0.0, 1.0, 0.0);
    float d5 = -dot_product(ab, c), d6 = -dot_product(ac, c);
    if (d6 >= 0.0 && d5 <= d6) return vec3(0.0, 0.0, 1.0);
    float vc = area(d1, d4, d3, d2);
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
        precise float whole = d1 - d3;
        float t = part_of(d1, whole);
        precise float rest = 1.0 - t;
        return vec3(rest, t, 0.0);
    }
    float vb = area(d5, d2, d1, d6);
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
        precise float whole = d2 - d6;
        float t = part_of(d2, whole);
        precise float rest = 1.0 - t;
        return vec3(rest, 0.0, t);
    }
    float va = area(d3, d6, d5, d4);
    precise float d43 = d4 - d3, d56 = d5 - d6;
    if (va <= 0.0 && d43 >= 0.0 && d56 >= 0.0) {
        precise float whole = d43 + d56;
        float t = part_of(d43, whole);
        precise float rest = 1.0 - t;
        return vec3(0.0, rest, t);
    }
    precise float sum = (va + vb) + vc;
    float v = part_of(vb, sum), w = part_of(vc, sum);
    precise float u = (1.0 - v) - w;
    return vec3(u, v, w);
}

// Squared distance (scaled by 2^-42) of some of the tetrahedron's faces to 0, one bit each, and the weights of the closest
// point.
float closest_on(vec3 v[4], uint faces, out vec4 weights_of) {
    float best = 3.40282347e38;
    weights_of = vec4(0.0);
    for (uint f = 0u; f < 4u; ++f) {
        if ((faces >> f & 1u) == 0u) continue;
        uvec3 face = FACES[f];
        precise vec3 a = v[face.x] * two_to(-21), b = v[face.y] * two_to(-21), c = v[face.z] * two_to(-21);
        vec3 w = closest_in_triangle(a, b, c);
        precise vec3 at = (w.x * a + w.y * b) + w.z * c;
        precise vec3 squares = at * at;
        precise float xy = canonical(squares.x) + canonical(squares.y);
        precise float xyz = canonical(xy) + canonical(squares.z);
        float square = canonical(xyz);
        if (square < best) {
            best = square;
            weights_of = vec4(0.0);
            weights_of[face.x] = w.x;
            weights_of[face.y] = w.y;
            weights_of[face.z] = w.z;
        }
    }
    return max(best, box_square(v));
}

float closest(vec3 v[4], out vec4 weights_of) { return closest_on(v, 15u, weights_of); }
