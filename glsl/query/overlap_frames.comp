#version 460
// Overlap (SPEC 3.5), first kernel: computes the frames of both trees' cells in the normalised coordinates of the joint
// grid over both bounds. Twin of `joint_grid` and `node_frame` in src/reference/overlap.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(10)
    uint tets_a;
    uint tets_b;
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid_a)
BUFFER16(1, readonly, Grid, grid_b)
BUFFER(2, readonly, MeshStatus, mesh_a)
BUFFER(3, readonly, MeshStatus, mesh_b)
BUFFER(4, readonly, BuildStatus, tree_a)
BUFFER(5, readonly, BuildStatus, tree_b)
BUFFER16(6, writeonly, NodeFrame, frame_a)
BUFFER16(7, writeonly, NodeFrame, frame_b)
BUFFER(8, READ_WRITE, OverlapStatus, status_a)
BUFFER(9, READ_WRITE, OverlapStatus, status_b)

NodeFrame frame_of(Grid g, Grid joint) {
    NodeFrame f;
    f.corner = vec4(normalise(joint, g.lo.xyz), 0.0);
    f.half_size = vec4(0.0);
    f.flat_axis = vec4(0.0);
    for (uint c = 0u; c < 3u; ++c) {
        precise float extent = g.hi[c] - g.lo[c];
        precise float scaled = canonical(extent) * joint.scale;
        precise float part = scaled * two_to(39);
        f.half_size[c] = part;
        f.flat_axis[c] = g.inv[c] == 0.0 ? 1.0 : 0.0;
    }
    f.joint_lo = joint.lo;
    f.scale = joint.scale;
    f.pad0 = f.pad1 = f.pad2 = 0u;
    return f;
}

void main() {
    if (item_index() > 0u) return;
    Grid a = grid_a.at[0], b = grid_b.at[0], joint = a;
    bool none = mesh_a.at[0].bad == tets_a || mesh_b.at[0].bad == tets_b;
    uint empty = uint(none || tree_a.at[0].overflow != 0u || tree_b.at[0].overflow != 0u);
    status_a.at[0].empty = empty;
    status_b.at[0].empty = empty;
    float largest = two_to(-103);
    joint.lo = vec4(min(a.lo.xyz, b.lo.xyz), 0.0);
    joint.hi = vec4(max(a.hi.xyz, b.hi.xyz), 0.0);
    for (uint c = 0u; c < 3u; ++c) {
        precise float extent = joint.hi[c] - joint.lo[c];
        largest = max(largest, canonical(extent));
    }
    joint.scale = uintBitsToFloat((254u - (floatBitsToUint(largest) >> 23)) << 23);
    frame_a.at[0] = frame_of(a, joint);
    frame_b.at[0] = frame_of(b, joint);
}
