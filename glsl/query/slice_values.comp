#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/separate.glsl"
#include "shared/voxels.glsl"
// Slicing (SPEC 3.4), last part: voxels by kind, and values of a field if there is one. Twin of src/reference/slice.rs.
layout(constant_id = 2) const uint ON_CELLS = 0;
layout(constant_id = 3) const uint LINEAR = 0;
layout(constant_id = 4) const uint FIELD = 1;
ARGUMENTS(8)
    uint layer;
    uint first; // number of the first row in that layer
    uint voxels;
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER16(1, readonly, uvec4, cells)
BUFFER16(2, readonly, vec4, vertices)
BUFFER(3, readonly, float, field)
BUFFER16(4, readonly, SlicePlan, plans)
BUFFER(5, readonly, uint, answers)
BUFFER(6, writeonly, float, values)
BUFFER(7, READ_WRITE, SliceStatus, status)

void main() {
    uint i = item_index();
    // Only once all answers are there.
    if (i >= voxels || (status.at[0].locating | status.at[0].touching) != 0u) return;
    uint answer = answers.at[i], owner = answer & ~SLICE_TOUCHED;
    uint inside = subgroupAdd(uint(answer == owner)), empty = subgroupAdd(uint(answer == NONE)), all = subgroupAdd(1u);
    if (subgroupElect()) {
        if (inside > 0u) atomicAdd(status.at[0].inside, inside);
        if (empty > 0u) atomicAdd(status.at[0].empty, empty);
        if (inside + empty < all) atomicAdd(status.at[0].touched, all - inside - empty);
    }
    if (FIELD == 0u) return;
    float value = uintBitsToFloat(0x7fc00000u);
    if (answer != NONE && ON_CELLS != 0u) {
        value = field.at[owner];
    } else if (answer != NONE) {
        SlicePlan plan = plans.at[0];
        uint row = i / plan.width;
        uint y = (first + row) % plan.height, k = layer + (first + row) / plan.height;
        vec3 x = normalise(grid.at[0], voxel_centre(plan, i - row * plan.width, y, k));
        uvec4 ids = cells.at[owner];
        Tet tet = make_tet(ids, vertices.at[ids.x].xyz, vertices.at[ids.y].xyz, vertices.at[ids.z].xyz, vertices.at[ids.w].xyz);
        Weights w = weights(tet, x);
        vec4 b;
        if (owner == answer || (LINEAR != 0u && w.sum > 0.0)) {
            b = barycentric(w, tet.rank);
        } else {
            vec3 v[4] = vec3[4](difference(tet.v[0], x), difference(tet.v[1], x), difference(tet.v[2], x), difference(tet.v[3], x));
            vec4 c;
            closest(v, c);
            b = vec4(c[tet.rank.x], c[tet.rank.y], c[tet.rank.z], c[tet.rank.w]);
        }
        precise float sum = (b.x * field.at[ids.x] + b.y * field.at[ids.y]) + (b.z * field.at[ids.z] + b.w * field.at[ids.w]);
        value = sum;
    }
    values.at[i] = value;
}
