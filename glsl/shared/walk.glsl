// Walking to a point across shared faces (SPEC 2.6). Twin of src/reference/walk.rs, which explains it: the same operations in the same order. Needs
// candidates.glsl, cells and neighbours.
const uint STAR = 128u;    // tetrahedra of a star
const uint STEPS = 512u;   // of part 1
const uint HINTED = 16u;   // of a stride from a hint
const uint STRIDE = 64u;   // of a stride through a leaf
const uint LEG = 1024u;    // along one segment
const uint DETOURS = 8u;   // points to go by
const uint ARRIVALS = 2u;  // stars that part 1 looks at
const float GAP = -7.62939453125e-6; // -2^-17

#include "shared/stride.glsl"

// Cell of a leaf in normalised coordinates.
struct Room {
    vec3 centre;
    vec3 half_size;
};

uint star[STAR];
uint star_size;

bool in_star(uint t) {
    for (uint i = 0u; i < star_size; ++i) {
        if (star[i] == t) return true;
    }
    return false;
}

// Takes into the star what lies beside `t`, one of it.
void grow_star(uint t, Tet tet, Weights w, vec3 x) {
    vec4 own = own_weights(w, tet);
    uvec4 beside = neighbours.at[t];
    for (uint f = 0u; f < 4u; ++f) {
        uint u = beside[f];
        if (own[f] > w.margin || u == NONE || star_size == STAR || in_star(u)) continue;
        if (near(weights(load_tet(cells.at[u]), x))) star[star_size++] = u;
    }
}

// Looks for the owner in the star of x in `first`.
void arrive(uint first, vec3 x, inout Best best) {
    star[0] = first;
    star_size = 1u;
    for (uint i = 0u; i < star_size; ++i) {
        uint t = star[i];
        Tet tet = load_tet(cells.at[t]);
        Weights w = weights(tet, x);
        consider(best, t, tet, w);
        grow_star(t, tet, w, x);
    }
}

bool settled(Best best) { return best.inside || (best.in_box && best.smallest >= GAP); }

// Part 1, from `t` for at most `most` steps; whether the owner is settled.
bool walk_towards(uint t, vec3 x, uint most, inout Best best) {
    uint arrivals = 0u;
    for (uint s = 0u; s < most; ++s) {
        Tet tet = load_tet(cells.at[t]);
        Weights w = weights(tet, x);
        if (w.clear) {
            best = Best(t, true, true, 0.0);
            break;
        }
        if (near(w)) {
            arrive(t, x, best);
            if (settled(best) || ++arrivals == ARRIVALS) break;
        }
        vec4 own = own_weights(w, tet);
        uint face = outermost(own);
        if (own[face] >= 0.0) break;
        t = neighbours.at[t][face];
        if (t == NONE) break;
    }
    return settled(best);
}

// Straight on from `a`, which lies in `t`, to `b`: where the segment ends.
uint walk_leg(uint t, vec3 a, vec3 b) {
    uint from = NONE;
    for (uint s = 0u; s < LEG; ++s) {
        Tet tet = load_tet(cells.at[t]);
        vec4 before = own_weights(weights(tet, a), tet), behind = own_weights(weights(tet, b), tet);
        uvec4 beside = neighbours.at[t];
        float first = 3.40282347e38;
        uint next = NONE;
        for (uint f = 0u; f < 4u; ++f) {
            if (behind[f] >= 0.0 || beside[f] == from) continue;
            float here = max(before[f], 0.0);
            precise float length = here - behind[f];
            precise float at = here * reciprocal(length);
            if (at < first) {
                first = at;
                next = beside[f];
            }
        }
        if (next == NONE) break;
        from = t;
        t = next;
    }
    return t;
}

// Point number k of the cell, the first its centre.
vec3 room_point(Room room, uint k) {
    vec3 p;
    for (uint c = 0u; c < 3u; ++c) {
        precise float part = float((3u * k + c) * 0x9e3779b9u >> 8) * two_to(-23) - 1.0;
        float away = k == 0u ? 0.0 : part;
        precise float at = room.centre[c] + room.half_size[c] * away;
        precise float whole = floor(at * two_to(42)) * two_to(-42);
        p[c] = whole;
    }
    return p;
}

// Walks to a point x of a cell that is full of mesh, from its seed.
Best walk_from_seed(uint seed, Room room, vec3 x) {
    Best best = no_best();
    if (walk_towards(seed, x, STEPS, best)) return best;
    for (uint k = 0u; k < DETOURS; ++k) {
        vec3 by = room_point(room, k);
        uint t = k == 0u ? seed : walk_leg(seed, room.centre, by);
        arrive(walk_leg(t, by, x), x, best);
        if (settled(best)) break;
    }
    return best;
}
