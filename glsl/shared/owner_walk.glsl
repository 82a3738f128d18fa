// Point location by walking (SPEC 2.6). Twin of `walked` in src/reference/locate.rs. Needs owner_list.glsl, LISTS and neighbours.

#include "shared/centre.glsl"
#include "shared/walk.glsl"

// Whether a leaf is one to walk through: full of mesh, its list left out.
bool walks_in(uint leaf, uvec2 range) { return LISTS != 0u && range.x < range.y && !is_boundary_node(leaf); }

// Where a stride through a leaf with these entries begins.
uint middle_of(uvec2 range) { return listed_tet(range.x + (range.y - range.x) / 2u); }

// The owner of x, the normalised point `at`, in a leaf that is full of mesh, by a whole walk.
Best walked_through(Grid g, uvec2 range, vec3 at, vec3 x) {
    LeafCell room;
    room.half_size = half_cell(g, g.level);
    room.centre = cell_centre(room.half_size, quantize(g, at) >> (MAX_LEVEL - g.level));
    return walk_from_seed(listed_tet(range.x), room, x);
}

// The owner of x in a leaf with these entries: by a stride from the middle of the list; where that fails, by a whole walk if the leaf is full of mesh. None,
// if its list must be searched.
Best walked(Grid g, uint leaf, uvec2 range, vec3 at, vec3 x) {
    if (LISTS == 0u || range.x >= range.y) return no_best();
    uint t = middle_of(range);
    if (stride_to(t, x, STRIDE)) return Best(t, true, true, 0.0);
    return is_boundary_node(leaf) ? no_best() : walked_through(g, range, at, x);
}
