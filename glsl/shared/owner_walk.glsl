// Point location in a leaf without list. Twin of `in_leaf` in src/reference/locate.rs. Needs owner_list.glsl, LISTS and
// neighbours.

#include "shared/centre.glsl"
#include "shared/walk.glsl"

// Whether a leaf is one to walk through: full of mesh, its list left out.
bool walks_in(uint leaf, uvec2 range) { return LISTS != 0u && range.x < range.y && !is_boundary_node(leaf); }

// The owner of x, the normalised point `at`, from a hint (or NONE) or the leaf's seed.
Best walk_in(Grid g, uint seed, uint hint, vec3 at, vec3 x) {
    Best best = no_best();
    if (hint != NONE && walk_towards(hint, x, HINTED, best)) return best;
    Room room;
    room.half_size = half_cell(g, g.level);
    room.centre = cell_centre(room.half_size, quantize(g, at) >> (MAX_LEVEL - g.level));
    return walk_from_seed(seed, room, x);
}
