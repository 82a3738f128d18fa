#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/structure.glsl"
#include "shared/voxels.glsl"
// Slicing (SPEC 3.4), first part: which cell the centre of each voxel lies in. An invocation takes a run of voxels of a row, and looks for each in the
// cell of the one before and a short walk across faces from it, before it asks the structure. Twin of src/reference/slice.rs.
layout(constant_id = 2) const uint RUN = 32;
layout(constant_id = 3) const uint WALK = 6;
layout(constant_id = 5) const uint PART = 0; // centres in other cells than the plan's belong to another block
ARGUMENTS(8 + STRUCTURE_BUFFERS)
    uint layer;
    uint first;  // number of the first row in that layer
    uint rows;
    uint fresh;  // not 0: nothing has been done yet
    uint budget; // candidates tested per run and dispatch, roughly
    float tolerance;
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
RECORDS(1, uvec4, cells)
RECORDS(2, vec4, vertices)
BUFFER16(3, readonly, uvec4, neighbours)
BUFFER16(4, readonly, SlicePlan, plans)
BUFFER(5, READ_WRITE, RunState, states)
BUFFER(6, writeonly, uint, answers) // owner, or SLICE_PENDING
BUFFER(7, READ_WRITE, SliceStatus, status) // zeroed
STRUCTURE(8)
#include "shared/structure_owner.glsl"
#include "shared/part.glsl"

bool is_ours(SlicePlan plan, Grid g, vec3 at) { return PART == 0u || in_part(plan.first_cell, plan.last_cell, quantize(g, at)); }

void main() {
    uint i = item_index();
    uint unfinished = 0u;
    SlicePlan plan = plans.at[0];
    uint runs = (plan.width + RUN - 1u) / RUN;
    if (i == 0u) status.at[0].refused = plan.refused;
    if (i < rows * runs) {
        Grid g = grid.at[0];
        RunState state = RunState(0u, NONE, 0u, NONE, 0u, SMALLEST_FLOAT, 0u, 0u);
        if (fresh == 0u) state = states.at[i];
        uint row = i / runs, begin = (i - row * runs) * RUN, count = min(RUN, plan.width - begin);
        uint y = (first + row) % plan.height, k = layer + (first + row) / plan.height;
        uint line = row * plan.width + begin;
        for (; plan.refused != 0u && state.next < count; ++state.next) answers.at[line + state.next] = NONE;
        bool stands = state.hint != NONE && state.cursor == 0u;
        Stand stand = stand_nowhere();
        if (stands) stand = stand_in(state.hint);
        for (uint work = 0u; state.next < count && work < budget; ++work) {
            // As far as strides lead: voxel after voxel without a look at the structure, mostly without a look at another cell.
            uint misses = 0u;
            for (; stands && state.next < count && work < budget; ++work) {
                vec3 at = voxel_centre(plan, begin + state.next, y, k);
                if (!is_ours(plan, g, at)) break;
                vec3 x = normalise(g, at);
                Sides sides = sides_of(stand, x);
                uint owner = owner_of(stand, sides, x);
                if (owner != NONE) {
                    if (owner != stand.t) stand = stand_in(owner);
                    state.hint = owner;
                    answers.at[line + state.next] = owner;
                    ++state.next;
                    misses = 0u;
                } else {
                    stands = !sides.near && ++misses < WALK && step_on(stand, sides);
                }
            }
            if (state.next >= count || work >= budget) break;
            vec3 at = voxel_centre(plan, begin + state.next, y, k);
            if (!is_ours(plan, g, at)) {
                answers.at[line + state.next] = SLICE_PENDING;
                ++state.next;
                continue;
            }
            OwnerSearch search = OwnerSearch(state.cursor, best_of(state.best, state.in_box, state.smallest));
            uint owner;
            bool ended = find_owner(search, g, at, normalise(g, at), tolerance, work, budget, owner);
            state.cursor = search.cursor;
            state.best = search.best.owner;
            state.in_box = best_bits(search.best);
            state.smallest = search.best.smallest;
            if (!ended) break;
            state.hint = owner;
            answers.at[line + state.next] = owner == NONE ? SLICE_PENDING : owner;
            ++state.next;
            stands = owner != NONE;
            if (stands) stand = stand_in(owner);
        }
        unfinished = uint(state.next < count);
        states.at[i] = state;
    }
    unfinished = subgroupAdd(unfinished);
    if (subgroupElect() && unfinished > 0u) atomicAdd(status.at[0].locating, unfinished);
}
