#version 460
#include "shared/kernel.glsl"
// From a count in device memory to the arguments of an indirect dispatch: one workgroup at least.
ARGUMENTS(2)
    uint count;     // upper limit, whatever the device's count says
    uint per_group; // items that one workgroup takes
    uint skip;      // items that no workgroup takes
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, writeonly, uint, groups) // x, y, z

void main() {
    if (item_index() > 0u) return;
    uint n = min(count, live.at[0]);
    n -= min(n, skip);
    uint g = max(1u, n / per_group + uint(n % per_group != 0u));
    bool fold = g > 65535u;
    groups.at[0] = fold ? 32768u : g;
    groups.at[1] = fold ? (g + 32767u) / 32768u : 1u;
    groups.at[2] = 1u;
}
