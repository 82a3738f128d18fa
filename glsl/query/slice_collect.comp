#version 460
// Slicing (SPEC 3.4), between the two parts: lists the voxels whose boxes must be tested, in no particular order, so
// that the test costs nothing for the others. An invocation takes one run of voxels. A run is listed once, and its
// voxels that need no test are counted.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/voxels.glsl"
ARGUMENTS(5)
    uint width; // of the rows
    uint height; // of the layers
    uint rows;  // of the band
END_ARGUMENTS
BUFFER(0, readonly, uint, answers)
BUFFER(1, READ_WRITE, SliceStatus, status)
BUFFER16(2, READ_WRITE, SliceUniforms, plans)
BUFFER(3, READ_WRITE, RunState, runs)
BUFFER(4, writeonly, TouchState, states)

void main() {
    uint i = item_index(), count = 0u, inside = 0u, wait = 0u;
    uvec2 lines = rows_of_run(rows, height, i / width);
    // A run is listed only once all centres have been located.
    if (lines.y > 0u && status.at[0].locating == 0u) {
        count = lines.y;
        inside = runs.at[i].inside;
        wait = runs.at[i].waiting;
    }
    uint all_inside = subgroupAdd(inside), others = subgroupAdd(count - inside), total = subgroupAdd(wait), place = 0u;
    if (subgroupElect()) {
        if (all_inside > 0u) atomicAdd(status.at[0].inside, all_inside);
        if (others > 0u) atomicAdd(status.at[0].empty, others); // unless it turns out that something touches them
        if (total > 0u) place = atomicAdd(plans.at[0].listed, total);
    }
    if (total == 0u) return;
    place = subgroupBroadcastFirst(place);
    if (wait > 0u) runs.at[i].waiting = 0u;
    uint line = lines.x * width + i % width;
    // Row by row, since neighbours in a row are near the same tetrahedra.
    for (uint k = 0u; k < VOXEL_RUN; ++k) {
        uint voxel = line + k * width;
        bool waits = wait > 0u && k < count && answers.at[voxel] == SLICE_PENDING;
        uvec4 waiting = subgroupBallot(waits);
        if (waits) states.at[place + subgroupBallotExclusiveBitCount(waiting)] = TouchState(0u, 0u, NONE, 3.40282347e38, voxel);
        place += subgroupBallotBitCount(waiting);
    }
}
