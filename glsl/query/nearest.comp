#version 460
// The place of the surface that is closest to a point: of the tetrahedra with faces that have no neighbour, the one whose
// such face has the smallest squared distance (ties: lowest id), at most `within` away, among the lists of the boundary
// leaves in the cells asked for. A descent to a close leaf gives a first bound; the leaves within it are then visited in
// Morton order. Twin of src/reference/nearest.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/tree_buffers.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/separate.glsl"
#include "shared/centre.glsl"
#include "shared/node.glsl"
layout(constant_id = 2) const uint FRESH = 1;     // whether the search begins
layout(constant_id = 3) const uint BUDGET = 1024; // nodes and tetrahedra per point and dispatch
layout(constant_id = 4) const uint ORDERED = 0;   // whether points are taken in a given order
ARGUMENTS(13)
    uint count;
    uint stride; // floats from one point to the next
    float within;
    uint first_cell;
    uint last_cell;
END_ARGUMENTS
TREE(0)
RECORDS(6, uvec4, cells)
RECORDS(7, vec4, vertices)
RECORDS(8, uvec4, neighbours)
BUFFER(9, readonly, float, points)
BUFFER16(10, READ_WRITE, NearState, states)
BUFFER(11, readonly, uint, order) // with ORDERED, the point of each place
BUFFER(12, READ_WRITE, uint, unfinished)
#include "shared/vertices.glsl"
#include "shared/tree.glsl"
#include "shared/quarters.glsl"
#include "shared/boundary_node.glsl"
#include "shared/points.glsl"
#include "shared/patch.glsl"

NearState state;
vec3 x; // the point in normalised coordinates

// Squared distance of a node's cell, scaled as that of a tetrahedron. Rounding never makes it larger than that of what
// its cell contains: it is reduced by about 2^-19 of the bounds per axis. Cells are those in normalised coordinates, by
// which tetrahedra are assigned, since their sides in units of the mesh are rounded by more where that is far from 0.
float node_square(Node node) {
    Grid g = grid.at[0];
    CellShape cell = cell_shape(g, node.level, unmorton(node.code));
    precise vec3 apart = abs(difference(cell.centre, x)) - cell.half_size;
    precise vec3 d = max(apart * two_to(-21) - 2.0, vec3(0.0));
    return dot_product(d, d);
}

bool walk_ended = false;
uvec3 lo, hi;
bool enters(Node node) { return is_boundary_node(node.index) && node_square(node) <= state.square; }
#include "shared/leaf_walk.glsl"

// Keeps the closest of the entries [begin, end).
void measure(uint begin, uint end) {
    for (uint e = begin; e < end; ++e) {
        uint t = listed_tet(e);
        uvec4 beside = words(neighbours.at[t]);
        if (all(notEqual(beside, uvec4(NONE)))) continue;
        Patch part = patch_of(t, beside, x);
        if (box_square(part.v) > state.square) continue;
        vec4 unused;
        float square = closest_on(part.v, part.faces, unused);
        if (square < state.square || (square == state.square && t < state.owner)) {
            state.square = square;
            state.owner = t;
        }
    }
}

// Descends to a leaf close to the point, each time into the closest child with surface in it.
void begin_close(uint level) {
    Node node = Node(0u, 0u, 0u);
    while (node.level < level) {
        uint mask = child_mask(node.index);
        float least = 3.40282347e38;
        Node closest_child = node;
        for (uint digit = 0u; digit < 8u; ++digit) {
            if ((mask >> digit & 1u) == 0u) continue;
            Node child = Node(child_of(node.index, mask, digit), node.level + 1u, node.code << 3 | digit);
            uvec3 cell = unmorton(child.code);
            uint shift = MAX_LEVEL - child.level;
            bool asked = all(lessThanEqual(lo >> shift, cell)) && all(lessThanEqual(cell, hi >> shift));
            float square = node_square(child);
            if (asked && is_boundary_node(child.index) && square < least) {
                least = square;
                closest_child = child;
            }
        }
        if (closest_child.index == node.index) return;
        node = closest_child;
    }
    uvec2 range = entry_range(node.index);
    measure(range.x, min(range.y, range.x + BUDGET));
}

// Goes on with the search. Returns true once it has ended.
bool measure_all(uint level) {
    LeafWalk at = walk_from(level, state.code);
    uint leaf = WALK_PAUSED;
    for (uint work = 0u; work < BUDGET;) {
        leaf = next_leaf(at, level, work, BUDGET);
        if (at.code != state.code) state.entry = 0u; // the leaf that had been begun is too far away by now
        if (leaf >= WALK_PAUSED) break;
        uvec2 range = entry_range(leaf);
        uint from = range.x + state.entry, to = min(range.y, from + max(BUDGET - min(work, BUDGET), 1u));
        measure(from, to);
        work += to - from;
        state.entry = to - range.x;
        if (to < range.y) break;
        state.entry = 0u;
        leaf = walk_past(at, level, level) ? WALK_PAUSED : WALK_DONE;
        if (leaf == WALK_DONE) break;
    }
    state.code = leaf == WALK_DONE ? NONE : at.code;
    return leaf == WALK_DONE;
}

// Begins or resumes the search for a point, if it has not ended before. Returns true if it needs another round.
bool search(uint i) {
    Grid g = grid.at[0];
    vec3 at = point(i, stride);
    if (FRESH != 0u) {
        precise float reach = min(within * g.scale, 1.0) * two_to(19);
        precise float square = reach * reach;
        bool asked = near_bounds(g, at) && !is_empty_tree(g.level) && is_boundary_node(0u) && within >= 0.0;
        state = NearState(asked ? 0u : NONE, 0u, NONE, square);
    } else {
        state = states.at[i];
        if (state.code == NONE) return false;
    }
    bool ended = state.code == NONE;
    if (!ended) {
        x = normalise(g, at);
        lo = unpack_cell(first_cell);
        hi = unpack_cell(last_cell);
        if (FRESH != 0u) begin_close(g.level);
        ended = measure_all(g.level);
    }
    if (ended && state.owner == NONE) state.square = uintBitsToFloat(0x7f800000u);
    states.at[i] = state;
    return !ended;
}

void main() {
    uint i = item_index(), left = 0u;
    if (i < count) left = uint(search(ORDERED == 0u ? i : order.at[i]));
    left = subgroupAdd(left);
    if (subgroupElect() && left > 0u) atomicAdd(unfinished.at[0], left);
}
