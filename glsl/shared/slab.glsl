// Slabs: two parallel planes per leaf between which all tetrahedra of its list lie. Twin of src/reference/slabs.rs, which
// explains them; the operations and their order are the same. Needs grid.glsl and tet.glsl.
#include "shared/centre.glsl"

const uint EVERYTHING = 0xff00u; // A slab that contains every point.

// The coordinates in a leaf's cell that slabs are given in.
struct SlabCell {
    vec3 centre;
    vec3 inverse;
};

// Reciprocals of the half sizes of a leaf's cell (leaves of a graded grid have no slabs), 0 on axes that normalised coordinates are too coarse for.
vec3 slab_scale(Grid g) {
    vec3 h = half_cell(g, g.level), r;
    for (uint c = 0u; c < 3u; ++c) r[c] = g.extent[c] < two_to(-30) ? 0.0 : reciprocal(h[c]);
    return r;
}

SlabCell slab_cell(Grid g, vec3 scale, uvec3 cell) { return SlabCell(cell_centre(half_cell(g, g.level), cell), scale); }

vec3 in_cell(SlabCell cell, vec3 x) {
    precise vec3 y = (x - cell.centre) * cell.inverse;
    return y;
}

// The place of a plane or a point at distance d.
uint slab_place(float d) {
    precise float at = d * 42.0 + 127.5;
    return whole_of(clamp(at, 0.0, 255.0));
}

// The normal of a slab, whose largest component is 1.
vec3 slab_normal(uint slab) {
    float u = (float(slab >> 16 & 127u) - 64.0) * two_to(-6), v = (float(slab >> 23 & 127u) - 64.0) * two_to(-6);
    uint axis = slab >> 30;
    return axis == 0u ? vec3(1.0, u, v) : axis == 1u ? vec3(v, 1.0, u) : vec3(u, v, 1.0);
}

// On which side of a slab a point is: -1 below, 1 above, 0 within.
int side_of(uint slab, SlabCell cell, vec3 x) {
    uint at = slab_place(dot_product(slab_normal(slab), in_cell(cell, x)));
    return at < (slab & 255u) ? -1 : at > (slab >> 8 & 255u) ? 1 : 0;
}
