#version 460
// Slicing (SPEC 3.4), last part: counts the voxels whose centre lies in no tetrahedron by kind, and writes their values
// of the field, if there is one. Twin of src/reference/slice.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/separate.glsl"
#include "shared/voxels.glsl"
layout(constant_id = 2) const uint ON_CELLS = 0;
layout(constant_id = 3) const uint LINEAR = 0;
layout(constant_id = 4) const uint FIELD = 1;
ARGUMENTS(9)
    uint voxels; // of the band
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, uvec4, cells)
RECORDS(2, vec4, vertices)
BUFFER(3, readonly, float, field)
BUFFER16(4, readonly, SliceUniforms, plans)
BUFFER(5, readonly, TouchState, states)
BUFFER(6, readonly, uint, answers)
BUFFER(7, writeonly, uint, values) // floats, by their bits
BUFFER(8, READ_WRITE, SliceStatus, status)
#include "shared/vertices.glsl"

// The value of a voxel with its centre at x that `owner` touches.
float touched_value(uint owner, vec3 x) {
    if (ON_CELLS != 0u) return field.at[owner];
    uvec4 ids = words(cells.at[owner]);
    Tet tet = load_tet(ids);
    vec4 at_vertices = vec4(field.at[ids.x], field.at[ids.y], field.at[ids.z], field.at[ids.w]);
    Weights w = weights(tet, x);
    if (LINEAR != 0u && w.sum > 0.0 && volume(tet) != 0.0) return weighed(barycentric(w, tet.rank), at_vertices);
    vec3 v[4] = vec3[4](difference(tet.v[0], x), difference(tet.v[1], x), difference(tet.v[2], x), difference(tet.v[3], x));
    vec4 c;
    closest(v, c);
    return weighed(vec4(c[tet.rank.x], c[tet.rank.y], c[tet.rank.z], c[tet.rank.w]), at_vertices);
}

void main() {
    uint i = item_index(), touched = 0u;
    SliceUniforms plan = plans.at[0];
    // Voxels are counted only once all answers are known.
    if (i < min(plan.listed, voxels) && (status.at[0].locating | status.at[0].touching) == 0u) {
        uint voxel = states.at[i].voxel, answer = answers.at[voxel];
        touched = uint(answer != NONE);
        if (FIELD != 0u) {
            uint value = NAN;
            if (answer != NONE) value = floatBitsToUint(touched_value(answer & ~SLICE_TOUCHED, normalise(grid.at[0], voxel_centre(plan, voxel))));
            values.at[voxel] = value;
        }
    }
    touched = subgroupAdd(touched);
    if (subgroupElect() && touched > 0u) {
        atomicAdd(status.at[0].touched, touched);
        atomicAdd(status.at[0].empty, 0u - touched);
    }
}
