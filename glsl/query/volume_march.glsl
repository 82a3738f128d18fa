// Marching (SPEC 3.3): takes samples at distances (k + 1/2)·Δ from the ray's origin, front to back, until the ray is
// opaque or the dispatch's budget is spent. With ISO, a sample does not add a colour of its own, but the iso-surfaces on
// the ray's stretch in its tetrahedron, and those between this stretch and that of the sample before. With SKIP, the
// tree is asked for stretches without anything visible as soon as a sample adds nothing. Twin of
// src/reference/volume/march.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/structure.glsl"
#include "shared/frame.glsl"
#include "shared/rays.glsl"
layout(constant_id = 2) const uint SHADING = 0;
layout(constant_id = 3) const uint ON_CELLS = 0;
layout(constant_id = 6) const uint ISO = 0;
layout(constant_id = 7) const uint DEPTH = 0;
NO_SCALARS(11 + STRUCTURE_BUFFERS) // the most that there is room for
GRID(0, readonly)
RECORDS(1, uvec4, cells)
RECORDS(2, vec4, vertices)
RECORDS(3, uvec4, neighbours)
BUFFER(4, readonly, float, field)
BUFFER(5, readonly, float, normals) // three per vertex
BUFFER16(6, readonly, Frame, frames)
BUFFER(7, READ_WRITE, RayState, states)
BUFFER16(8, READ_WRITE, vec4, colors) // premultiplied colour and opacity, row by row
BUFFER(9, READ_WRITE, RenderStatus, status)
BUFFER(10, readonly, float, depths) // row by row, as the colours
STRUCTURE(11)
#include "shared/structure_owner.glsl"

ViewUniforms view;
DrawUniforms plan;
#include "shared/clip.glsl"
#include "shared/skip.glsl"
#include "shared/held.glsl"

const uint WALK = 6u;   // Most steps of a walk across faces before the structure is searched.
const uint BURST = 32u; // Passes along walks before rays that wait for the structure are served.
// Entries, nodes, and tetrahedra on and around walks that one ray may test in one dispatch, roughly.
const uint BUDGET = 1024u;

// The ray, and its state.
vec3 origin, direction, inverse_direction, halfway;
vec2 unclipped; // the stretch without what clips and depth leave out; samples are those of the interval
uint cut;       // the clip at which it begins, or NONE
RayState state;
vec4 sum;
uint samples, found, skipped;
uint ahead; // distance to the next sample that is taken

// The tetrahedron of the last sample and its data per corner, in the order of the stand's corners.
Stand stand;
vec4 held_values;
vec4 held_normals[3];

vec3 normal_of(uint v) { return vec3(normals.at[3u * v], normals.at[3u * v + 1u], normals.at[3u * v + 2u]); }

// Tells the compiler that nothing of the last tetrahedron is needed any more: a search then has its registers. On AMD's
// GPUs, twice as many rays or half as many again fit on a core.
void leave() {
    stand = stand_nowhere();
    held_values = vec4(0.0);
    held_normals = vec4[3](vec4(0.0), vec4(0.0), vec4(0.0));
}

void enter(uint t) {
    stand = stand_in(t);
    held_values = field_in(stand);
    if (SHADING != 0u) {
        uvec4 ids = stand.ids;
        vec3 a = normal_of(ids.x), b = normal_of(ids.y), c = normal_of(ids.z), d = normal_of(ids.w);
        for (uint k = 0u; k < 3u; ++k) held_normals[k] = vec4(a[k], b[k], c[k], d[k]);
    }
}

// Steps to the next tetrahedron. Returns false if there is none.
bool go_on(Sides at) {
    Exchange e;
    if (!step_on(stand, at, e)) return false;
    held_values = field_behind(held_values, stand, e);
    if (SHADING != 0u) {
        vec3 n = normal_of(e.fresh);
        for (uint k = 0u; k < 3u; ++k) held_normals[k] = exchange(held_normals[k], e, n[k]);
    }
    return true;
}

// The colour, and the opacity of one step, at a value.
vec4 lookup(float value) {
    precise float x = clamp((value - view.value_lo) * view.value_scale, 0.0, 1.0) * float(TABLE - 1u);
    uint i = min(whole_of(x), TABLE - 2u);
    precise float t = x - float(i);
    vec4 a = floats(frames.at[0].table[i]), b = floats(frames.at[0].table[i + 1u]);
    precise vec4 r = a + (b - a) * t;
    return r;
}

// Light on a sample with normal n: a factor for its colour, white added to its colour, and added opacity. Twin of
// `Lighting::shade`.
vec3 shade(vec3 n) {
    float square = dot_product(n, n);
    if (square < 1e-8) return vec3(1.0, 0.0, 0.0);
    float r = inverse_sqrt(square);
    precise float m = min(square * r, 1.0);
    precise float facing = min(abs(dot_product(n, direction)) * r, 1.0);
    precise float c = max(abs(dot_product(n, view.to_light.xyz)) * r, view.to_light.w * facing);
    precise float g = 1.0 - facing;
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

// The normal at barycentric coordinates b of the stand.
vec3 normal_at(vec4 b) { return vec3(weighed(b, held_normals[0]), weighed(b, held_normals[1]), weighed(b, held_normals[2])); }

// The normal at a place of the ray, whose own is n. Where a clip cuts the mesh open, it is that of the cut, and less so
// with every step behind it. Twin of `PicturePlan::beside_cut`.
vec3 beside_cut(float at, vec3 n) {
    if (cut == NONE) return n;
    precise float part = 1.0 - (at - unclipped.x) * view.cut_fade;
    precise vec3 bent = n + (frames.at[0].view.clip[cut].xyz - n) * part;
    return part > 0.0 ? bent : n;
}

// Adds a colour to the ray, at a place `at` steps from its origin with normal n.
void add(float at, vec4 color, vec3 n) {
    if (SHADING != 0u) {
        vec3 lit = shade(n);
        precise vec3 c = color.xyz * lit.x + lit.y;
        color.xyz = min(c, vec3(1.0));
        precise float a = color.w + (1.0 - color.w) * lit.z;
        color.w = a;
    }
    precise float share = (1.0 - sum.w) * color.w;
    precise vec4 more = sum + share * vec4(color.xyz, 1.0);
    sum = more;
    if (sum.w < view.termination) return;
    state.end = state.next;
    state.last_at = at;
}

#include "query/volume_surfaces.glsl"

// The normal of sample k. The first one behind a surface, or behind what is transparent, has that of the place where the
// ray enters its tetrahedron, and behind a clip that of the cut: at various depths, even surfaces would have rings. Twin
// of `Marcher::lit_at`.
vec3 normal_of_sample(uint k, Sides here, bool joins) {
    precise float at = float(k) + 0.5;
    if (joins) return beside_cut(at, normal_at(barycentric(here)));
    precise float from_cut = at - unclipped.x;
    if (cut != NONE && from_cut < 1.0) return frames.at[0].view.clip[cut].xyz;
    Sides next = sides_of(stand, normalise(grid.at[0], sample_at(view, origin, direction, k + 1u)));
    precise vec4 change = next.w - here.w;
    precise vec4 behind = here.w - change;
    precise float entry = max(at - way_within(here.w, behind), unclipped.x);
    return beside_cut(entry, normal_at(barycentric_at(entry)));
}

// Whether the tree must first be asked how far nothing is visible.
bool is_to_look() { return SKIP != 0u && state.next >= state.check; }

void pass_by() {
    state.last = NONE;
    state.next += ahead;
    skipped += ahead - 1u;
    ahead = 1u;
    ++samples;
}

#ifndef BINARY_TREE
// Passes samples that no tetrahedron is near, all those of one octree cell or beside one leaf's slab together, so that
// rays beside the mesh catch up with rays in it. If it ends before the ray does, or its budget, or a sample from which
// visibility must be looked for, `leaf` is that of the next sample.
void pass_empty(Grid g, inout uint work, out uint leaf) {
    leaf = NONE;
    for (; state.next < state.end && !is_to_look() && work < BUDGET; ++work) {
        vec3 at = sample_at(view, origin, direction, state.next);
        uvec3 finest = quantize(g, at);
        uint code = morton(finest), top_level = min(TOP_LEVEL, g.level);
        leaf = frames.at[0].top[code >> 3u * (MAX_LEVEL - top_level)];
        uint level = (leaf & MISSING) != 0u ? leaf & ~MISSING : empty_level(g.level, code, top_level, leaf);
        bool in_leaf = level == 0u;
        vec3 scale = frames.at[0].plan.slab_scale.xyz;
        int side = in_leaf ? side_of_slab(g, scale, leaf, finest, normalise(g, at)) : 0;
        if (in_leaf && side == 0) return;
        uint end = SKIP != 0u ? min(state.end, state.check) : state.end;
        uint last = sample_behind(g, origin, direction, inverse_direction, state.next, end, finest, in_leaf ? g.level : level) - 1u;
        if (in_leaf && side_of_slab(g, scale, leaf, finest, normalise(g, sample_at(view, origin, direction, last))) != side) last = state.next;
        samples += last - state.next;
        state.next = last;
        pass_by();
    }
}
#endif

// Adds the next sample, which lies in the tetrahedron of the stand.
void take(Sides sides) {
    uint k = state.next, last = state.last;
    pass_by();
    ++found;
    vec4 b = barycentric(sides);
    float value = value_of(held_values, b);
    if ((floatBitsToUint(value) & 0x7f800000u) == 0x7f800000u) return;
    if (ISO != 0u) {
        Place ends[3];
        find_ends(k, sides, value, last != NONE, ends[1], ends[2]);
        ends[0] = last != NONE ? place_at(state.last_at, uintBitsToFloat(last)) : ends[1];
        state.last = floatBitsToUint(ends[2].value);
        state.last_at = ends[2].at;
        [[dont_unroll]] for (uint piece = 0u; piece < 2u; ++piece) add_surfaces(ends[piece], ends[piece + 1u]);
        return;
    }
    vec4 color = lookup(value);
    if (color.w <= 0.0) return;
    state.last = 0u;
    if (SKIP != 0u) state.check = max(state.check, state.next + 1u);
    add(float(k) + 0.5, color, SHADING != 0u ? normal_of_sample(k, sides, last != NONE) : vec3(0.0));
}

// Takes up the ray of a pixel.
void begin_ray(uvec2 in_view, uint place) {
    make_ray(view, in_view, origin, direction);
    halfway = vec3(0.0);
    if (SHADING != 0u) {
        precise vec3 h = view.to_light.xyz - direction;
        float square = max(dot_product(h, h), 1e-12);
        precise vec3 unit = h * inverse_sqrt(square);
        halfway = unit;
    }
    inverse_direction = inverse_of(direction);
    if (ISO != 0u || SHADING != 0u) unclipped = kept_stretch(origin, direction, limit_of(in_view, place), cut);
    ahead = 1u;
}

// Walks from the tetrahedron of the last sample, as long as it `stands` in one and for a burst of passes. A pass is one
// sample, after one step if needed. Walks are not cut short, so that owners do not depend on when a ray has to wait.
// Unless the ray `walks`, this is a single sample of a known owner.
void walk(Grid g, bool walks, inout uint work, inout bool stands, inout bool is_owner) {
    uint misses = 0u; // steps of the walk to the next sample
    uint pass = 0u;
    for (; (pass < BURST || misses > 0u) && (walks || is_owner) && stands && state.next < state.end && !is_to_look(); ++pass, ++work) {
        vec3 x = normalise(g, sample_at(view, origin, direction, state.next));
        Sides sides = sides_of(stand, x);
        if (!sides.clear && !is_owner) {
            stands = ++misses < WALK && go_on(sides);
            if (stands) sides = sides_of(stand, x);
        }
        if (stands && (sides.clear || is_owner)) {
            misses = 0u;
            is_owner = false;
            take(sides);
        }
    }
}

#ifndef BINARY_TREE
// Asks the tree how far nothing is visible, and passes that.
void look(Grid g, inout bool stands) {
    bool hidden;
    uint behind = stretch_end(g, origin, direction, inverse_direction, state.next, state.end, hidden);
    if (!hidden) {
        state.check = behind;
    } else if (ISO != 0u) {
        // The stretch lies on one side of every surface, so its first and its last sample are enough.
        ahead = max(behind - state.next, 2u) - 1u;
        state.check = state.next + 1u;
    } else {
        stands = stands && behind - state.next < WALK;
        skipped += behind - state.next;
        state.next = behind;
        state.last = NONE; // as after a transparent sample
    }
}
#endif

// Follows the ray until its end or the budget's.
void march(Grid g) {
    // Each of the following has one place in the loop, since kernels with several copies take long to compile: the
    // ray enters a tetrahedron, takes a sample, searches the structure.
    uint target = state.cursor == 0u ? state.tet : NONE; // the tetrahedron to enter
    bool stands = false;
    bool is_owner = false; // the target is known to own the next sample
    uint known = state.check >> 30u; // flags of the best candidate
    state.check &= 0x3fffffffu;
    for (uint work = 0u; state.next < state.end && (work < BUDGET || is_owner); ++work) {
        if (target != NONE) {
            enter(target);
            target = NONE;
            stands = true;
        }
        // As long as walks succeed, the tree is not searched. Rays wait until all of the subgroup stand in the mesh, and
        // then walk together; to iso-surfaces, walks are too short for that.
        bool walks = ISO != 0u || subgroupAll(stands);
        walk(g, walks, work, stands, is_owner);
        uint leaf = NONE;
#ifndef BINARY_TREE
        if (state.next < state.end && is_to_look()) look(g, stands);
        if (!stands) pass_empty(g, work, leaf);
#endif
        if (stands || state.next >= state.end || is_to_look() || work >= BUDGET) continue;
        leave();
        vec3 at = sample_at(view, origin, direction, state.next);
        vec3 x = normalise(g, at);
        uint owner = NONE;
        // Outside of the bounds there is nothing to find.
        if (all(greaterThanEqual(x, vec3(0.0))) && all(lessThanEqual(x, g.extent.xyz))) {
            OwnerSearch search = no_search();
            if (state.cursor != 0u) search = OwnerSearch(state.cursor, best_of(state.tet, known, state.smallest));
#ifdef BINARY_TREE
            bool ended = find_owner(search, g, at, x, 0.0, work, BUDGET, owner);
#else
            bool ended = find_owner_in(search, g, leaf, at, x, 0.0, work, BUDGET, owner);
#endif
            state.cursor = search.cursor;
            state.tet = search.best.owner;
            known = best_bits(search.best);
            state.smallest = search.best.smallest;
            if (!ended) break;
        }
        target = owner;
        is_owner = owner != NONE;
        if (!is_owner) pass_by(); // after a gap, the structure is searched first
    }
    if (ahead > 1u) state.check = state.next; // `ahead` is not stored: the tree is asked again
    state.check |= known << 30u;
    if (state.cursor == 0u) state.tet = stands ? stand.t : NONE;
}

void main() {
    uint i = item_index();
    uint unfinished = 0u;
    samples = found = skipped = 0u;
    plan = frames.at[0].plan;
    uvec2 pixel;
    bool met = i < status.at[0].met && states.at[i].next < states.at[i].end;
    if (met && pixel_of(states.at[i].item, uvec2(plan.size[0], plan.size[1]), pixel)) {
        view = frames.at[0].view;
        state = states.at[i];
        uint place = pixel.y * plan.size[0] + pixel.x;
        sum = colors.at[place];
        begin_ray(uvec2(pixel.x, plan.row + pixel.y), place);
        march(grid.at[0]);
        unfinished = uint(state.next < state.end);
        states.at[i] = state;
        colors.at[place] = sum;
    }
    ADD_TO_COUNTER(status.at[0].samples, samples)
    ADD_TO_COUNTER(status.at[0].found, found)
    ADD_TO_COUNTER(status.at[0].skipped, skipped)
    unfinished = subgroupAdd(unfinished);
    if (subgroupElect() && unfinished > 0u) atomicAdd(status.at[0].unfinished, unfinished);
}
