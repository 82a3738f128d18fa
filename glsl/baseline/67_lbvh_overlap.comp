#version 460
// LBVH baseline, overlap: finds the tetrahedra of a mesh that intersect one of the other mesh, by the narrow-phase test
// of those whose boxes meet.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/separate.glsl"
#include "shared/overlap.glsl"
ARGUMENTS(14)
    uint tets;
    uint budget; // nodes and tests per tetrahedron and dispatch
END_ARGUMENTS
GRID(0, readonly) // of the other mesh, like all up to `positions`
BUFFER16(1, readonly, LbvhNode, nodes)
BUFFER(2, readonly, uint, root)
BUFFER(3, readonly, uint, ids)
RECORDS(4, uvec4, cells)
RECORDS(5, vec4, vertices)
BUFFER(6, readonly, float, positions)
RECORDS(7, uvec4, own_cells)
BUFFER(8, readonly, float, own_positions)
BUFFER(9, readonly, uint, bad)
BUFFER16(10, readonly, NodeFrame, frame)
BUFFER(11, READ_WRITE, uint, places)   // where to resume, zeroed; NONE: done
BUFFER(12, READ_WRITE, uint, hits)     // one bit per tetrahedron, zeroed
BUFFER(13, READ_WRITE, OverlapStatus, status)
#include "shared/bad.glsl"
#include "shared/overlap_tets.glsl"
#include "shared/binary_tree.glsl"

// The tetrahedron's box within the other mesh's bounds, in the normalised coordinates of that mesh, which keep the
// order of points.
vec3 lo, hi;

bool enters(uint reference) {
    if ((reference & BINARY_LEAF) != 0u) return true; // the tetrahedron's own box decides
    vec3 node_lo, node_hi;
    box_of(reference, node_lo, node_hi);
    return boxes_meet(node_lo, node_hi, lo, hi);
}
#include "shared/binary_walk.glsl"

void main() {
    uint t = item_index();
    uint unfinished = 0u, narrow = 0u;
    if (t < tets && places.at[t] != NONE) {
        Grid g = grid.at[0];
        joint = g;
        joint.lo = frame.at[0].joint_lo;
        joint.scale = frame.at[0].scale;
        bool found = false, done = is_bad(t);
        RawTet own;
        if (!done) {
            own = own_tet(t);
            done = !boxes_meet(own.lo, own.hi, g.lo.xyz, g.hi.xyz);
        }
        if (!done) {
            vec3 v[4];
            to_joint(own, v);
            lo = normalise(g, max(own.lo, g.lo.xyz));
            hi = normalise(g, min(own.hi, g.hi.xyz));
            BinaryWalk walk = binary_walk_from(places.at[t]);
            uint limit = binary_budget(0u, budget);
            for (uint work = 0u; work < limit && !found; ++work) {
                uint place = next_place(walk, work, limit);
                if (place >= WALK_PAUSED) break;
                RawTet other = other_tet(ids.at[place]);
                if (!boxes_meet(own.lo, own.hi, other.lo, other.hi)) continue;
                vec3 w[4];
                to_joint(other, w);
                ++narrow;
                found = tets_touch(v, w);
            }
            uint next = resume_place(walk);
            done = found || next == NONE;
            unfinished = uint(!done);
            if (!done) places.at[t] = next;
        }
        if (found) atomicOr(hits.at[t >> 5u], 1u << (t & 31u));
        if (done) places.at[t] = NONE;
    }
    unfinished = subgroupAdd(unfinished);
    if (subgroupElect() && unfinished > 0u) atomicAdd(status.at[0].unfinished, unfinished);
    ADD_TO_COUNTER(status.at[0].narrow, narrow)
}
