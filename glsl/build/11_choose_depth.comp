#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
// Depth, 2 of 2 (SPEC 2.4): the largest level that the mean estimate allows (Eq. 12, in integers) and whose entries fit.
ARGUMENTS(4)
    uint tets;
    uint alpha;    // in units of 1/65536
    uint capacity; // most entries
    uint deepest;  // most levels
END_ARGUMENTS
BUFFER(0, readonly, MeshStatus, mesh)
BUFFER16(1, READ_WRITE, Grid, grid)
BUFFER(2, READ_WRITE, BuildStatus, status)
BUFFER(3, writeonly, uint, candidates) // word for the scans: entries of Aabb at the chosen level

bool less_equal(uvec2 a, uvec2 b) { return a.y < b.y || (a.y == b.y && a.x <= b.x); } // low word first

void main() {
    if (item_index() > 0u) return;
    uint valid = tets - mesh.at[0].bad;
    uvec2 sum = uvec2(status.at[0].sum[0], status.at[0].sum[1]);
    uvec2 scaled = uvec2(sum.x << 16, sum.y << 16 | sum.x >> 16);
    // level >= k while sum * 65536 <= valid * ((10.5 - k) * 65536 - alpha)
    uint level = 0u;
    for (uint k = 1u; valid > 0u && k <= MAX_LEVEL; ++k) {
        int threshold = int((21u - 2u * k) << 15) - int(alpha);
        if (threshold < 0) break;
        uvec2 bound;
        umulExtended(valid, uint(threshold), bound.y, bound.x);
        if (less_equal(scaled, bound)) level = k;
    }
    status.at[0].heuristic_level = level;
    level = min(level, deepest);
    while (level > 0u && !less_equal(uvec2(status.at[0].total[2u * level], status.at[0].total[2u * level + 1u]), uvec2(capacity, 0u))) level -= 1u;
    if (!less_equal(uvec2(status.at[0].total[2u * level], status.at[0].total[2u * level + 1u]), uvec2(capacity, 0u))) status.at[0].overflow = 1u;
    uint n = status.at[0].overflow != 0u ? 0u : status.at[0].total[2u * level];
    status.at[0].level = level;
    status.at[0].candidates = n;
    grid.at[0].level = level;
    candidates.at[0] = n;
}
