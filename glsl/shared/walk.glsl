// Walking to a point across shared faces (SPEC 2.6). Twin of src/reference/walk.rs, which explains it; the operations
// and their order are the same. Needs best_owner.glsl, cells and neighbours.
const uint STAR = 128u;   // Most tetrahedra of a star. A vertex of more is crowded, and never walked to; see corners.glsl.
const uint STEPS = 512u;  // Most steps of part 1.
const uint HINTED = 16u;  // Most steps of a stride from a hint.
const uint STRIDE = 64u;  // Most steps of a stride through a leaf.
const uint LEG = 1024u;   // Most steps along one segment.
const uint DETOURS = 8u;  // Points of the cell to go by in parts 2 and 3; the first one is the centre.
const uint ARRIVALS = 2u; // Stars that part 1 searches.
// Most steps of part 1 after a star without an owner. Some tetrahedra round an edge may be too far from x to belong to
// its star, which then falls into parts; so the walk goes on until it comes to the tetrahedron that contains x, if there
// is one.
const uint ROUND = STAR;
// -2^-17. With a smallest barycentric coordinate of at least this, x lies in a gap between tetrahedra that is due to
// rounding, and the nearest tetrahedron owns it.
const float GAP = -7.62939453125e-6;

#include "shared/centre.glsl"
#include "shared/stride.glsl"

uint star[STAR];
uint star_size;

// Looks at four at a time: some drivers end the loops of an invocation after 65,535 passes in all.
bool in_star(uint t) {
    for (uint i = 0u; i < star_size; i += 4u) {
        uint left = star_size - i;
        if (star[i] == t || (left > 1u && star[i + 1u] == t) || (left > 2u && star[i + 2u] == t) || (left > 3u && star[i + 3u] == t)) return true;
    }
    return false;
}

// Adds to the star of x the neighbours of its member `t` that x is near, across faces that x is near. Others must not take
// a place: there are as many as corners.glsl counts on.
void grow_star(uint t, Tet tet, Weights w, vec3 x) {
    vec4 own = own_weights(w, tet);
    uvec4 beside = words(neighbours.at[t]);
    [[dont_unroll]] for (uint f = 0u; f < 4u; ++f) { // every iteration contains a whole containment test
        uint u = beside[f];
        if (own[f] > w.margin || u == NONE || star_size == STAR || in_star(u)) continue;
        ++walked_tets;
        if (near(weights(load_tet(words(cells.at[u])), x))) star[star_size++] = u;
    }
}

// Considers all tetrahedra of the star of x as its owner, starting with `first`.
void arrive(uint first, vec3 x, inout Best best) {
    star[0] = first;
    star_size = 1u;
    for (uint i = 0u; i < star_size; ++i) {
        uint t = star[i];
        ++walked_tets;
        Tet tet = load_tet(words(cells.at[t]));
        Weights w = weights(tet, x);
        consider(best, t, tet, w);
        grow_star(t, tet, w, x);
    }
    walked_tets += star_size * star_size / 16u; // the passes of `in_star` are work as well
}

bool settled(Best best) { return best.inside || (best.in_box && best.smallest >= GAP); }

// Part 1, from `t`, which step number `s` has reached. Returns whether `t` is now near x or, if one star has been
// searched without an owner, contains it. A tetrahedron that clearly contains x becomes the best one, and ends the
// walk.
bool walk_towards(inout uint t, inout uint s, bool arrived, vec3 x, inout Best best) {
    if (arrived) s = max(s, STEPS - ROUND);
    for (; s < STEPS; ++s) {
        ++walked_tets;
        Tet tet = load_tet(words(cells.at[t]));
        Weights w = weights(tet, x);
        if (w.clear) best = Best(t, true, true, 0.0);
        if (w.clear || (arrived ? w.inside : near(w))) return !w.clear;
        vec4 own = own_weights(w, tet);
        uint face = outermost(own), next = own[face] < 0.0 ? words(neighbours.at[t])[face] : NONE;
        if (next == NONE) return false;
        t = next;
    }
    return false;
}

// Walks straight from `a`, which lies in `t`, to `b`. Returns the tetrahedron where the segment ends, or the last one
// before it leaves the mesh, through the face opposite to vertex number `left`; else `left` is NONE.
uint walk_leg(uint t, vec3 a, vec3 b, out uint left) {
    uint from = t;
    left = NONE;
    for (uint s = 0u; s < LEG; ++s) {
        ++walked_tets;
        Tet tet = load_tet(words(cells.at[t]));
        vec4 before = own_weights(weights(tet, a), tet), behind = own_weights(weights(tet, b), tet);
        uvec4 beside = words(neighbours.at[t]);
        float first = 3.40282347e38;
        uint face = NONE;
        for (uint f = 0u; f < 4u; ++f) {
            if (behind[f] >= 0.0 || beside[f] == from) continue;
            float at = way_before(before[f], behind[f]);
            if (at < first) {
                first = at;
                face = f;
            }
        }
        if (face == NONE || beside[face] == NONE) {
            left = face;
            break;
        }
        from = t;
        t = beside[face];
    }
    return t;
}

// Point number k of the cell; the first is its centre.
vec3 cell_point(CellShape cell, uint k) {
    vec3 p;
    for (uint c = 0u; c < 3u; ++c) {
        precise float part = float((3u * k + c) * 0x9e3779b9u >> 8) * two_to(-23) - 1.0;
        float away = k == 0u ? 0.0 : part;
        precise float at = cell.centre[c] + cell.half_size[c] * away;
        precise float whole = floor(at * two_to(42)) * two_to(-42);
        p[c] = whole;
    }
    return p;
}

// Walks to a point x of a cell that is full of mesh, from its seed: directly, through up to ARRIVALS stars, then by
// DETOURS points. The owner may be in another part of the first star, so x counts as in a gap only after the second.
// All of it is one loop, so that a kernel contains each part only once.
Best walk_from_seed(uint seed, CellShape cell, vec3 x) {
    Best best = no_best();
    uint t = seed, s = 0u;
    [[dont_unroll]] for (uint way = 0u; way < ARRIVALS + DETOURS && !(way < ARRIVALS ? best.inside : settled(best)); ++way) {
        if (way < ARRIVALS) {
            if (!walk_towards(t, s, way > 0u, x, best)) {
                way = ARRIVALS - 1u;
                continue;
            }
        } else {
            uint k = way - ARRIVALS;
            vec3 by = cell_point(cell, k);
            uint left; // the cell is full of mesh: nothing leads out of it
            t = seed;
            // The first point is the centre, where the walk starts.
            [[dont_unroll]] for (uint leg = k == 0u ? 1u : 0u; leg < 2u; ++leg) t = walk_leg(t, leg == 0u ? cell.centre : by, leg == 0u ? by : x, left);
        }
        arrive(t, x, best);
    }
    return best;
}
