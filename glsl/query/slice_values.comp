#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/separate.glsl"
#include "shared/voxels.glsl"
// Slicing (SPEC 3.4), last part: voxels by kind, and values of a field if there is one. An invocation takes a run of voxels; what neighbours with one
// owner share is read once. Twin of src/reference/slice.rs.
layout(constant_id = 2) const uint ON_CELLS = 0;
layout(constant_id = 3) const uint LINEAR = 0;
layout(constant_id = 4) const uint FIELD = 1;
layout(constant_id = 5) const uint RUN = 32;
ARGUMENTS(8)
    uint layer;
    uint first; // number of the first row in that layer
    uint voxels;
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
RECORDS(1, uvec4, cells)
RECORDS(2, vec4, vertices)
BUFFER(3, readonly, float, field)
BUFFER16(4, readonly, SlicePlan, plans)
BUFFER(5, readonly, uint, answers)
BUFFER(6, writeonly, float, values)
BUFFER(7, READ_WRITE, SliceStatus, status)

// A cell and the field at its vertices, in the caller's order.
struct Source {
    Tet tet;
    vec4 field;
};

Source source_of(uint owner) {
    uvec4 ids = words(cells.at[owner]);
    Tet tet = make_tet(ids, floats(vertices.at[ids.x]).xyz, floats(vertices.at[ids.y]).xyz, floats(vertices.at[ids.z]).xyz, floats(vertices.at[ids.w]).xyz);
    return Source(tet, vec4(field.at[ids.x], field.at[ids.y], field.at[ids.z], field.at[ids.w]));
}

float value_by(Source s, vec4 b) {
    precise float sum = (b.x * s.field.x + b.y * s.field.y) + (b.z * s.field.z + b.w * s.field.w);
    return sum;
}

// The value of a voxel that its owner touches.
float touched_value(Source s, vec3 x) {
    Weights w = weights(s.tet, x);
    if (LINEAR != 0u && w.sum > 0.0) return value_by(s, barycentric(w, s.tet.rank));
    vec3 v[4] = vec3[4](difference(s.tet.v[0], x), difference(s.tet.v[1], x), difference(s.tet.v[2], x), difference(s.tet.v[3], x));
    vec4 c;
    closest(v, c);
    return value_by(s, vec4(c[s.tet.rank.x], c[s.tet.rank.y], c[s.tet.rank.z], c[s.tet.rank.w]));
}

struct Place {
    uint i;   // number of the voxel in the band
    uvec3 at; // and in the stack
};

void advance(inout Place place, SlicePlan plan) {
    ++place.i;
    ++place.at.x;
    bool row = place.at.x == plan.width;
    place.at.x = row ? 0u : place.at.x;
    place.at.y += uint(row);
    bool layer_ends = place.at.y == plan.height;
    place.at.y = layer_ends ? 0u : place.at.y;
    place.at.z += uint(layer_ends);
}

void main() {
    uint begin = item_index() * RUN, end = min(begin + RUN, voxels);
    uint inside = 0u, touched = 0u, empty = 0u;
    // Only once all answers are there.
    if (begin < end && (status.at[0].locating | status.at[0].touching) == 0u) {
        SlicePlan plan = plans.at[0];
        Grid g = grid.at[0];
        uint row = begin / plan.width;
        Place place = Place(begin, uvec3(begin - row * plan.width, (first + row) % plan.height, layer + (first + row) / plan.height));
        for (; place.i < end;) {
            uint answer = answers.at[place.i], owner = answer & ~SLICE_TOUCHED;
            bool weighs = FIELD != 0u && ON_CELLS == 0u && answer != NONE;
            float alike = uintBitsToFloat(0x7fc00000u); // the value of all voxels with this answer
            if (FIELD != 0u && ON_CELLS != 0u && answer != NONE) alike = field.at[owner];
            Source source = Source(Tet(vec3[4](vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0)), uvec4(0u)), vec4(0.0));
            if (weighs) source = source_of(owner);
            // Touched voxels one at a time, those inside as many as follow each other.
            bool touches = answer != NONE && answer != owner;
            if (touches) {
                float value = weighs ? touched_value(source, normalise(g, voxel_centre(plan, place.at.x, place.at.y, place.at.z))) : alike;
                if (FIELD != 0u) values.at[place.i] = value;
                ++touched;
                advance(place, plan);
            }
            for (; !touches && place.i < end && answers.at[place.i] == answer;) {
                float value = alike;
                if (weighs) {
                    vec3 x = normalise(g, voxel_centre(plan, place.at.x, place.at.y, place.at.z));
                    value = value_by(source, barycentric(weights(source.tet, x), source.tet.rank));
                }
                if (FIELD != 0u) values.at[place.i] = value;
                inside += uint(answer != NONE);
                empty += uint(answer == NONE);
                advance(place, plan);
            }
        }
    }
    inside = subgroupAdd(inside);
    touched = subgroupAdd(touched);
    empty = subgroupAdd(empty);
    if (subgroupElect()) {
        if (inside > 0u) atomicAdd(status.at[0].inside, inside);
        if (touched > 0u) atomicAdd(status.at[0].touched, touched);
        if (empty > 0u) atomicAdd(status.at[0].empty, empty);
    }
}
