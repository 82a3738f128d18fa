// Candidates for the owner of a point. Twin of src/reference/candidates.rs. Needs tet.glsl, and vertices.

Tet load_tet(uvec4 ids) {
    return make_tet(ids, vertices.at[ids.x].xyz, vertices.at[ids.y].xyz, vertices.at[ids.z].xyz, vertices.at[ids.w].xyz);
}

// The best of the candidates so far.
struct Best {
    uint owner; // NONE: none yet
    bool inside;
    bool in_box;
    float smallest;
};

Best no_best() { return Best(NONE, false, false, SMALLEST_FLOAT); }

// Takes candidate t if it is better: one that contains the point before others, of those the lowest id; then one whose box does, then the largest
// smallest barycentric coordinate, then the lowest id. Flat cells never.
void consider(inout Best best, uint t, Tet tet, Weights w) {
    if (w.inside) {
        if (!best.inside || t < best.owner) best = Best(t, true, true, 0.0);
        return;
    }
    if (best.inside) return;
    float s = smallest(w);
    bool closer = s > best.smallest || (s == best.smallest && t < best.owner);
    bool better = best.owner == NONE || (w.in_box && !best.in_box) || (w.in_box == best.in_box && closer);
    if (better && volume(tet) != 0.0) best = Best(t, false, w.in_box, s);
}
