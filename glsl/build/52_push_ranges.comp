#version 460
// Ranges of a field, 2 of 3: adds the ranges of the nodes of a level to those of their children. Dispatched once per
// level, from the root down to the level above the leaves, with a barrier between levels.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
ARGUMENTS(3)
    uint level;
END_ARGUMENTS
BUFFER(0, readonly, BuildStatus, status)
BUFFER(1, readonly, uint, co)
BUFFER(2, READ_WRITE, uint, ranges)

void main() {
    uint first = level == 0u ? 0u : status.at[0].levels[level - 1u];
    uint node = first + item_index();
    if (level >= status.at[0].level || node >= status.at[0].levels[level] || status.at[0].overflow != 0u) return;
    uint lo = ranges.at[2u * node], hi = ranges.at[2u * node + 1u];
    if ((lo | hi) == 0u) return;
    for (uint child = co.at[node] + 1u, end = co.at[node + 1u]; child <= end; ++child) {
        ranges.at[2u * child] = max(ranges.at[2u * child], lo);
        ranges.at[2u * child + 1u] = max(ranges.at[2u * child + 1u], hi);
    }
}
