// Point location by walking (SPEC 2.6). Twin of `walked` in src/reference/locate.rs. Needs owner_list.glsl, LISTS and neighbours.

#include "shared/centre.glsl"
#include "shared/walk.glsl"

// Whether a leaf is one to walk through: full of mesh, its list left out.
bool walks_in(uint leaf, uvec2 range) { return LISTS != 0u && range.x < range.y && !is_boundary_node(leaf); }

// The owner of x, the normalised point `at`, in a leaf with these entries: by a stride from a hint (or NONE) or from the middle of the list; where that
// fails, by a whole walk if the leaf is full of mesh. None, if its list must be searched.
Best walked(Grid g, uint leaf, uvec2 range, uint hint, vec3 at, vec3 x) {
    Best best = no_best();
    if (LISTS == 0u || range.x >= range.y) return best;
    uint t = hint;
    bool found = hint != NONE && stride_to(t, x, HINTED);
    if (!found) {
        t = p.at[range.x + (range.y - range.x) / 2u];
        found = stride_to(t, x, STRIDE);
    }
    if (found) best = Best(t, true, true, 0.0);
    if (!found && !is_boundary_node(leaf)) {
        Room room;
        room.half_size = half_cell(g, g.level);
        room.centre = cell_centre(room.half_size, quantize(g, at) >> (MAX_LEVEL - g.level));
        best = walk_from_seed(p.at[range.x], room, x);
    }
    return best;
}
