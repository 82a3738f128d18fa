#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/voxels.glsl"
// Slicing (SPEC 3.4), first part: which cell the centre of each voxel lies in. An invocation takes a run of voxels of a row, and looks for each in the
// cell of the one before and a short walk across faces from it, before it asks the tree. Twin of src/reference/slice.rs.
layout(constant_id = 2) const uint RUN = 32;
layout(constant_id = 3) const uint WALK = 6;
layout(constant_id = 4) const uint LISTS = 0;
ARGUMENTS(13)
    uint layer;
    uint first;  // number of the first row in that layer
    uint rows;
    uint fresh;  // not 0: nothing has been done yet
    uint budget; // candidates tested per run and dispatch, roughly
    float tolerance;
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER(1, readonly, uint, masks)
BUFFER(2, readonly, uint, co)
BUFFER(3, readonly, uint, po)
BUFFER(4, readonly, uint, p)
BUFFER(5, readonly, uint, flags)
BUFFER16(6, readonly, uvec4, cells)
BUFFER16(7, readonly, vec4, vertices)
BUFFER16(8, readonly, uvec4, neighbours)
BUFFER16(9, readonly, SlicePlan, plans)
BUFFER(10, READ_WRITE, RunState, states)
BUFFER(11, writeonly, uint, answers) // owner, or SLICE_PENDING
BUFFER(12, READ_WRITE, SliceStatus, status)
#include "shared/tree.glsl"
#include "shared/owner_list.glsl"
#include "shared/owner_walk.glsl"

// The cell that holds x clearly, if it is `cell` or a short walk away from it.
uint walk_clear(uint cell, vec3 x) {
    for (uint s = 0u; s < WALK && cell != NONE; ++s) {
        Tet tet = load_tet(cells.at[cell]);
        Weights w = weights(tet, x);
        if (w.clear) return cell;
        vec4 own = own_weights(w, tet);
        uint face = 0u;
        for (uint f = 1u; f < 4u; ++f) face = own[f] < own[face] ? f : face;
        if (own[face] >= 0.0) return NONE;
        cell = neighbours.at[cell][face];
    }
    return NONE;
}

void main() {
    uint i = item_index();
    uint unfinished = 0u;
    SlicePlan plan = plans.at[0];
    uint runs = (plan.width + RUN - 1u) / RUN;
    if (i < rows * runs) {
        Grid g = grid.at[0];
        RunState state = RunState(0u, NONE, 0u, NONE, 0u, SMALLEST_FLOAT, 0u, 0u);
        if (fresh == 0u) state = states.at[i];
        uint row = i / runs, begin = (i - row * runs) * RUN, count = min(RUN, plan.width - begin);
        uint y = (first + row) % plan.height, k = layer + (first + row) / plan.height;
        for (uint work = 0u; state.next < count && work < budget; ++work) {
            vec3 at = voxel_centre(plan, begin + state.next, y, k);
            uint owner = NONE;
            if (near_bounds(g, at)) {
                vec3 x = normalise(g, at);
                if (state.cursor == 0u) owner = walk_clear(state.hint, x);
                uint leaf = owner == NONE ? find_leaf(g.level, quantize(g, at)) : NONE;
                if (leaf != NONE) {
                    uvec2 range = entry_range(leaf);
                    Best best = Best(state.best, false, state.in_box != 0u, state.smallest);
                    uint from = range.x + state.cursor;
                    uint to = min(range.y, from + max(budget - min(work, budget), 1u));
                    if (walks_in(leaf, range)) best = walk_in(g, p.at[range.x], NONE, at, x);
                    else search(best, from, to, x);
                    work += to - from;
                    if (!best.inside && to < range.y) {
                        state.cursor = to - range.x;
                        state.best = best.owner;
                        state.in_box = uint(best.in_box);
                        state.smallest = best.smallest;
                        break;
                    }
                    owner = decide(best, leaf, tolerance);
                    state.cursor = 0u;
                    state.best = NONE;
                    state.in_box = 0u;
                    state.smallest = SMALLEST_FLOAT;
                }
            }
            state.hint = owner;
            answers.at[row * plan.width + begin + state.next] = owner == NONE ? SLICE_PENDING : owner;
            ++state.next;
        }
        unfinished = uint(state.next < count);
        states.at[i] = state;
    }
    unfinished = subgroupAdd(unfinished);
    if (subgroupElect() && unfinished > 0u) atomicAdd(status.at[0].unfinished, unfinished);
}
