#version 460
// Overlap (SPEC 3.5): marks the points that are vertices of valid tetrahedra.
#include "shared/kernel.glsl"
ARGUMENTS(3)
    uint tets;
END_ARGUMENTS
BUFFER(0, readonly, uint, bad)
RECORDS(1, uvec4, cells)
BUFFER(2, READ_WRITE, uint, used) // one bit per point, zeroed
#include "shared/bad.glsl"

void main() {
    uint t = item_index();
    if (t >= tets || is_bad(t)) return;
    uvec4 ids = words(cells.at[t]);
    for (uint i = 0u; i < 4u; ++i) {
        uint bit = 1u << (ids[i] & 31u);
        // Most bits are set already.
        if ((used.at[ids[i] >> 5u] & bit) == 0u) atomicOr(used.at[ids[i] >> 5u], bit);
    }
}
