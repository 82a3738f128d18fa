#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/structure.glsl"
#include "shared/frame.glsl"
#include "shared/rays.glsl"
// Marching (SPEC 3.3): samples (k + 1/2)·Δ from the ray's origin, front to back, until the ray is opaque or a dispatch's share of work is done.
// With SKIP the tree is asked for stretches without anything to see as soon as a sample adds nothing. Twin of src/reference/volume/march.rs.
layout(constant_id = 2) const uint SHADING = 0;
layout(constant_id = 3) const uint ON_CELLS = 0;
ARGUMENTS(10 + STRUCTURE_BUFFERS)
    uint items;  // pixels in whole blocks
    uint budget; // candidates tested per ray and dispatch, roughly
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER16(1, readonly, uvec4, cells)
BUFFER16(2, readonly, vec4, vertices)
BUFFER16(3, readonly, uvec4, neighbours)
BUFFER(4, readonly, float, field)
BUFFER(5, readonly, float, normals) // three per vertex
BUFFER16(6, readonly, Frame, frames)
BUFFER16(7, READ_WRITE, RayState, states)
BUFFER16(8, READ_WRITE, vec4, colors) // premultiplied colour and opacity, row by row
BUFFER(9, READ_WRITE, RenderStatus, status)
STRUCTURE(10)
#include "shared/structure_owner.glsl"

RenderView view;
RenderPlan plan;
#include "shared/skip.glsl"

const uint WALK = 6u; // steps of a walk across faces before the structure is asked

// The current tetrahedron and what its samples need.
uint cell;
Tet tet;
uvec4 corners;
vec4 cell_values;
mat4x3 cell_normals;

vec3 normal_of(uint v) { return vec3(normals.at[3u * v], normals.at[3u * v + 1u], normals.at[3u * v + 2u]); }

void enter(uint t) {
    cell = t;
    corners = cells.at[t];
    tet = load_tet(corners);
    if (ON_CELLS != 0u) cell_values = vec4(field.at[t]);
    else cell_values = vec4(field.at[corners.x], field.at[corners.y], field.at[corners.z], field.at[corners.w]);
    if (SHADING != 0u) cell_normals = mat4x3(normal_of(corners.x), normal_of(corners.y), normal_of(corners.z), normal_of(corners.w));
}

// Colour, and opacity of one step, at a value.
vec4 lookup(float value) {
    precise float x = clamp((value - view.value_lo) * view.value_scale, 0.0, 1.0) * float(TABLE - 1u);
    uint i = min(uint(x), TABLE - 2u);
    precise float t = x - float(i);
    vec4 a = frames.at[0].table[i], b = frames.at[0].table[i + 1u];
    precise vec4 r = a + (b - a) * t;
    return r;
}

// Light on a sample: factor and added white of its colour, added opacity. Twin of `Lighting::shade`.
vec3 shade(vec3 n, vec3 way, vec3 halfway) {
    float square = dot_product(n, n);
    if (square < 1e-8) return vec3(1.0, 0.0, 0.0);
    float r = inverse_sqrt(square);
    precise float m = min(square * r, 1.0);
    precise float c = abs(dot_product(n, view.to_light.xyz)) * r;
    precise float g = 1.0 - min(abs(dot_product(n, way)) * r, 1.0);
    precise float h = min(abs(dot_product(n, halfway)) * r, 1.0);
    for (int i = 0; i < 5; ++i) {
        precise float hh = h * h;
        h = hh;
    }
    precise float factor = 1.0 + m * ((view.strength.x + view.strength.y * c) - 1.0);
    precise float added = m * (view.strength.z * h);
    precise float rim = m * ((g * g) * (g * g) * view.strength.w);
    return vec3(factor, added, rim);
}

void main() {
    uint i = item_index();
    uint samples = 0u, found = 0u, skipped = 0u, unfinished = 0u;
    if (i < items && states.at[i].next < states.at[i].end) {
        view = frames.at[0].view;
        plan = frames.at[0].plan;
        Grid g = grid.at[0];
        RayState state = states.at[i];
        uvec2 pixel;
        pixel_of(i, uvec2(plan.size[0], plan.size[1]), pixel);
        uint place = pixel.y * plan.size[0] + pixel.x;
        vec4 sum = colors.at[place];
        vec3 origin, way;
        make_ray(view, pixel, origin, way);
        vec3 halfway = vec3(0.0);
        if (SHADING != 0u) {
            precise vec3 h = view.to_light.xyz - way;
            float square = max(dot_product(h, h), 1e-12);
            precise vec3 unit = h * inverse_sqrt(square);
            halfway = unit;
        }
        vec3 inverse_way = SKIP != 0u ? inverse_of(way) : vec3(0.0);
        bool in_cell = state.hint != NONE;
        if (in_cell) enter(state.hint);
        uint work = 0u;
        for (; state.next < state.end && work < budget; ++work) {
#ifndef BINARY_TREE
            if (SKIP != 0u && state.next >= state.check) {
                bool hidden;
                uint behind = stretch_end(g, origin, way, inverse_way, state.next, state.end, hidden);
                if (!hidden) {
                    state.check = behind;
                } else {
                    in_cell = in_cell && behind - state.next < WALK;
                    skipped += behind - state.next;
                    state.next = behind;
                    continue;
                }
            }
#endif
            vec3 at = sample_at(view, origin, way, state.next);
            vec3 x = normalise(g, at);
            Weights w;
            bool inside = false;
            // The cell of the last sample, or one a short walk across faces away, if it holds the sample clearly.
            for (uint s = 0u; in_cell && state.cursor == 0u && s < WALK; ++s) {
                w = weights(tet, x);
                inside = w.clear;
                if (inside) break;
                vec4 own = own_weights(w, tet);
                uint face = outermost(own);
                uint next = neighbours.at[cell][face];
                if (own[face] >= 0.0 || next == NONE) break;
                enter(next);
                ++work;
            }
            if (!inside) {
                uint owner;
                OwnerSearch search = OwnerSearch(state.cursor, best_of(state.best, state.in_box, state.smallest));
                bool ended = find_owner(search, g, at, x, 0.0, work, budget, owner);
                state.cursor = search.cursor;
                state.best = search.best.owner;
                state.in_box = best_bits(search.best);
                state.smallest = search.best.smallest;
                if (!ended) break;
                if (owner != NONE) {
                    enter(owner);
                    in_cell = inside = true;
                    w = weights(tet, x);
                } else {
                    in_cell = false; // behind a gap the structure is asked first
                }
            }
            ++state.next;
            ++samples;
            if (!inside) continue;
            ++found;
            vec4 b = barycentric(w, tet.rank);
            precise float value = (b.x * cell_values.x + b.y * cell_values.y) + (b.z * cell_values.z + b.w * cell_values.w);
            if (ON_CELLS != 0u) value = cell_values.x;
            if ((floatBitsToUint(value) & 0x7f800000u) == 0x7f800000u) continue;
            vec4 color = lookup(value);
            if (color.w <= 0.0) continue;
            if (SKIP != 0u) state.check = max(state.check, state.next + 1u);
            if (SHADING != 0u) {
                precise vec3 n = (b.x * cell_normals[0] + b.y * cell_normals[1]) + (b.z * cell_normals[2] + b.w * cell_normals[3]);
                vec3 lit = shade(n, way, halfway);
                precise vec3 c = color.xyz * lit.x + lit.y;
                color.xyz = min(c, vec3(1.0));
                precise float a = color.w + (1.0 - color.w) * lit.z;
                color.w = a;
            }
            precise float share = (1.0 - sum.w) * color.w;
            precise vec4 more = sum + share * vec4(color.xyz, 1.0);
            sum = more;
            if (sum.w >= view.termination) {
                state.end = state.next;
                break;
            }
        }
        state.hint = in_cell ? cell : NONE;
        unfinished = uint(state.next < state.end);
        states.at[i] = state;
        colors.at[place] = sum;
    }
    samples = subgroupAdd(samples);
    found = subgroupAdd(found);
    skipped = subgroupAdd(skipped);
    unfinished = subgroupAdd(unfinished);
    if (subgroupElect()) {
        if (samples > 0u && atomicAdd(status.at[0].samples[0], samples) > NONE - samples) atomicAdd(status.at[0].samples[1], 1u);
        if (found > 0u && atomicAdd(status.at[0].found[0], found) > NONE - found) atomicAdd(status.at[0].found[1], 1u);
        if (skipped > 0u && atomicAdd(status.at[0].skipped[0], skipped) > NONE - skipped) atomicAdd(status.at[0].skipped[1], 1u);
        if (unfinished > 0u) atomicAdd(status.at[0].unfinished, unfinished);
    }
}
