#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/node.glsl"
#include "shared/cell_range.glsl"
#include "shared/separate.glsl"
#include "shared/voxels.glsl"
// Slicing (SPEC 3.4), second part: for voxels whose centre lies in no cell, the boundary primitive that touches the box and is closest to the
// centre. Boundary leaves only, in Morton order. Twin of src/reference/slice.rs.
ARGUMENTS(13)
    uint layer;
    uint first;  // number of the first row in that layer
    uint voxels;
    uint fresh;  // not 0: nothing has been done yet
    uint budget; // nodes and candidates per voxel and dispatch
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER(1, readonly, uint, masks)
BUFFER(2, readonly, uint, co)
BUFFER(3, readonly, uint, po)
BUFFER(4, readonly, uint, p)
BUFFER(5, readonly, uint, flags)
BUFFER(6, readonly, uint, boundary)
BUFFER16(7, readonly, uvec4, cells)
BUFFER16(8, readonly, vec4, vertices)
BUFFER16(9, readonly, SlicePlan, plans)
BUFFER16(10, READ_WRITE, TouchState, states)
BUFFER(11, READ_WRITE, uint, answers)
BUFFER(12, READ_WRITE, SliceStatus, status) // of slice_locate, of this kernel
#include "shared/tree.glsl"
#include "shared/owner_list.glsl"

bool walk_ended = false;
uvec3 lo, hi;

bool enters(Node node) { return is_boundary_node(node.index) && meets_range(node, lo, hi); }
#include "shared/leaf_walk.glsl"

void main() {
    uint i = item_index();
    uint unfinished = 0u;
    // Only once all centres have been located.
    bool waits = status.at[0].unfinished != 0u;
    if (waits && i == 0u) unfinished = 1u;
    if (!waits && i < voxels && answers.at[i] == SLICE_PENDING) {
        SlicePlan plan = plans.at[0];
        Grid g = grid.at[0];
        uint row = i / plan.width;
        uint y = (first + row) % plan.height, k = layer + (first + row) / plan.height;
        vec3 centre = voxel_centre(plan, i - row * plan.width, y, k);
        TouchState state = TouchState(0u, 0u, NONE, 3.40282347e38);
        if (fresh == 0u) state = states.at[i];
        bool done = !reached_cells(g, centre, plan.reach.xyz, lo, hi) || !is_boundary_node(0u);
        if (!done) {
            vec3 x = normalise(g, centre);
            vec3 h[3] = vec3[3](plan.half0.xyz, plan.half1.xyz, plan.half2.xyz);
            LeafWalk at = walk_from(state.code);
            uint leaf = WALK_PAUSED;
            for (uint work = 0u; work < budget;) {
                leaf = next_leaf(at, g.level, work, budget);
                if (leaf >= WALK_PAUSED) break;
                uvec2 range = entry_range(leaf);
                uint from = range.x + state.entry, to = min(range.y, from + max(budget - min(work, budget), 1u));
                for (uint e = from; e < to; ++e) {
                    uint t = p.at[e];
                    if ((boundary.at[t >> 5u] >> (t & 31u) & 1u) == 0u) continue;
                    Tet tet = load_tet(cells.at[t]);
                    vec3 v[4] = vec3[4](difference(tet.v[0], x), difference(tet.v[1], x), difference(tet.v[2], x), difference(tet.v[3], x));
                    if (box_square(v) > state.square || !box_touches(v, h, touch_slack(v, h))) continue;
                    vec4 unused;
                    float square = closest(v, unused);
                    if (square < state.square || (square == state.square && t < state.owner)) {
                        state.square = square;
                        state.owner = t;
                    }
                }
                work += to - from;
                state.entry = to - range.x;
                if (to < range.y) break;
                state.entry = 0u;
                leaf = walk_past(at, g.level, g.level) ? WALK_PAUSED : WALK_DONE;
                if (leaf == WALK_DONE) break;
            }
            done = leaf == WALK_DONE;
            state.code = at.code;
        }
        if (done) {
            answers.at[i] = state.owner == NONE ? NONE : state.owner | SLICE_TOUCHED;
        } else {
            states.at[i] = state;
            unfinished = 1u;
        }
    }
    unfinished = subgroupAdd(unfinished);
    if (subgroupElect() && unfinished > 0u) atomicAdd(status.at[1].unfinished, unfinished);
}
