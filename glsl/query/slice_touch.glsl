// Slicing (SPEC 3.4), second part: for the listed voxels, whose centre lies in no tetrahedron, finds the boundary
// tetrahedron that touches the box and is closest to the centre. The octree is searched in its boundary leaves, in
// Morton order; the binary tree in the nodes above boundary tetrahedra, in the order of places. Twin of
// src/reference/slice.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/structure.glsl"
#include "shared/node.glsl"
#include "shared/cell_range.glsl"
#include "shared/separate.glsl"
#include "shared/voxels.glsl"
#ifdef BINARY_TREE
ARGUMENTS(7 + STRUCTURE_BUFFERS)
#else
ARGUMENTS(8 + STRUCTURE_BUFFERS)
#endif
    uint budget; // nodes and tetrahedra per voxel and dispatch
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, uvec4, cells)
RECORDS(2, vec4, vertices)
BUFFER16(3, readonly, SliceUniforms, plans)
BUFFER(4, READ_WRITE, TouchState, states)
BUFFER(5, READ_WRITE, uint, answers)
BUFFER(6, READ_WRITE, SliceStatus, status)
STRUCTURE(7)
#ifndef BINARY_TREE
BUFFER(7 + STRUCTURE_BUFFERS, readonly, uint, boundary)
#endif
#include "shared/vertices.glsl"
#include "shared/boundary_tet.glsl"

TouchState state;
vec3 x;    // centre of the voxel in normalised coordinates
vec3 h[3]; // half axes of its box

// Keeps t if it touches the box and is the closest one so far; of two equally close ones, the lower id.
void measure(uint t) {
    uvec4 ids = words(cells.at[t]);
    Tet tet = load_tet(ids);
    vec3 v[4] = vec3[4](difference(tet.v[0], x), difference(tet.v[1], x), difference(tet.v[2], x), difference(tet.v[3], x));
    if (box_square(v) > state.square || !box_touches(v, h, touch_slack(v, h))) return;
    vec4 unused;
    float square = closest(v, unused);
    if (square < state.square || (square == state.square && t < state.owner)) {
        state.square = square;
        state.owner = t;
    }
}

#ifdef BINARY_TREE
#include "shared/binary_tree.glsl"

bool enters(uint reference) {
    if ((reference & BINARY_BOUNDARY) == 0u) return false;
    vec3 lo, hi;
    box_of(reference, lo, hi);
    vec3 v[4] = vec3[4](difference(lo, x), difference(hi, x), difference(lo, x), difference(hi, x));
    // Twice the slack of `box_touches`, which grows with the size of a tetrahedron.
    precise vec3 reach = ((abs(h[0]) + abs(h[1])) + abs(h[2])) + 2.0 * touch_slack(v, h);
    return all(lessThanEqual(v[0], reach)) && all(lessThanEqual(-reach, v[1])) && box_square(v) <= state.square;
}
#include "shared/binary_walk.glsl"

// Continues with a voxel. Returns true once it is done. Here, `code` of the state is a place.
bool measure_all(Grid g, vec3 centre, vec3 reach) {
    uvec3 lo, hi;
    if (!reached_cells(g, centre, reach, lo, hi)) return true;
    BinaryWalk walk = binary_walk_from(state.code);
    uint limit = binary_budget(0u, budget), place = WALK_PAUSED;
    for (uint work = 0u; work < limit; ++work) {
        place = next_place(walk, work, limit);
        if (place >= WALK_PAUSED) break;
        measure(ids.at[place]);
    }
    state.code = resume_place(walk);
    return place == WALK_DONE || state.code == NONE;
}
#else
#include "shared/tree.glsl"
#include "shared/owner_list.glsl"
#include "shared/box_slab.glsl"

bool walk_ended = false;
uvec3 lo, hi;
uint leaf_level;
bool enters(Node node);
#include "shared/leaf_walk.glsl"

// The mask of a leaf holds the octants that its tetrahedra are near.
bool enters(Node node) {
    if (!is_boundary_node(node.index)) return false;
    return node.level < leaf_level || leaf_level == MAX_LEVEL || (child_mask(node.index) & octants_met(node.level, node.code)) != 0u;
}

// Of the entries in `left`, from `begin` on, those that are boundary tetrahedra, one bit each.
uint at_boundary(uint begin, uint left) {
    uint found = 0u;
    for (; left != 0u; left &= left - 1u) {
        uint t = listed_tet(begin + findLSB(left));
        if (is_boundary_tet(t)) found |= left & -left;
    }
    return found;
}

// What the entries to be measured in a leaf must satisfy: their quantized box meets the cells [lo, hi], and they are
// near the quarter of the leaf's cell that these cells meet. Along an axis where the cells meet several quarters,
// quarters are not tested.
Sought sought_in(Grid g, uint code) {
    uvec3 reach = reach_of(g, 1u), met = quarters_met(g, code, lo, hi);
    met = mix(uvec3(0u), met, equal(met & met - 1u, uvec3(0u)));
    return Sought(x, lo - min(lo, reach), hi + reach, in_entry(g, met));
}

// Continues with a voxel. Returns true once it is done.
bool measure_all(Grid g, vec3 centre, vec3 reach) {
    if (!reached_cells(g, centre, reach, lo, hi) || !is_boundary_node(0u)) return true;
    // Outside of the cells of a block, its lists and flags are not those of the whole mesh.
    lo = max(lo, unpack_cell(plans.at[0].first_cell));
    hi = min(hi, unpack_cell(plans.at[0].last_cell));
    if (any(greaterThan(lo, hi))) return true;
    leaf_level = g.level;
    vec3 scale = slab_scale(g);
    LeafWalk at = walk_from(g.level, state.code);
    uint leaf = WALK_PAUSED;
    for (uint work = 0u; work < budget;) {
        leaf = next_leaf(at, g.level, work, budget);
        if (leaf >= WALK_PAUSED) break;
        uvec2 range = entry_range(leaf);
        // Then nothing of the list has been tested before.
        if (g.slabs != 0u && is_box_outside(leaf_slab(g, leaf), slab_cell(g, scale, unmorton(at.code)), x, h)) range.x = range.y;
        uint from = range.x + state.entry, to = min(range.y, from + max(budget - min(work, budget), 1u));
        Sought s = sought_in(g, at.code);
        for (uint e = from; e < to; e += 32u) {
            for (uint near = near_of(e, at_boundary(e, in_quarters(e, to, s)), s); near != 0u; near &= near - 1u) measure(listed_tet(e + findLSB(near)));
        }
        work += to - from;
        state.entry = to - range.x;
        if (to < range.y) break;
        state.entry = 0u;
        leaf = walk_past(at, g.level, g.level) ? WALK_PAUSED : WALK_DONE;
        if (leaf == WALK_DONE) break;
    }
    state.code = at.code;
    return leaf == WALK_DONE;
}
#endif

void main() {
    uint i = item_index();
    uint unfinished = 0u;
    SliceUniforms plan = plans.at[0];
    if (i < plan.listed) {
        state = states.at[i];
        uint voxel = state.voxel;
        if (answers.at[voxel] == SLICE_PENDING) {
            Grid g = grid.at[0];
            vec3 centre = voxel_centre(plan, voxel);
            x = normalise(g, centre);
            h = vec3[3](plan.half0.xyz, plan.half1.xyz, plan.half2.xyz);
            if (measure_all(g, centre, plan.reach.xyz)) {
                answers.at[voxel] = state.owner == NONE ? NONE : state.owner | SLICE_TOUCHED;
            } else {
                states.at[i] = state;
                unfinished = 1u;
            }
        }
    }
    unfinished = subgroupAdd(unfinished);
    if (subgroupElect() && unfinished > 0u) atomicAdd(status.at[0].touching, unfinished);
}
