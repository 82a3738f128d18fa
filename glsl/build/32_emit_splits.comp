#version 460
// Splits, 3 of 3: writes where leaves end (PO) and, for every node of the levels above, its last child (CO), without a
// sort by level. Where a node ends, its last child on the next level ends too, and that child is counted at the same
// moment. CO therefore needs no search, and the paper's CI array of n_m words is not needed.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(7)
    uint capacity;
    uint id_mask; // bits of an entry of P that hold its tetrahedron
    uint slabs;   // not 0: leaves have slabs, behind PO
END_ARGUMENTS
GRID(0, READ_WRITE)
BUFFER(1, readonly, uint, entries)
BUFFER(2, readonly, uint, codes)
BUFFER(3, readonly, uint, places)
BUFFER(4, readonly, BuildStatus, status)
BUFFER(5, writeonly, uint, po)
BUFFER(6, writeonly, uint, co)
#include "shared/splits.glsl"

void main() {
    uint n = min(entries.at[0], capacity);
    uint runs = n / ROWS + uint(n % ROWS != 0u);
    uint run = item_index();
    uint first_leaf = status.at[0].internal;
    if (run == 0u) {
        grid.at[0].first_leaf = first_leaf;
        grid.at[0].ids = grid.at[0].graded == 0u ? id_mask : NONE; // quarters are of cells of equal size
        grid.at[0].slabs = slabs == 0u ? 0u : status.at[0].leaves + 1u;
        po.at[0] = 0u;
        co.at[0] = 0u;
        // A tree that does not fit also has a root, with an empty list.
        if (n == 0u || status.at[0].overflow != 0u) po.at[1] = 0u;
    }
    if (run >= runs || status.at[0].overflow != 0u) return;
    uint level = grid.at[0].level;
    uint first = run * ROWS, end = min(n, first + ROWS);
    // One element more than `levels` of the status: otherwise the optimiser would use the type of that array, layout
    // included.
    uint node[12];
    for (uint k = 0u; k <= level; ++k) node[k] = places.at[k * runs + run];
    uint code = codes.at[first];
    for (uint i = first; i < end; ++i) {
        bool last = i + 1u == n;
        uint next = last ? 0u : codes.at[i + 1u];
        for (uint k = split_level(code, next, level, last); k <= level; ++k) {
            if (k < level) co.at[node[k] + 1u] = node[k + 1u];
            else po.at[node[k] - first_leaf + 1u] = i + 1u;
            node[k] += 1u;
        }
        code = next;
    }
}
