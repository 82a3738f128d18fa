// Candidate owners of a point. Twin of src/reference/best_owner.rs. Needs grid.glsl and vertices.
#include "shared/vertices.glsl"
#include "shared/quarters.glsl"

// A point whose owner is searched for.
struct Sought {
    vec3 x;             // in normalised coordinates
    uvec3 least, most;  // range of finest-grid cells that the box of an owner must meet
    uint quarters;      // quarters of its leaf's cell that contain it, packed as in an entry; 0: not tested
};

// How many finest cells a box grows by on every side so that it contains all points that its tetrahedron may own.
// Those of a graded grid may be 64 times as small.
uint cells_beyond(Grid g, float tolerance) {
    precise float cells = clamp(tolerance, 0.0, 1.0) * (g.graded == 0u ? 4096.0 : 262144.0);
    return 1u + whole_of(cells);
}

// Whether quarters and slabs leave room for a tolerance.
bool leaves_room(Grid g, float tolerance) { return cells_beyond(g, tolerance) == 1u; }

// The point `at`, in the units of the mesh. A point with barycentric coordinates of at least -t lies outside of the
// tetrahedron's box by at most 3 t times the size of the box.
Sought sought_at(Grid g, vec3 at, vec3 x, float tolerance) {
    uvec3 cell = quantize(g, at);
    uvec3 reach = reach_of(g, cells_beyond(g, tolerance));
    return Sought(x, cell - min(cell, reach), cell + reach, leaves_room(g, tolerance) ? quarters_around(g, cell) : 0u);
}

// Whether a tetrahedron's quantized box is near enough for it to own the point. This reads one word per vertex, its
// cell of the finest grid.
bool is_near(uvec4 ids, Sought s) {
    uvec3 a = vertex_cell(ids.x), b = vertex_cell(ids.y), c = vertex_cell(ids.z), d = vertex_cell(ids.w);
    return all(lessThanEqual(min(min(a, b), min(c, d)), s.most)) && all(greaterThanEqual(max(max(a, b), max(c, d)), s.least));
}

// The best candidate owner so far.
struct Best {
    uint owner; // NONE: none yet
    bool inside;
    bool in_box;
    float smallest;
};

Best no_best() { return Best(NONE, false, false, SMALLEST_FLOAT); }

// Takes candidate t if it is better. Tetrahedra that contain the point come first, ordered by id; then those whose box
// contains it; then those with a larger smallest barycentric coordinate; then those with a lower id. Flat tetrahedra
// are never taken.
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
