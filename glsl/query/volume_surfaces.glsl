// Iso-surfaces on a ray, and where a ray enters and leaves a tetrahedron. Part of volume_march.glsl, whose ray and stand
// it uses. Twin of src/reference/volume/march.rs.

// A place of the ray: its distance from the origin in steps, the field's value there, and the number of iso-values that
// the value is not below.
struct Place {
    float at;
    float value;
    uint rank;
};

Place place_at(float at, float value) {
    uint rank = 0u;
    for (uint i = 0u; i < 8u; ++i) rank += uint(i < view.isos && !(value < view.iso[i]));
    return Place(at, value, rank);
}

Place place_beside(Place p, float steps, float rise) {
    precise float at = p.at + steps;
    precise float value = p.value + rise * steps;
    return place_at(at, value);
}

// How far a straight way stays in a tetrahedron: the part of it, at most 1, from a point in the tetrahedron, whose
// weights are `here`, to one whose weights are `there`.
float way_within(vec4 here, vec4 there) {
    float least = 1.0;
    for (uint f = 0u; f < 4u; ++f) {
        float part = there[f] < 0.0 ? way_before(here[f], there[f]) : 1.0;
        if (part < least) least = part;
    }
    return least;
}

// The stretch of the ray around sample k, which has this value, in the tetrahedron of the sample, but no farther than to
// the samples beside k: where it begins and ends, and the values there. If it joins the stretch of the sample before, it
// begins at the sample: two such stretches usually meet at a face, so the value is linear between them.
void find_ends(uint k, Sides here, float value, bool joins, out Place from, out Place to) {
    precise float at = float(k) + 0.5;
    from = to = place_at(at, value);
    Sides next = sides_of(stand, normalise(grid.at[0], sample_at(view, origin, direction, k + 1u)));
    precise float rise = value_of(held_values, barycentric(next)) - value;
    if ((floatBitsToUint(rise) & 0x7fffffffu) >= floatBitsToUint(1e37)) return; // by its bits: it may be NaN
    if (!joins) {
        precise vec4 change = next.w - here.w;
        precise vec4 behind = here.w - change;
        from = place_beside(from, -min(way_within(here.w, behind), at), rise);
    }
    to = place_beside(to, way_within(here.w, next.w), rise);
}

// Barycentric coordinates in the stand of a place of the ray, which lies in it but for rounding.
vec4 barycentric_at(float steps) {
    precise float s = steps * view.step_size;
    precise vec3 at = origin + direction * s;
    vec4 b = max(barycentric(sides_of(stand, normalise(grid.at[0], at))), vec4(0.0));
    precise vec4 within = b * reciprocal(max((b.x + b.y) + (b.z + b.w), 1.0));
    return within;
}

// Adds the surfaces between two places of the ray, between which the value is linear, but for those beyond a clip or a depth.
// Light takes them to lie in the stand.
void add_surfaces(Place from, Place to) {
    bool rises = from.rank < to.rank;
    for (uint i = from.rank; i != to.rank && sum.w < view.termination; i += rises ? 1u : ~0u) {
        float iso = view.iso[rises ? i : i - 1u];
        precise float rise = clamp(to.value - from.value, -1e37, 1e37);
        precise float part = canonical(rise) == 0.0 ? 1.0 : clamp((iso - from.value) * reciprocal(rise), 0.0, 1.0);
        precise float steps = from.at + (to.at - from.at) * part;
        if (steps < unclipped.x || steps > unclipped.y) continue;
        vec4 color = lookup(iso);
        if (color.w > 0.0) add(steps, color, normal_at(barycentric_at(steps)));
    }
}
