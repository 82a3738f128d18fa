// A box of cells of the finest grid, given by its first and its last cell as packed words: the part of the grid that is
// processed where a mesh is taken in blocks. Needs grid.glsl.

bool in_part(uint first, uint last, uvec3 q) {
    return all(lessThanEqual(unpack_cell(first), q)) && all(lessThanEqual(q, unpack_cell(last)));
}
