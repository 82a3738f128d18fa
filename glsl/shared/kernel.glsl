// What every kernel includes: how arguments are passed, and how work is indexed.
//
// A kernel declares its arguments once:
//     ARGUMENTS(2)            // number of buffers
//         uint count;         // scalars
//     END_ARGUMENTS
//     BUFFER(0, readonly, uint, keys)
//     BUFFER(1, writeonly, uint, sorted)
// and reads keys.at[i]; a kernel without scalars begins with NO_SCALARS(2) instead. By default, the push constants hold
// one 64-bit address per buffer, then the scalars. With OLBVH_DESCRIPTORS, buffer i is `set = 0, binding = i`, and the push constants hold only the scalars. OLBVH_WIDE: see
// records.glsl.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require

#define READ_WRITE
#define END_ARGUMENTS };
#ifdef OLBVH_DESCRIPTORS
#define ARGUMENTS(buffers) layout(push_constant, std430) uniform Arguments {
#define NO_SCALARS(buffers)
// build.rs reads the alignment from the name of the block.
#define ALIGNED_BUFFER(alignment, slot, access, T, name)                                                                         \
    layout(set = 0, binding = slot, std430) access buffer name##Block##alignment { T at[]; } name;
#else
#define ARGUMENTS(buffers) layout(push_constant, std430) uniform Arguments { uvec2 address[buffers];
#define NO_SCALARS(buffers) ARGUMENTS(buffers) END_ARGUMENTS
#define ALIGNED_BUFFER(alignment, slot, access, T, name)                                                                         \
    layout(buffer_reference, std430, buffer_reference_align = alignment) access buffer name##Block { T at[]; };                 \
    name##Block name = name##Block(address[slot]);
#endif
#define BUFFER(slot, access, T, name) ALIGNED_BUFFER(4, slot, access, T, name)
#define BUFFER8(slot, access, T, name) ALIGNED_BUFFER(8, slot, access, T, name)
// Elements of 16 bytes at addresses that are multiples of 16: one load each.
#define BUFFER16(slot, access, T, name) ALIGNED_BUFFER(16, slot, access, T, name)

// The grid, with the arrays of a graded one as grid.glsl wants them.
#define GRID(slot, access)                                                                                                       \
    BUFFER16(slot, access, Grid, grid)                                                                                           \
    vec4 knot(uint i) { return grid.at[0].knots[i]; }                                                                            \
    vec4 rate(uint i) { return grid.at[0].rates[i]; }

#include "shared/records.glsl"

const uint NONE = 0xffffffffu; // No tetrahedron: no neighbour, no owner.

#ifndef OLBVH_RAY_TRACING // ray tracing launches have no workgroups
layout(constant_id = 0) const uint WORKGROUP = 64; // invocations per workgroup
layout(constant_id = 1) const uint ROWS = 4;       // items per invocation
layout(local_size_x_id = 0) in;

// Workgroups are folded into two dimensions, since one dimension is limited to 65,535.
uint group_index() { return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x; }

// Place in the workgroup; consecutive within a subgroup, whatever the driver's mapping.
uint local_index() { return gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID; }

// The first of the ROWS consecutive items of this invocation.
uint first_item() { return (group_index() * WORKGROUP + local_index()) * ROWS; }

// The first item of this invocation, and the end, where a workgroup takes `tile` items (a multiple of WORKGROUP) of
// `count`; then every gl_SubgroupSize-th. A subgroup takes consecutive items: processors run the subgroups of a
// workgroup one after the other, and read memory faster in order.
uvec2 items_of_tile(uint tile, uint count) {
    uint each = tile / gl_NumSubgroups, begin = group_index() * tile + gl_SubgroupID * each;
    return uvec2(begin + gl_SubgroupInvocationID, min(begin + each, count));
}

// The item of this invocation, where each takes one.
uint item_index() { return group_index() * WORKGROUP + local_index(); }

// Adds `n` of every invocation of the subgroup to a counter of 64 bits: two words, the low one first. For the end of
// main, where the subgroup is together.
#define ADD_TO_COUNTER(counter, n)                                                                                               \
    {                                                                                                                            \
        uint more = subgroupAdd(n);                                                                                              \
        if (subgroupElect() && more > 0u && atomicAdd(counter[0], more) > ~more) atomicAdd(counter[1], 1u);                      \
    }
#endif
