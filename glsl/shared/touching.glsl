// Of 32 candidates from `at` on, those whose bit is set and that the tetrahedron touches (SPEC 2.2). Needs cells.glsl
// and assign.glsl.
uint touching(Filter f, CellBox box, uvec3 at, uint bits) {
    uint kept = 0u;
    for (uint bit = 1u; bit != 0u && bit <= bits; bit <<= 1) {
        if ((bits & bit) != 0u && touches(f, at)) kept |= bit;
        at = next_candidate(box, at);
    }
    return kept;
}
