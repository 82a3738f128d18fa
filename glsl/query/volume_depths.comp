#version 460
// After marching: writes what a depth buffer has where rays became opaque, for whatever a renderer draws next. Twin of
// `RayGrid::depth_at` in src/render/rays.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/frame.glsl"
#include "shared/rays.glsl"
NO_SCALARS(5)
BUFFER16(0, readonly, Frame, frames)
BUFFER(1, readonly, RayState, states)
BUFFER16(2, readonly, vec4, colors) // row by row
BUFFER(3, writeonly, float, depths) // row by row
BUFFER(4, readonly, RenderStatus, status)

void main() {
    uint i = item_index();
    if (i >= status.at[0].met) return;
    uvec2 size = uvec2(frames.at[0].plan.size[0], frames.at[0].plan.size[1]), pixel;
    if (!pixel_of(states.at[i].item, size, pixel)) return;
    uint place = pixel.y * size.x + pixel.x;
    ViewUniforms view = frames.at[0].view;
    if (colors.at[place].w < view.termination) return;
    vec3 w = way_of(view, uvec2(pixel.x, frames.at[0].plan.row + pixel.y));
    precise float way = (states.at[i].last_at * view.step_size) * inverse_sqrt(dot_product(w, w));
    precise float above = way * view.origin_y.w - view.origin.w;
    precise float below = view.origin_x.w - way * view.direction.w;
    precise float depth = above * reciprocal(below);
    if (abs(below) > LEAST && abs(below) < MOST) depths.at[place] = depth;
}
