#version 460
// Volume rendering (SPEC 3.3), first kernel: copies the host's view and transfer function, and computes what depends on
// the bounds and the octree, which only the device knows. Twin of `interval_slack` in src/render/picture_plan.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/frame.glsl"
ARGUMENTS(6)
    uint width;
    uint height;
    uint visible_at;
    uint row;
    uint first_cell;
    uint last_cell;
    uint octree; // not 0: there is one
END_ARGUMENTS
GRID(0, readonly)
BUFFER16(1, readonly, ViewUniforms, views)
RECORDS(2, vec4, table)
BUFFER16(3, writeonly, Frame, frames)
BUFFER(4, readonly, uint, masks)
BUFFER(5, readonly, uint, co)
#include "shared/children.glsl"
#include "shared/slab.glsl"

// The node around a cell of `level`, or MISSING and the highest level without one.
uint top_of(uint level, uint code) {
    uint node = 0u;
    for (uint at = 1u; at <= level; ++at) {
        uint digit = code >> (3u * (level - at)) & 7u, mask = child_mask(node);
        if ((mask >> digit & 1u) == 0u) return MISSING | at;
        node = child_of(node, mask, digit);
    }
    return node;
}

void main() {
    uint i = item_index();
    if (i < TABLE) frames.at[0].table[i] = table.at[i];
    uint top_level = min(TOP_LEVEL, grid.at[0].level);
    if (octree != 0u && i < 1u << 3u * top_level) frames.at[0].top[i] = top_of(top_level, i);
    if (i > 0u) return;
    frames.at[0].view = views.at[0];
    vec3 lo = grid.at[0].lo.xyz, hi = grid.at[0].hi.xyz;
    float largest = 0.0;
    for (uint c = 0u; c < 3u; ++c) {
        precise float extent = hi[c] - lo[c];
        largest = max(largest, canonical(extent));
    }
    DrawUniforms plan = DrawUniforms(vec4(0.0), vec4(slab_scale(grid.at[0]), 0.0), uint[2](width, height), visible_at, row, first_cell, last_cell, uint[2](0u, 0u));
    for (uint c = 0u; c < 3u; ++c) {
        precise float of_bounds = largest * two_to(-18);
        precise float far = abs(lo[c]) + abs(hi[c]);
        precise float of_place = canonical(far) * two_to(-21);
        precise float slack = canonical(of_bounds) + canonical(of_place);
        plan.slack[c] = slack;
    }
    frames.at[0].plan = plan;
}
