// Of 32 candidates of the tree's level from `at` on, those whose bit is set and that the tetrahedron touches (SPEC 2.2).
// Needs cells.glsl and assign.glsl.
uint touching(Tet tet, Grid g, uint assign, CellBox box, uvec3 at, uint bits) {
    Filter f;
    bool made = false;
    uint kept = 0u;
    for (uint bit = 1u; bit != 0u && bit <= bits; bit <<= 1) {
        if ((bits & bit) != 0u) {
            CellShape cell = cell_shape(g, g.level, at);
            if (!made || g.graded != 0u) f = make_filter(tet, g, cell.half_size, assign);
            made = true;
            if (touches(f, cell.centre)) kept |= bit;
        }
        at = next_candidate(box, at);
    }
    return kept;
}
