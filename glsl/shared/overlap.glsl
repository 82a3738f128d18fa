// What the overlap kernels share. Twin of src/reference/overlap.rs. The including kernel declares grid, cells,
// positions (of the other mesh and its tree), own_cells, own_positions, frame.

vec3 canonical3(vec3 p) { return vec3(canonical(p.x), canonical(p.y), canonical(p.z)); }

// A tetrahedron in the units of the meshes, with its vertices in ascending index.
struct RawTet {
    vec3 v[4];
    vec3 lo; // box
    vec3 hi;
};

RawTet raw_tet(uvec4 ids, vec3 a, vec3 b, vec3 c, vec3 d) {
    RawTet t;
    t.v = make_tet(ids, canonical3(a), canonical3(b), canonical3(c), canonical3(d)).v;
    t.lo = min(min(t.v[0], t.v[1]), min(t.v[2], t.v[3]));
    t.hi = max(max(t.v[0], t.v[1]), max(t.v[2], t.v[3]));
    return t;
}

bool boxes_meet(vec3 a_lo, vec3 a_hi, vec3 b_lo, vec3 b_hi) { return all(lessThanEqual(a_lo, b_hi)) && all(lessThanEqual(b_lo, a_hi)); }
