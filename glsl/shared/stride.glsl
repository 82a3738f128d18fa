// Strides, the hot part of a walk (SPEC 2.6). Twin of `Stand` in src/reference/walk.rs. Needs best_owner.glsl, cells,
// vertices and neighbours.
#include "shared/vertices.glsl"

// The tetrahedron that a stride has reached. Its corners are kept in ascending index, so that what is computed from
// them does not depend on the path.
struct Stand {
    uint t;
    uvec4 cell; // vertices in the caller's order
    uvec4 ids;  // vertices in ascending order
    // Neighbours across the faces opposite to `cell`, loaded together with it so that their cache misses overlap.
    uvec4 beside;
    vec4 x, y, z;
};

// How a step changes what is kept per corner.
struct Exchange {
    uint fresh;   // the vertex that enters
    bvec3 beyond; // whether the place of the corner that leaves is 0; at most 1; at most 2
    bvec3 before; // whether the fresh vertex comes before each of the corners kept
};

// Tetrahedra tested by strides and walks so far, and passes over stars as a part of such a test, which count towards a
// kernel's budget.
uint walked_tets = 0u;

Stand stand_nowhere() { return Stand(NONE, uvec4(0u), uvec4(0u), uvec4(0u), vec4(0.0), vec4(0.0), vec4(0.0)); }

vec3 corner_of(Stand s, uint k) { return vec3(s.x[k], s.y[k], s.z[k]); }

vec3[4] corners_of(Stand s) { return vec3[4](corner_of(s, 0u), corner_of(s, 1u), corner_of(s, 2u), corner_of(s, 3u)); }

Stand stand_in(uint t) {
    Stand s;
    s.t = t;
    s.cell = words(cells.at[t]);
    s.beside = words(neighbours.at[t]);
    uvec4 rank = ranks(s.cell);
    for (uint r = 0u; r < 4u; ++r) s.ids[r] = rank.x == r ? s.cell.x : rank.y == r ? s.cell.y : rank.z == r ? s.cell.z : s.cell.w;
    vec3 a = vertex(s.ids.x), b = vertex(s.ids.y), c = vertex(s.ids.z), d = vertex(s.ids.w);
    s.x = vec4(a.x, b.x, c.x, d.x);
    s.y = vec4(a.y, b.y, c.y, d.y);
    s.z = vec4(a.z, b.z, c.z, d.z);
    return s;
}

Tet tet_of(Stand s) { return Tet(corners_of(s), ranks(s.cell)); }

Sides sides_of(Stand s, vec3 x) {
    vec3 v[4] = corners_of(s);
    return sides_of(v, bounds_of(v), x); // kept bounds would save a few operations and take seven registers
}

float of_vertex(Stand s, vec4 ascending, uint id) {
    return s.ids.x == id ? ascending.x : s.ids.y == id ? ascending.y : s.ids.z == id ? ascending.z : ascending.w;
}

// Barycentric coordinates of the point that `at` was computed for, in the caller's order.
vec4 barycentric(Stand s, Sides at) {
    vec4 b = barycentric(at);
    return vec4(of_vertex(s, b, s.cell.x), of_vertex(s, b, s.cell.y), of_vertex(s, b, s.cell.z), of_vertex(s, b, s.cell.w));
}

uvec3 kept(uvec4 held, bvec3 beyond) { return mix(held.xyz, held.yzw, beyond); }

// Data per corner after a step, with that of the fresh corner.
uvec4 exchange(uvec4 held, Exchange e, uint fresh) {
    uvec3 k = kept(held, e.beyond);
    return uvec4(e.before.x ? fresh : k.x, e.before.x ? k.x : e.before.y ? fresh : k.y, e.before.y ? k.y : e.before.z ? fresh : k.z,
                 e.before.z ? k.z : fresh);
}

vec4 exchange(vec4 held, Exchange e, float fresh) {
    return uintBitsToFloat(exchange(floatBitsToUint(held), e, floatBitsToUint(fresh)));
}

uint xor_of(uvec4 ids) { return ids.x ^ ids.y ^ ids.z ^ ids.w; }

// Steps through the face with the most negative weight. Returns false if no weight is negative or nothing lies beyond
// that face; the stand must then not be used.
bool step_on(inout Stand s, Sides at, out Exchange e) {
    float least = min(min(at.w.x, at.w.y), min(at.w.z, at.w.w));
    e.beyond.x = at.w.x == least;
    e.beyond.y = e.beyond.x || at.w.y == least;
    e.beyond.z = e.beyond.y || at.w.z == least;
    e.before = bvec3(false);
    e.fresh = 0u;
    if (least >= 0.0) return false;
    uint left = e.beyond.x ? s.ids.x : e.beyond.y ? s.ids.y : e.beyond.z ? s.ids.z : s.ids.w;
    s.t = s.cell.x == left ? s.beside.x : s.cell.y == left ? s.beside.y : s.cell.z == left ? s.beside.z : s.beside.w;
    if (s.t == NONE) return false;
    // Three corners are shared; the fresh one replaces the fourth.
    s.cell = words(cells.at[s.t]);
    s.beside = words(neighbours.at[s.t]);
    e.fresh = xor_of(s.cell) ^ xor_of(s.ids) ^ left;
    vec3 v = vertex(e.fresh);
    e.before = lessThan(uvec3(e.fresh), kept(s.ids, e.beyond));
    s.ids = exchange(s.ids, e, e.fresh);
    s.x = exchange(s.x, e, v.x);
    s.y = exchange(s.y, e, v.y);
    s.z = exchange(s.z, e, v.z);
    return true;
}

bool step_on(inout Stand s, Sides at) {
    Exchange e;
    return step_on(s, at, e);
}

// The part of a straight way that lies before a face, whose weight is `here` at the start and `there`, below 0, at the
// end.
float way_before(float here, float there) {
    float from = max(here, 0.0);
    precise float length = from - there;
    precise float part = from * reciprocal(length);
    return part;
}

// The owner of x, where x is near one face of the stand and far from all other faces of the two tetrahedra that share
// it; else NONE.
uint owner_at_face(Stand s, vec3 x) {
    Tet tet = tet_of(s);
    Weights here = weights(tet, x);
    uint u = near_one_face(here) ? s.beside[outermost(own_weights(here, tet))] : NONE;
    if (u == NONE) return NONE;
    Weights there = weights(load_tet(words(cells.at[u])), x);
    // Both sides compute the same magnitude of the weight at their shared face.
    if (!near_one_face(there) || least_of(there.w) != -least_of(here.w)) return NONE;
    return here.inside && (!there.inside || s.t < u) ? s.t : there.inside ? u : NONE;
}

// The owner of x where a stride ends: the stand if it clearly contains x, or the owner at its face; else NONE.
uint owner_of(Stand s, Sides at, vec3 x) { return at.clear ? s.t : at.near ? owner_at_face(s, x) : NONE; }

// Moves `t` towards x, to its owner if at most `most` steps lead there and x is not near an edge. Otherwise returns
// false and sets `t` to NONE.
bool stride_to(inout uint t, vec3 x, uint most) {
    if (t == NONE) return false;
    Stand s = stand_in(t);
    uint owner = NONE;
    for (uint k = 0u; k < most; ++k) {
        ++walked_tets;
        Sides at = sides_of(s, x);
        owner = owner_of(s, at, x);
        if (owner != NONE || at.near || !step_on(s, at)) break;
    }
    t = owner;
    return owner != NONE;
}
