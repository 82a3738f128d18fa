// Who is listed where under Lists::Boundary (SPEC 2.6). Twin of src/reference/marks.rs, which explains it. Needs walk.glsl and marks.

bool is_marked(uint code) { return (marks.at[code >> 5u] >> (code & 31u) & 1u) != 0u; }

// Whether t is a seed of an unmarked cell with this centre: it contains it and no lower one does, or it is near and none does.
bool owns_centre(uint t, Tet tet, vec3 centre) {
    Weights own = weights(tet, centre);
    if (own.clear || !own.in_box || !near(own)) return own.clear;
    uint beaten_below = own.inside ? t : NONE;
    star[0] = t;
    star_size = 1u;
    for (uint i = 0u; i < star_size; ++i) {
        uint u = star[i];
        Tet other = load_tet(cells.at[u]);
        Weights w = weights(other, centre);
        if (w.inside && u < beaten_below) return false;
        grow_star(u, other, w, centre);
    }
    return true;
}
