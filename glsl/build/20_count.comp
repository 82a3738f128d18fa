#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
// Codes, 1 of 2: cells in the quantized box of every tetrahedron, or shares of up to SHARE of them, one at least; one more element for the total.
layout(constant_id = 2) const uint SHARE = 1;
ARGUMENTS(5)
    uint tets;
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER16(1, readonly, uvec4, quantized)
BUFFER16(2, readonly, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, writeonly, uint, counts) // tets + 1
#include "shared/cells.glsl"

void main() {
    uint t = item_index();
    if (t > tets) return;
    uint n = 0u;
    if (t < tets) {
        Grid g = grid.at[0];
        uvec3 size = coarser(finest_box(t), g.level).size;
        n = size.x * size.y * size.z;
        if (SHARE > 1u) n = max(n / SHARE + uint(n % SHARE != 0u), 1u);
    }
    counts.at[t] = n;
}
