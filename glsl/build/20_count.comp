#version 460
// Codes, count: counts the candidates of every tetrahedron, or (IN_SHARES) its shares of up to SHARE candidates, of
// which it has at least one. `counts` has one more element, for the total. Where every tetrahedron has a single
// share, only that total is written, as the one count to be scanned. With CLEAR, the kernel also clears the marks of
// the level, whatever they were.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/share.glsl"
#include "shared/clearing.glsl"
layout(constant_id = 2) const uint IN_SHARES = 0;
layout(constant_id = 3) const uint CLEAR = 0;
ARGUMENTS(7)
    uint tets;
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, vec4, vertices)
RECORDS(2, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, writeonly, uint, counts) // tets + 1
BUFFER(5, writeonly, uint, marks)  // one bit per cell of the level
BUFFER(6, readonly, uint, live)    // number of counts: tets + 1, or 1
#include "shared/cells.glsl"

void main() {
    uint t = item_index();
    Grid g = grid.at[0];
    uint words = CLEAR == 0u ? 0u : cell_words(g.level), all = gl_NumWorkGroups.x * gl_NumWorkGroups.y * WORKGROUP;
    for (uint i = t; i < words; i += all) marks.at[i] = 0u;
    uint all_counts = min(live.at[0], tets + 1u);
    if (t >= all_counts) return;
    uint n = all_counts == 1u ? tets : 0u;
    if (t < tets && all_counts > 1u) {
        uvec3 size = coarser(finest_box(t), g.level).size;
        n = size.x * size.y * size.z;
        if (IN_SHARES != 0u) n = max(n / SHARE + uint(n % SHARE != 0u), 1u);
    }
    counts.at[t] = n;
}
