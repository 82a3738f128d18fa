// Point location by walking (SPEC 2.6). Twin of `walked` in src/reference/locate.rs. Needs owner_list.glsl, LISTS and
// neighbours.

#include "shared/centre.glsl"
#include "shared/walk.glsl"

// Whether a leaf is searched by walking: it is full of mesh and has a seed instead of a list.
bool walks_in(uint leaf, uvec2 range) { return LISTS != 0u && range.x < range.y && !is_boundary_node(leaf); }

// The tetrahedron where a stride through a leaf with these entries starts.
uint middle_of(uvec2 range) { return listed_tet(range.x + (range.y - range.x) / 2u); }

// The owner of the point `at`, x in normalised coordinates, in a leaf that is full of mesh, found by a whole walk.
Best walked_through(Grid g, uvec2 range, vec3 at, vec3 x) {
    uvec3 cell = quantize(g, at) >> (MAX_LEVEL - g.level);
    return walk_from_seed(listed_tet(range.x), cell_shape(g, g.level, cell), x);
}

// The owner of x in a leaf with these entries, found by a stride from the middle of the list or, if that fails and the
// leaf is full of mesh, by a whole walk. Without an owner, the list must be searched.
Best walked(Grid g, uint leaf, uvec2 range, vec3 at, vec3 x) {
    if (LISTS == 0u || range.x >= range.y) return no_best();
    uint t = middle_of(range);
    if (stride_to(t, x, STRIDE)) return Best(t, true, true, 0.0);
    return is_boundary_node(leaf) ? no_best() : walked_through(g, range, at, x);
}
