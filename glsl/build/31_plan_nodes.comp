#version 460
// Splits, 2 of 3, before and after their scan: plans the nodes. STAGE 0 computes the length of the table of splits from
// the number of entries. STAGE 1 computes NO and the dispatches over the leaves and over the nodes of each level from the
// scanned table.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
layout(constant_id = 2) const uint STAGE = 0;
layout(constant_id = 3) const uint EACH = 64; // items per workgroup of the dispatches planned here
ARGUMENTS(7)
    uint capacity; // most entries
    uint nodes;    // capacity of the node arrays
    uint run;      // codes per run
END_ARGUMENTS
GRID(0, readonly)
BUFFER(1, readonly, uint, entries)
BUFFER(2, readonly, uint, places)          // scanned table of splits
BUFFER(3, writeonly, uint, table_length)   // length of the table of splits
BUFFER(4, READ_WRITE, BuildStatus, status)
BUFFER(5, writeonly, uint, groups)         // x, y, z: per level 0…10, then the leaves
BUFFER(6, readonly, uint, node_total)      // total of the table's scan
#include "shared/groups.glsl"

void main() {
    if (item_index() > 0u) return;
    uint n = min(entries.at[0], capacity);
    uint level = grid.at[0].level;
    uint runs = n / run + uint(n % run != 0u);
    if (STAGE == 0u) {
        table_length.at[0] = (level + 1u) * runs;
        if (n < entries.at[0]) status.at[0].overflow = 1u;
        status.at[0].entries = status.at[0].overflow != 0u ? 0u : n;
        return;
    }
    bool empty = n == 0u;
    uint total = empty ? 1u : node_total.at[0];
    if (total > nodes || status.at[0].overflow != 0u) {
        status.at[0].overflow = 1u;
        total = 0u;
        level = 0u;
    }
    uint before = 0u;
    for (uint k = 0u; k <= MAX_LEVEL; ++k) {
        uint through = k >= level ? total : empty ? 1u : places.at[(k + 1u) * runs];
        if (total == 0u) through = 0u;
        status.at[0].levels[k] = through;
        write_groups(k, k < level ? through - before : 0u, EACH);
        if (k == level) {
            status.at[0].leaves = through - before;
            status.at[0].internal = before;
            write_groups(MAX_LEVEL + 1u, through - before, EACH);
        }
        before = through;
    }
    status.at[0].nodes = total;
}
