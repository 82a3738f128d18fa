// The values of the field at the corners of a stand, in the order of its corners. Needs stride.glsl, `field` and
// ON_CELLS.

// The values in a tetrahedron that has just been entered.
vec4 field_in(Stand s) {
    if (ON_CELLS != 0u) return vec4(field.at[s.t]);
    return vec4(field.at[s.ids.x], field.at[s.ids.y], field.at[s.ids.z], field.at[s.ids.w]);
}

// The values after a step, in the tetrahedron that it entered.
vec4 field_behind(vec4 held, Stand s, Exchange e) {
    if (ON_CELLS != 0u) return vec4(field.at[s.t]);
    return exchange(held, e, field.at[e.fresh]);
}

float value_of(vec4 held, vec4 b) { return ON_CELLS != 0u ? held.x : weighed(b, held); }
