#version 460
// Sum, minimum or maximum of u32 values. The first pass writes one partial result per workgroup; the second pass is one
// workgroup over the partial results.
#include "shared/kernel.glsl"
#include "shared/workgroup.glsl"
layout(constant_id = 2) const uint OPERATION = 0; // 0 add, 1 min, 2 max
ARGUMENTS(3)
    uint count;
    uint groups; // workgroups of this pass; each takes every groups-th tile
END_ARGUMENTS
BUFFER(0, readonly, uint, live)
BUFFER(1, readonly, uint, values)
BUFFER(2, writeonly, uint, partial)

// The minimum is the complement of the maximum of the complements.
void main() {
    uint n = min(count, live.at[0]);
    uint flip = OPERATION == 1u ? NONE : 0u;
    uint r = 0u;
    uint stride = groups * WORKGROUP;
    for (uint i = item_index(); i < n; i += stride) {
        uint v = values.at[i] ^ flip;
        r = OPERATION == 0u ? r + v : max(r, v);
        if (i + stride < i) break;
    }
    r = OPERATION == 0u ? workgroup_add(r) : workgroup_max(r);
    if (local_index() == 0u) partial.at[group_index()] = r ^ flip;
}
