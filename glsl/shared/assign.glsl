// Whether a tetrahedron touches a cell (SPEC 2.2). Twin of src/reference/assign.rs, which explains the bounds; the
// operations and their order are the same.
#include "shared/centre.glsl"

const uint EXACT = 2u;

struct Filter {
    vec3 normal[4];
    vec3 at[4];
    float limit[4];
    bool edges;
    vec3 edge_at[6];
    vec3 along[6];
    vec3 shadow_lo[6];
    vec3 shadow_hi[6];
};

vec3 inflated(Grid g, vec3 h) {
    precise vec3 r = h + (g.extent.xyz * two_to(g.graded == 0u ? -20 : -18) + two_to(-41));
    return r;
}

// For cells with half size h.
Filter make_filter(Tet t, Grid g, vec3 h, uint assign) {
    Filter f;
    vec3 box_half = inflated(g, h);
    precise vec3 size = max(max(t.v[0], t.v[1]), max(t.v[2], t.v[3])) - min(min(t.v[0], t.v[1]), min(t.v[2], t.v[3]));
    precise vec3 slack = (size + 2.0 * box_half) * two_to(-18) + two_to(-42);
    float vol = volume(t);
    float s = vol < 0.0 ? -1.0 : 1.0;
    for (uint i = 0u; i < 4u; ++i) {
        uvec3 face = FACES[i];
        precise vec3 a = t.v[face.y] - t.v[face.x];
        precise vec3 b = t.v[face.z] - t.v[face.x];
        float outward = (i & 1u) == 0u ? s : -s;
        precise vec3 normal = outward * cross_product(a, b);
        precise float limit = dot_product(abs(normal), box_half) + dot_product(sum_of_products(a, b), slack);
        f.normal[i] = normal;
        f.at[i] = t.v[face.x];
        f.limit[i] = limit;
    }
    vol = abs(vol);
    precise float room = (size.x * size.y) * size.z;
    precise float least = room * two_to(-12);
    f.edges = assign == EXACT && vol > least;
    if (!f.edges) return f;
    precise float spread_by = (room * reciprocal(vol)) * two_to(-16);
    for (uint e = 0u; e < 6u; ++e) {
        uvec4 edge = EDGES[e];
        precise vec3 along = t.v[edge.y] - t.v[edge.x];
        precise vec3 um = t.v[edge.z] - t.v[edge.x];
        precise vec3 un = t.v[edge.w] - t.v[edge.x];
        f.edge_at[e] = t.v[edge.x];
        f.along[e] = along;
        for (uint axis = 0u; axis < 3u; ++axis) {
            uint i = (axis + 1u) % 3u, j = (axis + 2u) % 3u;
            precise float tm = um[i] * along[j] - um[j] * along[i];
            precise float tn = un[i] * along[j] - un[j] * along[i];
            float lo = min(min(tm, tn), 0.0), hi = max(max(tm, tn), 0.0);
            float ai = abs(along[i]), aj = abs(along[j]);
            precise float width = hi - lo;
            precise float grow = ((aj * box_half[i] + ai * box_half[j]) + (aj * slack[i] + ai * slack[j])) + spread_by * width;
            precise float grown_lo = lo - grow, grown_hi = hi + grow;
            f.shadow_lo[e][axis] = grown_lo;
            f.shadow_hi[e][axis] = grown_hi;
        }
    }
    return f;
}

bool touches(Filter f, vec3 centre) {
    for (uint i = 0u; i < 4u; ++i) {
        precise vec3 u = centre - f.at[i];
        if (dot_product(f.normal[i], u) > f.limit[i]) return false;
    }
    if (!f.edges) return true;
    for (uint e = 0u; e < 6u; ++e) {
        precise vec3 u = centre - f.edge_at[e];
        vec3 along = f.along[e];
        for (uint axis = 0u; axis < 3u; ++axis) {
            uint i = (axis + 1u) % 3u, j = (axis + 2u) % 3u;
            precise float t = u[i] * along[j] - u[j] * along[i];
            if (t < f.shadow_lo[e][axis] || t > f.shadow_hi[e][axis]) return false;
        }
    }
    return true;
}
