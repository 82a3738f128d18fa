// The quantized box of a tetrahedron at a level (the paper's Eq. 5). Needs grid.glsl, cells, bad and vertices.
#include "shared/bad.glsl"
#include "shared/spanned.glsl"

struct CellBox {
    uvec3 lo;   // first cell
    uvec3 size; // cells per axis; 0 for a bad tetrahedron
};

CellBox finest_box(uint t) {
    if (is_bad(t)) return CellBox(uvec3(0u), uvec3(0u));
    uvec3 lo, hi;
    cells_spanned(words(cells.at[t]), lo, hi);
    return CellBox(lo, hi - lo + 1u);
}

// The quantized box at a coarser level.
CellBox coarser(CellBox finest, uint level) {
    if (finest.size.x == 0u) return finest;
    uint shift = MAX_LEVEL - level;
    CellBox box;
    box.lo = finest.lo >> shift;
    box.size = ((finest.lo + finest.size - 1u) >> shift) - box.lo + 1u;
    return box;
}

// Candidate number i of a box, x fastest.
uvec3 candidate(CellBox box, uint i) {
    uint row = box.size.x, slab = box.size.x * box.size.y;
    uint z = i / slab, rest = i - z * slab, y = rest / row;
    return box.lo + uvec3(rest - y * row, y, z);
}

// The candidate after `at`, without the divisions above.
uvec3 next_candidate(CellBox box, uvec3 at) {
    at.x += 1u;
    bool row = at.x == box.lo.x + box.size.x;
    at.x = row ? box.lo.x : at.x;
    at.y += uint(row);
    bool slab = at.y == box.lo.y + box.size.y;
    at.y = slab ? box.lo.y : at.y;
    at.z += uint(slab);
    return at;
}
