// Ray intervals (SPEC 3.3): the interval of a ray spans from the first to the last boundary leaf that it meets or, in
// the binary tree, box of a boundary tetrahedron. Where some values are transparent, the marks of visible nodes replace
// the boundary flags. In a block of a mesh (PART), only samples in the block's cells count, and rays continue from
// their state after the blocks in front of it. Twin of src/reference/volume/interval.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/structure.glsl"
#include "shared/node.glsl"
#include "shared/boxes.glsl"
#include "shared/frame.glsl"
#include "shared/rays.glsl"
layout(constant_id = 2) const uint PART = 0;
layout(constant_id = 3) const uint ISO = 0;
layout(constant_id = 4) const uint DEPTH = 0;
const uint STACK = 8u; // nodes on the short stack of the traversal
ARGUMENTS(8 + STRUCTURE_BUFFERS)
    uint items; // pixels in whole blocks
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, uvec4, cells)    // for the binary tree only
RECORDS(2, vec4, vertices)  // for the binary tree only
BUFFER16(3, readonly, Frame, frames)
BUFFER(4, READ_WRITE, RayState, states)
BUFFER16(5, READ_WRITE, vec4, colors)
BUFFER(6, readonly, float, depths) // row by row, as the colours
BUFFER(7, READ_WRITE, RenderStatus, status)
STRUCTURE(8)

Grid g;
ViewUniforms view;
DrawUniforms plan;
vec3 origin, inverse_direction;
float first, last;
float entered, left;
#include "shared/clip.glsl"

// Where the ray enters and leaves the slabs between the sides of a box.
struct Slabs {
    vec3 near;
    vec3 far;
};

Slabs slabs_of(vec3 lo, vec3 hi) {
    precise vec3 a = ((lo - plan.slack.xyz) - origin) * inverse_direction;
    precise vec3 b = ((hi + plan.slack.xyz) - origin) * inverse_direction;
    return Slabs(min(a, b), max(a, b));
}

// Whether the ray meets a box, and where it enters and leaves it.
bool hit(Slabs s) {
    entered = max(max(max(0.0, s.near.x), s.near.y), s.near.z);
    left = min(min(min(3.40282347e38, s.far.x), s.far.y), s.far.z);
    return entered <= left;
}

bool hit(vec3 lo, vec3 hi) { return hit(slabs_of(lo, hi)); }

void extend() {
    first = min(first, entered);
    last = max(last, left);
}

// Whether the interval already spans the box of the last `hit`, so that nothing in that box can extend it.
bool is_spanned() { return first <= entered && left <= last; }

#ifdef BINARY_TREE
#include "shared/binary_tree.glsl"
const uint MAX_VISITS = 24000u; // loop limit

// x in the units of the mesh, but for rounding, which the slack of the boxes covers.
vec3 in_units(vec3 x) {
    precise vec3 unit = x * two_to(-40);
    precise vec3 r = g.lo.xyz + unit * uintBitsToFloat((254u << 23) - floatBitsToUint(g.scale));
    return r;
}

bool enters(uint reference) {
    if ((reference & BINARY_BOUNDARY) == 0u) return false;
    vec3 lo, hi;
    box_of(reference, lo, hi);
    return hit(in_units(lo), in_units(hi)) && !is_spanned();
}
#include "shared/binary_walk.glsl"

bool starts_within() { return true; }

bool visit_all() {
    BinaryWalk walk = binary_walk_from(0u);
    uint place = 0u;
    for (uint work = 0u; work < MAX_VISITS; ++work) {
        place = next_place(walk, work, MAX_VISITS);
        if (place >= WALK_PAUSED) break;
        extend(); // by the box that `enters` tested last
    }
    return place == WALK_DONE;
}
#else
#include "shared/tree.glsl"

// The lower and the upper children of the current node along each axis: they share three planes per axis.
Slabs lower, upper;
uint marked_from, marked; // flags of these children, one bit each, starting with node marked_from

void enter_node(Node node, uint mask, uint first_child) {
    uint word = first_child >> 5u, shift = first_child & 31u;
    marked_from = first_child;
    marked = flags.at[word] >> shift;
    if (shift + bitCount(mask) > 32u) marked |= flags.at[word + 1u] << (32u - shift);
    uvec3 k = 2u * unmorton(node.code);
    vec3 middle = cell_sides(g, node.level + 1u, k + 1u);
    lower = slabs_of(cell_sides(g, node.level + 1u, k), middle);
    upper = slabs_of(middle, cell_sides(g, node.level + 1u, k + 2u));
}
#define ENTER_NODE(node, mask, first_child) enter_node(node, mask, first_child)

bool meets(Node node) {
    if (node.level == 0u) return hit(g.lo.xyz, g.hi.xyz);
    bvec3 up = notEqual(uvec3(node.code >> 2u, node.code >> 1u, node.code) & 1u, uvec3(0u));
    return hit(Slabs(mix(lower.near, upper.near, up), mix(lower.far, upper.far, up)));
}

// The tree is traversed twice: first for the start of the interval, nearest nodes first, then (from_behind) for its
// end, farthest nodes first.
bool from_behind;
uint flip;
#define FLIP flip

bool extends() { return from_behind ? left > last : entered < first; }

bool visit_node(Node node) { return (marked >> (node.index - marked_from) & 1u) != 0u && meets(node) && extends(); }

bool keeps(Node node) {
    vec3 lo, hi;
    cell_box(g, node.level, node.code, lo, hi);
    return hit(lo, hi) && extends();
}
#define KEEPS(node) keeps(node)

bool visit_leaf(Node node) {
    extend(); // by the node tested last, this one
    return false;
}
#include "shared/traverse.glsl"

bool starts_within() { return find_leaf(g.level, quantize(g, origin)) != NONE; }

bool visit_all() {
    flip = uint(inverse_direction.x < 0.0) << 2 | uint(inverse_direction.y < 0.0) << 1 | uint(inverse_direction.z < 0.0);
    bool ended = true;
    [[dont_unroll]] for (uint side = 0u; side < 2u && ended && (side == 0u || first <= last); ++side) {
        from_behind = side == 1u;
        marked_from = 0u; // the root
        marked = flags.at[0];
        ended = traverse(g.level);
        flip ^= 7u;
    }
    return ended;
}
#endif

// The first of the samples [k, end) that has reached the block's cells or, with `past`, has left them behind. Cells are
// monotone along a ray, so the samples between these two are the block's.
uint first_sample(vec3 direction, uint k, uint end, bool past) {
    uvec3 lo = unpack_cell(plan.first_cell), hi = unpack_cell(plan.last_cell);
    bvec3 up = greaterThanEqual(direction, vec3(0.0));
    while (k < end) {
        uint middle = k + (end - k) / 2u;
        uvec3 q = quantize(g, sample_at(view, origin, direction, middle));
        bvec3 below = lessThan(q, lo), above = lessThan(hi, q);
        bool reached = past ? any(mix(below, above, up)) : !any(mix(above, below, up));
        if (reached) end = middle;
        else k = middle + 1u;
    }
    return k;
}

// The state with which a ray continues in a block that it meets in the samples of `state`, where `before` is its state
// after the blocks in front.
RayState go_on(RayState state, RayState before, vec3 direction) {
    state.next = first_sample(direction, max(state.next, before.next), state.end, false);
    state.end = first_sample(direction, state.next, state.end, true);
    bool met = state.next < state.end;
    if (!met) state.next = state.end = before.next;
    state.last = state.next == before.next ? before.last : NONE;
    state.last_at = before.last_at;
    return state;
}

// Takes places in the march for the rays of this subgroup, of which some meet the mesh. They stay together, since rays
// side by side read the same tetrahedra.
uint place_in_march(bool is_ray) {
    uvec4 rays = subgroupBallot(is_ray); // of those that arrive together: that all do is usual, but not promised
    uint first = 0u;
    if (subgroupElect()) first = atomicAdd(status.at[0].met, subgroupBallotBitCount(rays));
    return subgroupBroadcastFirst(first) + subgroupBallotExclusiveBitCount(rays);
}

void main() {
    uint i = item_index();
    view = frames.at[0].view;
    plan = frames.at[0].plan;
    uvec2 pixel, size = uvec2(plan.size[0], plan.size[1]);
    RayState state = RayState(0u, 0u, 0u, NONE, SMALLEST_FLOAT, NONE, 0.0, 0u, i);
    if (i < items && pixel_of(i, size, pixel)) {
        uint place = pixel.y * size.x + pixel.x;
        bool opaque = PART != 0u && colors.at[place].w >= view.termination;
        if (PART == 0u) colors.at[place] = vec4(0.0);
        g = grid.at[0];
        vec3 direction;
        uvec2 at = uvec2(pixel.x, plan.row + pixel.y);
        make_ray(view, at, origin, direction);
        inverse_direction = inverse_of(direction);
        first = 3.40282347e38;
        last = -1.0;
        bool within = all(lessThanEqual(g.lo.xyz, origin)) && all(lessThanEqual(origin, g.hi.xyz));
        if (within && starts_within()) first = last = 0.0;
        // If there are too many nodes to visit, the interval spans the bounds, which contain every leaf.
        if (!opaque && !visit_all() && hit(g.lo.xyz, g.hi.xyz)) extend();
        if (first <= last && !opaque) {
            precise float begin = floor(clamp(first * view.inverse_step - 1.5, 0.0, MAX_SAMPLES));
            precise float end = floor(clamp(last * view.inverse_step + 1.5, 0.0, MAX_SAMPLES));
            // Sample k lies k + 1/2 steps from the origin. Iso-surfaces also lie between samples, up to a clip.
            uint cut;
            vec2 kept = kept_stretch(origin, direction, limit_of(at, place), cut);
            float more = ISO != 0u ? 1.0 : 0.0;
            precise float first_kept = ceil(kept.x - 0.5) - more, behind_kept = floor(kept.y - 0.5) + 1.0 + more;
            state.next = uint(max(begin, first_kept));
            state.end = max(uint(max(min(end, behind_kept), 0.0)), state.next);
        }
        if (PART != 0u) state = go_on(state, states.at[i], direction);
    }
    // Between blocks of a mesh, every ray has a place of its own.
    uint place = i;
    if (PART == 0u) {
        if (!subgroupAny(state.next < state.end)) return;
        place = place_in_march(i < items);
    }
    if (i < items) states.at[place] = state;
}
