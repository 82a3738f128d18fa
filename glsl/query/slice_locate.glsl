// Slicing (SPEC 3.4), first part: finds the tetrahedron that contains the centre of each voxel, and the value of the
// field there. An invocation takes a run of voxels of one column. It searches for each voxel in the tetrahedron of the
// one before, then by a short walk across faces, before it searches the structure. Neighbouring invocations take
// neighbouring runs, so that they are in the same tetrahedra and leave them together. Twin of src/reference/slice.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/structure.glsl"
#include "shared/voxels.glsl"
layout(constant_id = 2) const uint PART = 0; // not 0: centres outside of the plan's cells belong to another block
layout(constant_id = 3) const uint FIELD = 0; // not 0: there is a field
layout(constant_id = 5) const uint ON_CELLS = 0;
const uint WALK = 6u; // Most steps of a walk across faces before the structure is searched.
const uint LEAP = 8u; // voxels of a run that one test can find to be empty
// Entries, nodes and tetrahedra of walks that one run may test in one dispatch, roughly. A test takes up to five passes
// of loops, and some drivers end the loops of an invocation after 65,535 passes in all.
const uint BUDGET = 8192u;
// Default tolerance: how far below 0 the smallest barycentric coordinate of a point's owner may be in a boundary leaf
// (SPEC 3.1). Whatever the tolerance, it may also be as far as rounding can put a point that the owner contains, which is
// farther in thin tetrahedra.
const float TOLERANCE = 1e-5;
ARGUMENTS(10 + STRUCTURE_BUFFERS)
    uint fresh; // not 0: nothing has been done yet
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, uvec4, cells)
RECORDS(2, vec4, vertices)
RECORDS(3, uvec4, neighbours)
BUFFER16(4, readonly, SliceUniforms, plans)
BUFFER(5, READ_WRITE, RunState, states)
BUFFER(6, writeonly, uint, answers) // owner, or SLICE_PENDING
BUFFER(7, READ_WRITE, SliceStatus, status) // zeroed
BUFFER(8, readonly, float, field)
BUFFER(9, writeonly, uint, values) // floats, by their bits: compilers may take it that no float is NaN
STRUCTURE(10)
#include "shared/structure_owner.glsl"
#include "shared/held.glsl"
#include "shared/part.glsl"

SliceUniforms plan;
RunState state;
uint column, line; // of the run: its place in a row, and its first voxel
uvec2 row;         // of the next voxel: its row in the layer, and the layer

// The tetrahedron that the run has reached, and the field at its corners.
Stand stand;
vec4 held;

// Nothing of the last tetrahedron is needed any more; see volume_march.glsl.
void leave() {
    stand = stand_nowhere();
    held = vec4(0.0);
}

void enter(uint t) {
    stand = stand_in(t);
    if (FIELD != 0u) held = field_in(stand);
}

// Steps through the face with the most negative weight. Returns false if that is not possible.
bool go_on(Sides sides) {
    Exchange e;
    if (!step_on(stand, sides, e)) return false;
    if (FIELD != 0u) held = field_behind(held, stand, e);
    return true;
}

// Writes the answer for the next voxel of the run, and the bits of its value.
void settle(uint answer, uint value) {
    uint voxel = line + state.next * plan.width;
    answers.at[voxel] = answer;
    if (FIELD != 0u && answer != SLICE_PENDING) values.at[voxel] = value;
    ++state.next;
    bool ends = ++row.x == plan.height;
    row = ends ? uvec2(0u, row.y + 1u) : row;
}

// Marks the next voxel as one whose box must be tested.
void wait() {
    ++state.waiting;
    settle(SLICE_PENDING, 0u);
}

// Settles the next voxel, whose centre lies in the stand.
void settle_inside(Sides sides) {
    state.hint = stand.t;
    ++state.inside;
    settle(stand.t, FIELD == 0u ? 0u : floatBitsToUint(value_of(held, barycentric(sides))));
}

#ifndef BINARY_TREE
#include "shared/cell_range.glsl"
#include "shared/box_slab.glsl"

// The finest-grid cells of the empty octree cell around the last voxel that was outside; none at first.
uvec3 empty_lo = uvec3(1u), empty_hi = uvec3(0u);

bool within_empty(uvec3 lo, uvec3 hi) { return all(lessThanEqual(empty_lo, lo)) && all(lessThanEqual(hi, empty_hi)); }

// Whether the voxel at `at` lies in the same empty cells as the one before.
bool is_still_empty(Grid g, vec3 at) {
    uvec3 lo, hi;
    return reached_cells(g, at, plan.reach.xyz, lo, hi) && within_empty(lo, hi);
}

// Whether the voxel at x, which meets the finest-grid cells [lo, hi], meets few leaves, and is beside their slabs.
bool is_beside_slabs(Grid g, vec3 x, uvec3 lo, uvec3 hi) {
    uint shift = MAX_LEVEL - g.level;
    uvec3 first = lo >> shift, last = hi >> shift;
    if (g.slabs == 0u || any(greaterThan(last - first, uvec3(1u)))) return false;
    vec3 scale = slab_scale(g), h[3] = vec3[3](plan.half0.xyz, plan.half1.xyz, plan.half2.xyz);
    for (uvec3 cell = first; cell.z <= last.z;) {
        uint leaf = find_node(0u, 0u, g.level, morton(cell));
        bool near = leaf != NONE && is_boundary_node(leaf);
        if (near && !is_box_outside(leaf_slab(g, leaf), slab_cell(g, scale, cell), x, h)) return false;
        bool row_ends = cell.x == last.x, layer_ends = row_ends && cell.y == last.y;
        cell = uvec3(row_ends ? first.x : cell.x + 1u, layer_ends ? first.y : cell.y + uint(row_ends), cell.z + uint(layer_ends));
    }
    return true;
}

// Whether nothing can touch the voxel at `at`, x in normalised coordinates, whose centre lies in no tetrahedron: it lies
// outside of the bounds, in one empty octree cell, or beside the slabs of its leaves.
bool is_empty(Grid g, vec3 at, vec3 x) {
    uvec3 lo, hi;
    if (!reached_cells(g, at, plan.reach.xyz, lo, hi)) return true;
    uvec3 cell = quantize(g, at);
    uint leaf = 0u, level = empty_level(g.level, morton(cell), 0u, leaf), shift = MAX_LEVEL - level;
    if (level > 0u) {
        empty_lo = cell >> shift << shift;
        empty_hi = empty_lo + (1u << shift) - 1u;
    }
    return (level > 0u && within_empty(lo, hi)) || is_beside_slabs(g, x, lo, hi);
}
#else
bool is_still_empty(Grid g, vec3 at) { return false; }
bool is_empty(Grid g, vec3 at, vec3 x) { return false; }
#endif

bool is_ours(Grid g, vec3 at) { return PART == 0u || in_part(plan.first_cell, plan.last_cell, quantize(g, at)); }

void main() {
    uint i = item_index();
    uint unfinished = 0u;
    plan = plans.at[0];
    if (i == 0u) status.at[0].refused = plan.refused;
    uvec2 lines = rows_of_run(plan.rows, plan.height, i / plan.width);
    if (lines.y > 0u) {
        Grid g = grid.at[0];
        state = RunState(0u, NONE, 0u, NONE, 0u, SMALLEST_FLOAT, 0u, 0u);
        if (fresh == 0u) state = states.at[i];
        uint count = lines.y;
        column = i % plan.width;
        line = lines.x * plan.width + column;
        row = voxel_row(plan, lines.x + state.next);
        while (plan.refused != 0u && state.next < count) settle(NONE, NAN);
        bool stands = state.hint != NONE && state.cursor == 0u;
        leave();
        if (stands) enter(state.hint);
        for (uint work = 0u; state.next < count && work < BUDGET; ++work) {
            // Voxel after voxel, as long as strides succeed: the structure is not searched, and mostly no other
            // tetrahedron is read. Walks are not cut short, so that owners do not depend on the budget.
            uint misses = 0u;
            for (; stands && state.next < count && (work < BUDGET || misses > 0u); ++work) {
                vec3 at = voxel_centre(plan, row_origin(plan, row), column);
                if (!is_ours(g, at)) break;
                vec3 x = normalise(g, at);
                Sides sides = sides_of(stand, x);
                if (!sides.near) {
                    stands = ++misses < WALK && go_on(sides);
                    if (stands) sides = sides_of(stand, x);
                }
                uint owner = stands ? owner_of(stand, sides, x) : NONE;
                if (owner != NONE) {
                    if (owner != stand.t) {
                        enter(owner);
                        sides = sides_of(stand, x);
                    }
                    settle_inside(sides);
                    misses = 0u;
                } else {
                    stands = stands && !sides.near;
                }
            }
            if (state.next >= count || work >= BUDGET) break;
            vec3 at = voxel_centre(plan, row_origin(plan, row), column);
            if (!is_ours(g, at)) {
                wait();
                continue;
            }
            if (is_still_empty(g, at)) {
                // If two voxels of a layer lie in the empty cells, so do those between them.
                uint leap = min(LEAP, min(count - state.next, plan.height - row.x));
                vec3 last = voxel_centre(plan, row_origin(plan, uvec2(row.x + leap - 1u, row.y)), column);
                if (!is_ours(g, last) || !is_still_empty(g, last)) leap = 1u;
                for (uint k = 0u; k < leap; ++k) settle(NONE, NAN);
                continue;
            }
            leave();
            vec3 x = normalise(g, at);
            OwnerSearch search = OwnerSearch(state.cursor, best_of(state.best, state.in_box, state.smallest));
            uint owner;
            bool ended = find_owner(search, g, at, x, TOLERANCE, work, BUDGET, owner);
            state.cursor = search.cursor;
            state.best = search.best.owner;
            state.in_box = best_bits(search.best);
            state.smallest = search.best.smallest;
            if (!ended) break;
            stands = owner != NONE;
            if (stands) {
                enter(owner);
                settle_inside(sides_of(stand, x));
            } else {
                state.hint = NONE;
                if (is_empty(g, at, x)) settle(NONE, NAN);
                else wait();
            }
        }
        unfinished = uint(state.next < count);
        states.at[i] = state;
    }
    unfinished = subgroupAdd(unfinished);
    if (subgroupElect() && unfinished > 0u) atomicAdd(status.at[0].locating, unfinished);
}
