#version 460
// Codes, filter 4, where counts stay on the device: checks whether the entries that the filter kept fit. If they do
// not, the next coarser level is counted and filtered, or, in the last attempt, a level whose entries are sure to fit.
// Such an attempt lies between every two dispatches of this kernel; its dispatches are empty once the entries fit.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/clearing.glsl"
layout(constant_id = 2) const uint EACH = 64; // items per workgroup of those dispatches
ARGUMENTS(8)
    uint tets;
    uint capacity; // most entries
    uint first;    // not 0: no attempt has been made yet
    uint last;     // not 0: the attempt that follows is the last one
END_ARGUMENTS
GRID(0, READ_WRITE)
BUFFER(1, READ_WRITE, BuildStatus, status)
BUFFER(2, writeonly, uint, shares)  // number of shares at the level that was filtered last
BUFFER(3, READ_WRITE, uint, entries) // number of entries at that level
BUFFER(4, readonly, uint, tried_shares) // number of shares of the attempt
BUFFER(5, readonly, uint, tried_entries) // number of entries of the attempt
BUFFER(6, READ_WRITE, uint, live)   // tets + 1 if there is an attempt, else 0
// Workgroups (x, y, z) of three dispatches: over tets + 1 items and over words of marks, over words of one bit per
// tetrahedron, over tetrahedra.
BUFFER(7, writeonly, uint, groups)
#include "shared/groups.glsl"

// Whether the candidates of a level fit, which are never fewer than its entries.
bool surely_fits(uint level) { return status.at[0].total[2u * level] <= capacity && status.at[0].total[2u * level + 1u] == 0u; }

void main() {
    if (item_index() > 0u) return;
    bool filtered = first != 0u || live.at[0] > 0u;
    if (first == 0u && filtered) {
        shares.at[0] = tried_shares.at[0];
        entries.at[0] = tried_entries.at[0];
    }
    uint level = grid.at[0].level;
    bool again = filtered && entries.at[0] > capacity && level > 0u;
    if (again) {
        --level;
        while (last != 0u && level > 0u && !surely_fits(level)) --level;
        grid.at[0].level = level;
        status.at[0].level = level;
        status.at[0].candidates = status.at[0].total[2u * level];
    }
    uint n = again ? tets : 0u;
    live.at[0] = again ? tets + 1u : 0u;
    // Marks are cleared by the same dispatch.
    write_groups(0u, again ? max(tets + 1u, clearing_items(level)) : 0u, EACH);
    write_groups(1u, (n + 31u) / 32u, EACH);
    write_groups(2u, n, EACH);
}
