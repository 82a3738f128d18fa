#version 460
// Splits, 1 of 3: counts how many nodes end on each level in every run of ROWS codes: counts[level * runs + run].
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(4)
    uint capacity;
END_ARGUMENTS
GRID(0, readonly)
BUFFER(1, readonly, uint, entries)
BUFFER(2, readonly, uint, codes)
BUFFER(3, writeonly, uint, counts)
#include "shared/splits.glsl"

void main() {
    uint n = min(entries.at[0], capacity);
    uint runs = n / ROWS + uint(n % ROWS != 0u);
    uint run = item_index();
    if (run >= runs) return;
    uint level = grid.at[0].level;
    uint first = run * ROWS, end = min(n, first + ROWS);
    uint at_level[12];
    for (uint k = 0u; k < 12u; ++k) at_level[k] = 0u;
    uint code = codes.at[first];
    for (uint i = first; i < end; ++i) {
        bool last = i + 1u == n;
        uint next = last ? 0u : codes.at[i + 1u];
        at_level[split_level(code, next, level, last)] += 1u;
        code = next;
    }
    uint sum = 0u;
    for (uint k = 0u; k <= level; ++k) {
        sum += at_level[k]; // a split also ends a node on every deeper level
        counts.at[k * runs + run] = sum;
    }
}
