#version 460
// Computes the arguments of an indirect dispatch, of at least one workgroup, from a count in device memory.
#include "shared/kernel.glsl"
ARGUMENTS(2)
    uint count;     // upper limit, whatever the device's count says
    uint per_group; // items that one workgroup takes
    uint skip;      // items that are left out
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, writeonly, uint, groups) // x, y, z
#include "shared/groups.glsl"

void main() {
    if (item_index() > 0u) return;
    uint n = min(count, live.at[0]);
    n -= min(n, skip);
    write_groups(0u, max(n, 1u), per_group);
}
