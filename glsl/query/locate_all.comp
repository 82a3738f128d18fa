#version 460
// Lists every tetrahedron that contains a point, in ascending order, or only the owner where none does (SPEC 3.1). FILL
// 0 counts, FILL 1 writes; both search lists in parts. `owners` are the answers of locate.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/tree_buffers.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
layout(constant_id = 2) const uint FILL = 0;
layout(constant_id = 3) const uint PART_LENGTH = 16384;
layout(constant_id = 4) const uint LISTS = 0;
ARGUMENTS(13)
    uint count;
    uint stride;
    uint part;
    uint capacity; // of `found`
END_ARGUMENTS
TREE(0)
RECORDS(6, uvec4, cells)
RECORDS(7, vec4, vertices)
BUFFER(8, readonly, float, points)
BUFFER(9, readonly, uint, owners)
BUFFER(10, READ_WRITE, uint, places) // FILL 0: counts, zeroed; FILL 1: place of the next tetrahedron found
BUFFER(11, READ_WRITE, uint, found)
RECORDS(12, uvec4, neighbours)
#include "shared/tree.glsl"
#include "shared/owner_list.glsl"
#include "shared/owner_walk.glsl"
#include "shared/points.glsl"

// Writes those tetrahedra of the star of x in `owner` that contain x, from `place` on. Returns their number.
uint list_star(uint owner, vec3 x, uint place) {
    Best unused = no_best();
    arrive(owner, x, unused);
    uint n = 0u;
    for (uint i = 0u; i < star_size; ++i) {
        if (weights(load_tet(words(cells.at[star[i]])), x).inside) star[n++] = star[i];
    }
    uint next = 0u;
    for (uint k = 0u; FILL != 0u && k < n; ++k) {
        uint lowest = NONE;
        for (uint i = 0u; i < n; ++i) {
            if (star[i] >= next) lowest = min(lowest, star[i]);
        }
        if (place + k < capacity) found.at[place + k] = lowest;
        next = lowest + 1u;
    }
    return n;
}

void main() {
    uint i = item_index();
    if (i >= count || owners.at[i] == NONE) return;
    Grid g = grid.at[0];
    if (part > 0u && part * PART_LENGTH >= g.longest) return; // all lists have ended
    vec3 at = point(i, stride);
    vec3 x = normalise(g, at);
    uint leaf = find_leaf(g.level, quantize(g, at));
    Tet own = load_tet(words(cells.at[owners.at[i]]));
    uint place = places.at[i];
    if (!weights(own, x).inside) {
        // No tetrahedron contains the point: its owner is the nearest one.
        if (part == 0u) {
            if (FILL != 0u && place < capacity) found.at[place] = owners.at[i];
            places.at[i] = place + 1u;
        }
        return;
    }
    uvec2 range = entry_range(leaf);
    if (walks_in(leaf, range)) {
        if (part == 0u) places.at[i] = place + list_star(owners.at[i], x, place);
        return;
    }
    uint begin = min(range.y, range.x + part * PART_LENGTH), end = min(range.y, begin + PART_LENGTH);
    Sought sought = sought_at(g, at, x, 0.0);
    for (; begin < end; begin += 32u) {
        for (uint near = near_among(begin, end, sought); near != 0u; near &= near - 1u) {
            uint t = listed_tet(begin + findLSB(near));
            if (!weights(load_tet(words(cells.at[t])), x).inside) continue;
            if (FILL != 0u && place < capacity) found.at[place] = t;
            ++place;
        }
    }
    places.at[i] = place;
}
