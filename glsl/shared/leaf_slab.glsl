// Points beside the mesh, as the slabs of the leaves tell. Needs tree.glsl.
#include "shared/slab.glsl"

// On which side of its leaf's slab x is, in a cell of the finest grid that lies in this leaf. If it is not 0, no
// tetrahedron owns x (for tolerances below 2^-12). `scale` is slab_scale(g).
int side_of_slab(Grid g, vec3 scale, uint leaf, uvec3 finest, vec3 x) {
    if (g.slabs == 0u) return 0;
    uint slab = po.at[g.slabs + (leaf - g.first_leaf)];
    return side_of(slab, slab_cell(g, scale, finest >> (MAX_LEVEL - g.level)), x);
}
