#version 460
// Overlap (SPEC 3.5): finds all pairs that touch. FILL 0 counts them, FILL 1 writes them after the scanned counts,
// except those beyond the capacity. Twin of src/reference/overlap.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/node.glsl"
#include "shared/cell_range.glsl"
#include "shared/separate.glsl"
#include "shared/overlap.glsl"
layout(constant_id = 5) const uint FILL = 0;
ARGUMENTS(15)
    uint tets;
    uint capacity; // pairs that `found` holds
END_ARGUMENTS
GRID(0, readonly) // of the other mesh, like all up to `positions`
BUFFER(1, readonly, uint, masks)
BUFFER(2, readonly, uint, co)
BUFFER(3, readonly, uint, po)
BUFFER(4, readonly, uint, p)
RECORDS(5, uvec4, cells)
BUFFER(6, readonly, float, positions)
RECORDS(7, uvec4, own_cells)
BUFFER(8, readonly, float, own_positions)
BUFFER(9, readonly, uint, bad)
BUFFER16(10, readonly, NodeFrame, frame)
BUFFER16(11, READ_WRITE, SearchState, states) // zeroed
BUFFER(12, READ_WRITE, uint, places) // FILL 0: counts; FILL 1: where the pairs of a tetrahedron start
BUFFER(13, writeonly, uvec2, found)
BUFFER(14, READ_WRITE, OverlapStatus, status)
#include "shared/bad.glsl"
#include "shared/tree.glsl"
#include "shared/overlap_tets.glsl"
#include "shared/overlap_leaf.glsl"

bool walk_ended = false;
uvec3 lo, hi;

bool enters(Node node) { return true; }
#include "shared/quarters.glsl"
#include "shared/leaf_walk.glsl"

void main() {
    uint t = item_index();
    uint unfinished = 0u, narrow = 0u, pairs = 0u;
    SearchState state = SearchState(NONE, 0u, 0u, 0u);
    // Nothing is written before all pairs are counted, or if their number does not fit into 32 bits.
    bool waits = FILL != 0u && status.at[0].unfinished != 0u;
    if (waits && t == 0u) unfinished = 1u;
    if (t < tets && !waits && (FILL == 0u || status.at[0].pairs[1] == 0u)) {
        state = states.at[t];
        if (FILL == 0u && state.phase != 0u) state.code = NONE;
        if (FILL != 0u && state.phase == 0u) state = SearchState(0u, 0u, 1u, 0u);
    }
    if (state.code != NONE) {
        Grid g = grid.at[0];
        joint = g;
        joint.lo = frame.at[0].joint_lo;
        joint.scale = frame.at[0].scale;
        bool done = status.at[0].empty != 0u || is_bad(t);
        RawTet own;
        if (!done) {
            own = own_tet(t);
            done = !boxes_meet(own.lo, own.hi, g.lo.xyz, g.hi.xyz);
        }
        if (!done) {
            vec3 v[4];
            to_joint(own, v);
            lo = quantize(g, own.lo);
            hi = quantize(g, own.hi);
            LeafWalk at = walk_from(g.level, state.code);
            uint leaf = WALK_PAUSED;
            for (uint work = 0u; work < BUDGET;) {
                leaf = next_leaf(at, g.level, work, BUDGET);
                if (leaf >= WALK_PAUSED) break;
                uvec2 range = entry_range(leaf);
                uint begin = range.x + state.entry, end = min(range.y, begin + max(BUDGET - min(work, BUDGET), 1u));
                for (uint e = begin; e < end; ++e) {
                    uint b = listed_tet(e);
                    RawTet other = other_tet(b);
                    if (!compared_in(g, at.code, own, other)) continue;
                    vec3 w[4];
                    to_joint(other, w);
                    ++narrow;
                    if (!tets_touch(v, w)) continue;
                    ++pairs;
                    if (FILL != 0u) {
                        uint place = places.at[t] + state.place;
                        if (place < capacity) found.at[place] = uvec2(t, b);
                    }
                    ++state.place;
                }
                work += end - begin;
                state.entry = end - range.x;
                if (end < range.y) break;
                state.entry = 0u;
                leaf = walk_past(at, g.level, g.level) ? WALK_PAUSED : WALK_DONE;
                if (leaf == WALK_DONE) break;
            }
            state.code = at.code;
            done = leaf == WALK_DONE;
        }
        if (done) {
            state.code = NONE;
            if (FILL == 0u) places.at[t] = state.place;
        }
        states.at[t] = state;
        unfinished = uint(!done);
    }
    unfinished = subgroupAdd(unfinished);
    if (subgroupElect()) {
        if (FILL == 0u && unfinished > 0u) atomicAdd(status.at[0].unfinished, unfinished);
        if (FILL != 0u && unfinished > 0u) atomicAdd(status.at[0].unfilled, unfinished);
    }
    if (FILL == 0u) {
        ADD_TO_COUNTER(status.at[0].narrow, narrow)
        ADD_TO_COUNTER(status.at[0].pairs, pairs)
    }
}
