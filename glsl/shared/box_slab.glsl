// Boxes beside slabs. Twin of src/reference/slabs.rs. Needs slab.glsl.

// Whether the box with centre x and half axes h is beside a slab, so that no tetrahedron of the list touches it.
bool is_box_outside(uint slab, SlabCell cell, vec3 x, vec3 h[3]) {
    vec3 n = slab_normal(slab);
    precise vec3 a = h[0] * cell.inverse, b = h[1] * cell.inverse, c = h[2] * cell.inverse;
    precise float reach = (abs(dot_product(n, a)) + abs(dot_product(n, b))) + abs(dot_product(n, c));
    float d = dot_product(n, in_cell(cell, x));
    precise float more = reach + reach * two_to(-16), lo = d - more, hi = d + more;
    return slab_place(hi) < (slab & 255u) || slab_place(lo) > (slab >> 8 & 255u);
}
