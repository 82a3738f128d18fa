#version 460
// Ranges of a field, 3 of 3: converts the keys of leaves to floats, and gives every other node the union of its
// children's ranges. Dispatched once per level, from the leaves up to the root, with a barrier between levels. Floats
// are handled as bits throughout, since devices may flush denormals.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/ordered.glsl"
ARGUMENTS(3)
    uint level;
END_ARGUMENTS
BUFFER(0, readonly, BuildStatus, status)
BUFFER(1, readonly, uint, co)
BUFFER(2, READ_WRITE, uint, ranges)

const uint INFINITY = 0x7f800000u;

void main() {
    uint first = level == 0u ? 0u : status.at[0].levels[level - 1u];
    uint node = first + item_index();
    if (level > status.at[0].level || node >= status.at[0].levels[level] || status.at[0].overflow != 0u) return;
    uint lo = 0u, hi = 0u;
    if (level == status.at[0].level) {
        lo = ranges.at[2u * node];
        hi = ranges.at[2u * node + 1u];
    } else {
        for (uint child = co.at[node] + 1u, end = co.at[node + 1u]; child <= end; ++child) {
            lo = max(lo, ~ordered(ranges.at[2u * child]));
            hi = max(hi, ordered(ranges.at[2u * child + 1u]));
        }
    }
    // A node without values gets the empty range from ∞ to −∞, which changes no union.
    ranges.at[2u * node] = hi == 0u ? INFINITY : unordered(~lo);
    ranges.at[2u * node + 1u] = hi == 0u ? INFINITY | 0x80000000u : unordered(hi);
}
