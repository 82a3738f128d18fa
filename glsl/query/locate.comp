#version 460
// Point location (SPEC 3.1). An invocation takes RUN points. It searches for each point first around a given
// tetrahedron: the owner of the point before, or a hint. If that fails, it descends to the point's leaf by child masks,
// and searches the leaf's list or walks. Lists are searched in parts of at most PART_LENGTH entries per dispatch; parts
// after the first use no runs. Between parts, the best candidate is kept in the outputs. Twin of
// src/reference/locate.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/tree_buffers.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
layout(constant_id = 2) const uint GUIDE = 0; // what `guides` holds: 0 (nothing), HINTS or ORDER
layout(constant_id = 3) const uint PART_LENGTH = 16384;
layout(constant_id = 4) const uint LISTS = 0;
layout(constant_id = 5) const uint RUN = 1;
ARGUMENTS(13)
    uint count;
    uint stride; // floats from one point to the next
    uint part;  // number of this dispatch
    uint last;   // not 0: the last part that is recorded
    float tolerance;
END_ARGUMENTS
TREE(0)
RECORDS(6, uvec4, cells)
RECORDS(7, vec4, vertices)
BUFFER(8, readonly, float, points)
BUFFER(9, readonly, uint, guides)
BUFFER(10, READ_WRITE, uint, owners)
BUFFER16(11, READ_WRITE, FLOATS, barycentrics) // between parts: inside, in_box, smallest
RECORDS(12, uvec4, neighbours)
#include "shared/tree.glsl"
#include "shared/owner_list.glsl"
#include "shared/owner_walk.glsl"
#include "shared/points.glsl"

const uint LEAST_PART = 16384u; // most entries of a list whose owner guides the next point, also where parts are longer
const uint HINTS = 1u; // a tetrahedron per point, or NONE
const uint ORDER = 2u; // the number of the point at each place

// A point: its number, and its place in the units of the mesh and in normalised coordinates.
struct Point {
    uint i;
    vec3 at;
    vec3 x;
};

// The point at a place.
Point point_at(Grid g, uint place) {
    uint i = GUIDE == ORDER ? guides.at[place] : place;
    vec3 at = point(i, stride);
    return Point(i, at, normalise(g, at));
}

// Steps of a stride to a point from near it; none to what is not finite, which no comparison must find in a tetrahedron.
uint hinted(Grid g, vec3 at) { return near_bounds(g, at) ? HINTED : 0u; }

void main() {
    uint place = item_index() * RUN;
    if (place >= count) return;
    uint end = place + min(RUN, count - place);
    Grid g = grid.at[0];
    // Who recorded this may not have known how long lists get: all have ended before this part, or end in it.
    if (part > 0u && part * PART_LENGTH >= g.longest) return;
    bool is_last = last != 0u || (part + 1u) * PART_LENGTH >= g.longest;
    Point a = point_at(g, place);
    uint from = NONE; // where the next stride starts
    uint left = 0u;   // steps that this stride may still take; 0: it has ended
    bool in_leaf = part > 0u; // whether this stride started in the point's leaf
    if (GUIDE == HINTS && part == 0u) {
        from = guides.at[a.i];
        left = from == NONE ? 0u : hinted(g, a.at);
    }
    while (place < end) {
        Stand stand = stand_nowhere();
        if (left > 0u) stand = stand_in(from);
        // Point after point, as long as strides succeed. Every pass is an answer or a step, so that invocations do not
        // wait for each other.
        bool at_face = false;
        while (left > 0u && place < end) {
            Sides sides = sides_of(stand, a.x);
            if (sides.clear) {
                owners.at[a.i] = stand.t;
                barycentrics.at[a.i] = record(is_last ? barycentric(stand, sides) : vec4(1.0, 1.0, 0.0, 0.0));
                if (++place < end) a = point_at(g, place);
                left = hinted(g, a.at);
                in_leaf = false;
            } else {
                at_face = sides.near;
                left = !at_face && step_on(stand, sides) ? left - 1u : 0u;
            }
        }
        if (place >= end) break;
        Best best = no_best();
        if (part > 0u) {
            vec4 state = floats(barycentrics.at[a.i]);
            best = Best(owners.at[a.i], state.x != 0.0, state.y != 0.0, state.z);
        }
        if (at_face) {
            uint owner = owner_at_face(stand, a.x);
            if (owner != NONE) best = Best(owner, true, true, 0.0);
        }
        uint leaf = best.inside ? NONE : leaf_to_search(g, a.at, a.x, tolerance);
        uvec2 range = leaf == NONE ? uvec2(0u) : entry_range(leaf);
        bool walks = walks_in(leaf, range);
        if (LISTS != 0u && !in_leaf && range.x < range.y) {
            from = middle_of(range);
            left = STRIDE;
            in_leaf = true;
            continue;
        }
        if (walks && part == 0u) best = walked_through(g, range, a.at, a.x);
        uint begin = min(range.y, range.x + part * PART_LENGTH), behind = min(range.y, begin + PART_LENGTH);
        if (!walks && !best.inside) search(best, begin, behind, sought_at(g, a.at, a.x, tolerance));
        uint owner = best.inside || leaf != NONE ? decide(best, leaf, tolerance) : NONE;
        vec4 b = is_last ? vec4(0.0) : vec4(float(best.inside), float(best.in_box), best.smallest, 0.0);
        if (is_last && owner != NONE) b = barycentric(load_tet(words(cells.at[owner])), a.x);
        owners.at[a.i] = is_last ? owner : best.owner;
        barycentrics.at[a.i] = record(b);
        if (++place < end) {
            a = point_at(g, place);
            // If the list continues in the next part, the owner is not known yet.
            bool known = owner != NONE && (walks || range.y - range.x <= LEAST_PART);
            from = owner;
            left = known ? hinted(g, a.at) : 0u;
            in_leaf = false;
        }
    }
}
