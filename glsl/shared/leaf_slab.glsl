// Points beside the mesh, as the slabs of the leaves tell. Needs tree.glsl.
#include "shared/slab.glsl"

// The slab of a leaf, if there are slabs.
uint leaf_slab(Grid g, uint leaf) { return po.at[g.slabs + (leaf - g.first_leaf)]; }

// On which side of its leaf's slab x is, in a cell of the finest grid that lies in this leaf. If it is not 0, no
// tetrahedron owns x (for tolerances below 2^-12). `scale` is slab_scale(g).
int side_of_slab(Grid g, vec3 scale, uint leaf, uvec3 finest, vec3 x) {
    return g.slabs == 0u ? 0 : side_of(leaf_slab(g, leaf), slab_cell(g, scale, finest >> (MAX_LEVEL - g.level)), x);
}
