#version 460
// Overlap (SPEC 3.5), steps 2 and 3: every tetrahedron that no vertex has decided descends the other tree, first to its
// non-boundary nodes, then to the lists of boundary leaves. Twin of src/reference/overlap.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/tree_buffers.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/node.glsl"
#include "shared/cell_range.glsl"
#include "shared/separate.glsl"
#include "shared/overlap.glsl"
ARGUMENTS(15)
    uint most; // length of `waiting`
END_ARGUMENTS
TREE(0) // of the other mesh, like all up to `positions`
RECORDS(6, uvec4, cells)
BUFFER(7, readonly, float, positions)
RECORDS(8, uvec4, own_cells)
BUFFER(9, readonly, float, own_positions)
BUFFER16(10, readonly, NodeFrame, frame)
BUFFER(11, readonly, uint, waiting)
BUFFER16(12, READ_WRITE, SearchState, states) // zeroed
BUFFER(13, READ_WRITE, uint, hits)
BUFFER(14, READ_WRITE, OverlapStatus, status)
#include "shared/tree.glsl"
#include "shared/boundary_node.glsl"
#include "shared/overlap_tets.glsl"
#include "shared/overlap_leaf.glsl"

bool walk_ended = false;
Grid g;
uvec3 lo, hi;
vec3 v[4]; // of the tetrahedron, in the joint frame
uint phase;

bool touches_node(Node node) {
    NodeFrame f = frame.at[0];
    float part = two_to(-int(node.level));
    precise vec3 scaled = f.half_size.xyz * part;
    vec3 size = vec3(f.flat_axis.x == 0.0 ? scaled.x : f.half_size.x, f.flat_axis.y == 0.0 ? scaled.y : f.half_size.y,
                     f.flat_axis.z == 0.0 ? scaled.z : f.half_size.z);
    uvec3 cell = unmorton(node.code);
    precise vec3 away = vec3(2u * cell + 1u) * size;
    if (g.graded != 0u) {
        uint shift = MAX_LEVEL - node.level;
        vec3 lower = graded_sides(cell << shift), upper = graded_sides((cell + 1u) << shift);
        precise float unit = f.scale * two_to(39);
        precise vec3 length = (upper - lower) * unit, twice = (upper + lower) * unit;
        bvec3 is_flat = notEqual(f.flat_axis.xyz, vec3(0.0));
        size = mix(length, size, is_flat);
        away = mix(twice, away, is_flat);
    }
    precise vec3 at = f.corner.xyz + away;
    precise vec3 centre = floor(at * two_to(42)) * two_to(-42);
    precise vec3 h = size + two_to(18);
    vec3 around[4] = vec3[4](difference(v[0], centre), difference(v[1], centre), difference(v[2], centre), difference(v[3], centre));
    return box_touches(around, vec3[3](vec3(h.x, 0.0, 0.0), vec3(0.0, h.y, 0.0), vec3(0.0, 0.0, h.z)), vec3(0.0));
}

bool enters(Node node) {
    if (is_boundary_node(node.index)) return phase != 0u || node.level < g.level;
    if (phase == 0u) walk_ended = touches_node(node);
    return false;
}
#include "shared/quarters.glsl"
#include "shared/leaf_walk.glsl"

void main() {
    uint i = item_index();
    uint unfinished = 0u, narrow = 0u, by_node = 0u;
    // The root of an empty tree has no boundary flag, but is not full of mesh.
    if (i < min(status.at[0].waiting, most) && states.at[i].code != NONE && !is_empty_tree(grid.at[0].level)) {
        SearchState state = states.at[i];
        g = grid.at[0];
        joint = g;
        joint.lo = frame.at[0].joint_lo;
        joint.scale = frame.at[0].scale;
        uint t = waiting.at[i];
        RawTet own = own_tet(t);
        to_joint(own, v);
        lo = quantize(g, own.lo);
        hi = quantize(g, own.hi);
        bool found = false, done = false;
        phase = state.phase;
        for (uint work = 0u; work < BUDGET && !done;) {
            uint leaf = WALK_DONE;
            if (enters(Node(0u, 0u, 0u))) {
                leaf = WALK_PAUSED;
                LeafWalk at = walk_from(g.level, state.code);
                while (work < BUDGET) {
                    leaf = next_leaf(at, g.level, work, BUDGET);
                    if (leaf >= WALK_PAUSED) break;
                    uvec2 range = entry_range(leaf);
                    uint begin = range.x + state.entry, end = min(range.y, begin + max(BUDGET - min(work, BUDGET), 1u)), e = begin;
                    for (; e < end && !found; ++e) {
                        RawTet other = other_tet(listed_tet(e));
                        if (!compared_in(g, at.code, own, other)) continue;
                        vec3 w[4];
                        to_joint(other, w);
                        ++narrow;
                        found = tets_touch(v, w);
                    }
                    work += end - begin;
                    state.entry = e - range.x;
                    if (found || e < range.y) break;
                    state.entry = 0u;
                    leaf = walk_past(at, g.level, g.level) ? WALK_PAUSED : WALK_DONE;
                    if (leaf == WALK_DONE) break;
                }
                state.code = at.code;
            }
            if (walk_ended) {
                by_node = 1u;
                found = true;
            }
            if (found) {
                done = true;
            } else if (leaf == WALK_DONE) {
                done = phase != 0u;
                phase = 1u;
                state.code = 0u;
                state.entry = 0u;
            }
        }
        if (found) atomicOr(hits.at[t >> 5u], 1u << (t & 31u));
        if (done) state.code = NONE;
        state.phase = phase;
        states.at[i] = state;
        unfinished = uint(!done);
    }
    unfinished = subgroupAdd(unfinished);
    by_node = subgroupAdd(by_node);
    if (subgroupElect()) {
        if (unfinished > 0u) atomicAdd(status.at[0].unfinished, unfinished);
        if (by_node > 0u) atomicAdd(status.at[0].by_node, by_node);
    }
    ADD_TO_COUNTER(status.at[0].narrow, narrow)
}
