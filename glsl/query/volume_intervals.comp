#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/node.glsl"
#include "shared/boxes.glsl"
#include "shared/rays.glsl"
// Ray intervals (SPEC 3.3): from the first to the last boundary leaf that a ray meets. Twin of src/reference/volume/interval.rs.
layout(constant_id = 2) const uint STACK = 8;
ARGUMENTS(7)
    uint items; // pixels in whole blocks
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER(1, readonly, uint, masks)
BUFFER(2, readonly, uint, co)
BUFFER(3, readonly, uint, flags)
BUFFER16(4, readonly, RenderPlan, plans)
BUFFER16(5, writeonly, RayState, states)
BUFFER(6, readonly, uint, po)
#include "shared/tree.glsl"

Grid g;
RenderPlan plan;
vec3 origin, inverse_way;
float first, last;
float entered, left;

// Where the ray enters and leaves the box of a node.
bool hit(Node node) {
    vec3 lo, hi;
    cell_box(g, node.level, node.code, lo, hi);
    precise vec3 a = ((lo - plan.slack.xyz) - origin) * inverse_way;
    precise vec3 b = ((hi + plan.slack.xyz) - origin) * inverse_way;
    vec3 near = min(a, b), far = max(a, b);
    entered = max(max(max(0.0, near.x), near.y), near.z);
    left = min(min(min(3.40282347e38, far.x), far.y), far.z);
    return entered <= left;
}

bool visit_node(Node node) {
    if ((flags.at[node.index >> 5u] >> (node.index & 31u) & 1u) == 0u || !hit(node)) return false;
    return !(first <= entered && left <= last);
}

bool visit_leaf(Node node) {
    hit(node);
    first = min(first, entered);
    last = max(last, left);
    return false;
}
#include "shared/traverse.glsl"

void main() {
    uint i = item_index();
    if (i >= items) return;
    plan = plans.at[0];
    uvec2 pixel, size = uvec2(plan.size[0], plan.size[1]);
    RayState state = RayState(vec4(0.0), 0u, 0u, NONE, 0u, NONE, SMALLEST_FLOAT, 0u, 0u);
    if (pixel_of(i, size, pixel)) {
        g = grid.at[0];
        vec3 way;
        make_ray(plan, pixel, origin, way);
        const float LEAST = 1e-20;
        for (uint c = 0u; c < 3u; ++c) {
            bool parallel = abs(way[c]) < LEAST;
            bool negative = (floatBitsToUint(way[c]) & 0x80000000u) != 0u;
            inverse_way[c] = parallel ? (negative ? -1e20 : 1e20) : reciprocal(way[c]);
        }
        first = 3.40282347e38;
        last = -1.0;
        bool within = all(lessThanEqual(g.lo.xyz, origin)) && all(lessThanEqual(origin, g.hi.xyz));
        if (within && find_leaf(g.level, quantize(g, origin)) != NONE) first = last = 0.0;
        if (!traverse(g.level)) {
            // Too many nodes to visit: all of the bounds, which holds every leaf.
            if (hit(Node(0u, 0u, 0u))) {
                first = min(first, entered);
                last = max(last, left);
            }
        }
        if (first <= last) {
            precise float begin = floor(max(first * plan.inverse_step - 1.5, 0.0));
            precise float end = floor(max(last * plan.inverse_step + 1.5, 0.0));
            state.next = uint(begin);
            state.end = uint(end);
        }
    }
    states.at[i] = state;
}
