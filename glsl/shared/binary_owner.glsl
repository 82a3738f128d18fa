// Point location in the baseline's binary tree, which finds the same owner as the octree. Needs grid.glsl, tet.glsl,
// and nodes, root, ids, boundary, cells, vertices.
#include "shared/binary_tree.glsl"
#include "shared/best_owner.glsl"
#include "shared/owner_search.glsl"
#include "shared/boundary_tet.glsl"

// Boxes are grown by this share of their size, so that tetrahedra that contain a point only within the tolerance are
// met, too.
const float GROW = 4e-5;
// A point that rounding puts outside of all tetrahedra around it has barycentric coordinates of at least minus this.
const float ROUNDING = 1e-5;

vec3 sought;

bool holds(vec3 lo, vec3 hi) {
    precise vec3 grow = (hi - lo) * GROW;
    precise vec3 least = lo - grow, most = hi + grow;
    return all(lessThanEqual(least, sought)) && all(lessThanEqual(sought, most));
}

bool enters(uint reference) {
    if ((reference & BINARY_LEAF) != 0u) return true; // the tetrahedron's own box decides
    vec3 lo, hi;
    box_of(reference, lo, hi);
    return holds(lo, hi);
}
#include "shared/binary_walk.glsl"

void look_at(inout Best best, uint t) {
    if (best.inside && best.owner < t) return;
    Tet tet = load_tet(words(cells.at[t]));
    if (holds(min(min(tet.v[0], tet.v[1]), min(tet.v[2], tet.v[3])), max(max(tet.v[0], tet.v[1]), max(tet.v[2], tet.v[3]))))
        consider(best, t, tet, weights(tet, sought));
}

// Continues a search for the owner of the point `at`, `x` in normalised coordinates. Returns false if the budget is
// spent before the search has ended.
bool find_owner(inout OwnerSearch s, Grid g, vec3 at, vec3 x, float tolerance, inout uint work, uint budget, out uint owner) {
    owner = NONE;
    if (!near_bounds(g, at)) return true;
    sought = x;
    BinaryWalk walk = binary_walk_from(s.cursor);
    budget = binary_budget(work, budget);
    uint place = WALK_PAUSED;
    while (work < budget) {
        place = next_place(walk, work, budget);
        if (place >= WALK_PAUSED) break;
        look_at(s.best, ids.at[place]);
        ++work;
        place = WALK_PAUSED;
    }
    s.cursor = resume_place(walk);
    if (place == WALK_PAUSED && s.cursor != NONE) return false;
    Best best = s.best;
    s = no_search();
    if (best.owner == NONE) return true;
    // A tetrahedron that is not on the boundary has neighbours on all sides, so what lies next to it lies in the mesh.
    bool surrounded = !is_boundary_tet(best.owner);
    if (best.inside || best.smallest >= -(surrounded ? max(tolerance, ROUNDING) : tolerance)) owner = best.owner;
    return true;
}
