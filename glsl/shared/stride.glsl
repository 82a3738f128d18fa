// The hot part of a walk (SPEC 2.6). Twin of `stride_to` in src/reference/walk.rs. Needs tet.glsl, cells, vertices and neighbours.

// The tetrahedron that a stride stands in.
struct Stand {
    uint t;
    uvec4 cell; // vertices in the caller's order
    uvec4 ids;  // and as held here
    vec3 v0, v1, v2, v3;
};

Stand stand_in(uint t) {
    uvec4 ids = cells.at[t];
    return Stand(t, ids, ids, vertices.at[ids.x].xyz, vertices.at[ids.y].xyz, vertices.at[ids.z].xyz, vertices.at[ids.w].xyz);
}

Sides sides_of(Stand s, vec3 x) { return sides_of(s.v0, s.v1, s.v2, s.v3, x); }

// As `outermost` in tet.glsl, as a mask: it says which corner a step replaces.
bvec4 outermost_of(vec4 w) {
    bvec4 least = equal(w, vec4(min(min(w.x, w.y), min(w.z, w.w))));
    return bvec4(least.x, least.y && !least.x, least.z && !(least.x || least.y), !(least.x || least.y || least.z));
}

uint xor_of(uvec4 ids) { return ids.x ^ ids.y ^ ids.z ^ ids.w; }

// One step through the face that says outside most; false, and nowhere, if none does or there is nothing behind it.
bool step_on(inout Stand s, Sides at) {
    bvec4 out_most = outermost_of(at.w);
    uint left = xor_of(mix(uvec4(0u), s.ids, out_most));
    if (min(min(at.w.x, at.w.y), min(at.w.z, at.w.w)) >= 0.0) return false;
    s.t = neighbours.at[s.t][s.cell.x == left ? 0u : s.cell.y == left ? 1u : s.cell.z == left ? 2u : 3u];
    if (s.t == NONE) return false;
    // Three corners are shared; the fourth takes the place of the one left behind.
    s.cell = cells.at[s.t];
    uint fresh = xor_of(s.cell) ^ xor_of(s.ids) ^ left;
    vec3 v = vertices.at[fresh].xyz;
    s.ids = mix(s.ids, uvec4(fresh), out_most);
    s.v0 = mix(s.v0, v, bvec3(out_most.x));
    s.v1 = mix(s.v1, v, bvec3(out_most.y));
    s.v2 = mix(s.v2, v, bvec3(out_most.z));
    s.v3 = mix(s.v3, v, bvec3(out_most.w));
    return true;
}

// Goes from `t` to the tetrahedron that holds x clearly, if it is not far; false, and anywhere, if not.
bool stride_to(inout uint t, vec3 x, uint most) {
    if (t == NONE) return false;
    Stand s = stand_in(t);
    bool found = false;
    for (uint k = 0u; k < most; ++k) {
        Sides at = sides_of(s, x);
        found = at.clear;
        if (found || !step_on(s, at)) break;
    }
    t = s.t;
    return found;
}
