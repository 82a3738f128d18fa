#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/voxels.glsl"
// Slicing (SPEC 3.4), between the parts: the voxels whose centre lies in no cell, in no order, so that looking at boxes costs nothing for the others.
// One invocation per 32 voxels. What has been listed is marked, and not listed again; what is settled without it is counted.
ARGUMENTS(4)
    uint voxels;
END_ARGUMENTS
BUFFER(0, READ_WRITE, uint, answers)
BUFFER(1, READ_WRITE, SliceStatus, status)
BUFFER16(2, READ_WRITE, SlicePlan, plans)
BUFFER(3, writeonly, TouchState, states)

void main() {
    uint begin = 32u * item_index(), wait = 0u, inside = 0u, others = 0u;
    // Only once all centres have been located.
    if (begin < voxels && status.at[0].locating == 0u) {
        for (uint k = 0u; k < min(32u, voxels - begin); ++k) {
            uint answer = answers.at[begin + k];
            wait |= uint(answer == SLICE_PENDING) << k;
            inside += uint(answer < SLICE_TOUCHED);
        }
        others = min(32u, voxels - begin) - inside; // empty, unless it turns out that something touches them
    }
    inside = subgroupAdd(inside);
    others = subgroupAdd(others);
    if (subgroupElect()) {
        if (inside > 0u) atomicAdd(status.at[0].inside, inside);
        if (others > 0u) atomicAdd(status.at[0].empty, others);
    }
    uint count = bitCount(wait), total = subgroupAdd(count), before = subgroupExclusiveAdd(count), place = 0u;
    if (subgroupElect() && total > 0u) place = atomicAdd(plans.at[0].listed, total);
    place = subgroupBroadcastFirst(place) + before;
    for (; wait != 0u; wait &= wait - 1u) {
        uint voxel = begin + uint(findLSB(wait));
        answers.at[voxel] = SLICE_LISTED;
        states.at[place++] = TouchState(0u, 0u, NONE, 3.40282347e38, voxel);
    }
}
