#version 460
// Leaves 1, with Lists::All (Alg. 1): sets boundary flags, in parallel over entries, so that a long leaf does not
// become a long loop.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(6)
    uint capacity;
END_ARGUMENTS
BUFFER(0, readonly, uint, entries)
BUFFER(1, readonly, uint, p)
BUFFER(2, readonly, uint, po)
BUFFER(3, readonly, uint, boundary_cells)
BUFFER(4, readonly, BuildStatus, status)
BUFFER(5, READ_WRITE, uint, flags) // zeroed

void set_flag(uint node) { atomicOr(flags.at[node >> 5u], 1u << (node & 31u)); }

void main() {
    uint n = min(entries.at[0], capacity);
    uint first = first_item();
    if (first >= n || status.at[0].overflow != 0u) return;
    uint end = min(n, first + ROWS);
    // The leaf of the first entry is the first leaf that ends after it.
    uint lo = 0u, hi = status.at[0].leaves - 1u;
    while (lo < hi) {
        uint mid = lo + (hi - lo) / 2u;
        if (po.at[mid + 1u] > first) hi = mid;
        else lo = mid + 1u;
    }
    uint leaf = lo, leaf_end = po.at[leaf + 1u], first_leaf = status.at[0].internal;
    bool flag = false;
    for (uint i = first; i < end; ++i) {
        if (i >= leaf_end) {
            if (flag) set_flag(first_leaf + leaf);
            flag = false;
            leaf_end = po.at[++leaf + 1u];
        }
        uint t = p.at[i];
        flag = flag || (boundary_cells.at[t >> 5u] >> (t & 31u) & 1u) != 0u;
    }
    if (flag) set_flag(first_leaf + leaf);
}
