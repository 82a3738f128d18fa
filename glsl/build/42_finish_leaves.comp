#version 460
// Leaves 2 (Alg. 1): writes the box of every leaf, where boxes are stored, from the code of its last entry; the
// flag of leaves outside of the mesh (see src/reference/leaves.rs); the mask of each leaf's octants; statistics, and the
// length of the longest list.
// Where cells are MARKED (Lists::Boundary), the mark of a leaf's cell is its flag.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/boxes.glsl"
#include "shared/assign.glsl"
#include "shared/separate.glsl"
layout(constant_id = 2) const uint BOXES = 0;
layout(constant_id = 3) const uint MARKED = 0;
NO_SCALARS(11)
GRID(0, READ_WRITE)
BUFFER(1, readonly, uint, codes)
BUFFER(2, readonly, uint, po)
BUFFER(3, READ_WRITE, uint, flags)
BUFFER(4, READ_WRITE, BuildStatus, status)
BUFFER(5, writeonly, float, boxes) // 6 per node: lo, hi
BUFFER(6, readonly, uint, p)
RECORDS(7, uvec4, cells)
RECORDS(8, vec4, vertices)
BUFFER(9, readonly, uint, marks)
BUFFER(10, READ_WRITE, uint, masks) // zeroed; one byte per node
#include "shared/marks.glsl"
#include "shared/quarters.glsl"
#include "shared/vertices.glsl"

const uint MAX_TOUCH_TESTS = 16u; // Entries of a leaf without boundary tetrahedra that are tested for touching its cell.
const uint MAX_LIST_FOR_OCTANTS = 16384u; // Leaves with longer lists get a mask of all octants.

// Whether one of the first MAX_TOUCH_TESTS tetrahedra of a leaf touches its cell.
bool touched(Grid g, uint begin, uint end, uint code) {
    CellShape cell = cell_shape(g, g.level, unmorton(code));
    vec3 h = cell.half_size;
    vec3 axes[3] = vec3[3](vec3(h.x, 0.0, 0.0), vec3(0.0, h.y, 0.0), vec3(0.0, 0.0, h.z));
    for (uint i = begin; i < min(end, begin + MAX_TOUCH_TESTS); ++i) {
        uvec4 ids = words(cells.at[p.at[i]]);
        Tet t = load_tet(ids);
        vec3 v[4];
        for (uint k = 0u; k < 4u; ++k) v[k] = difference(t.v[k], cell.centre);
        if (box_touches(v, axes, vec3(0.0))) return true;
    }
    return false;
}

// The octants that the entries of a leaf are near, for every invocation that `asks`. The whole subgroup takes one list
// after the other, so that a long list does not become a long loop.
uint octants(Grid g, bool asks, uint begin, uint end) {
    uint mask = 0u;
    while (subgroupAny(asks)) {
        bool turn = gl_SubgroupInvocationID == subgroupMin(asks ? gl_SubgroupInvocationID : NONE);
        uint first = subgroupMax(turn ? begin : 0u), last = subgroupMax(turn ? end : 0u), near = 0u;
        for (; first < last && near != ALL_OCTANTS; first += gl_SubgroupSize) {
            uint i = first + gl_SubgroupInvocationID;
            near = subgroupOr(near | (i < last ? octants_near(g, p.at[i]) : 0u));
        }
        if (turn) mask = near;
        asks = asks && !turn;
    }
    return mask;
}

void main() {
    uint i = item_index();
    uint entries = 0u, flagged = 0u, node = 0u, begin = 0u, end = 0u;
    Grid g = grid.at[0];
    bool is_leaf = i < status.at[0].leaves && status.at[0].overflow == 0u;
    if (is_leaf) {
        node = status.at[0].internal + i;
        begin = po.at[i];
        end = po.at[i + 1u];
        entries = end - begin;
        bool flag;
        if (MARKED != 0u) {
            flag = entries > 0u && is_marked(g.level, unmorton(codes.at[end - 1u]));
        } else {
            flagged = flags.at[node >> 5u] >> (node & 31u) & 1u;
            flag = flagged == 0u && entries > 0u && !touched(g, begin, end, codes.at[end - 1u]);
        }
        if (flag) {
            atomicOr(flags.at[node >> 5u], 1u << (node & 31u));
            flagged = 1u;
        }
        if (BOXES != 0u) {
            vec3 lo, hi;
            cell_box(g, g.level, end == 0u ? 0u : codes.at[end - 1u], lo, hi);
            for (uint c = 0u; c < 3u; ++c) {
                boxes.at[6u * node + c] = lo[c];
                boxes.at[6u * node + 3u + c] = hi[c];
            }
        }
    }
    // All octants where entries have no quarters, in leaves within the mesh, and for very long lists.
    bool asks = g.ids != NONE && flagged != 0u && entries <= MAX_LIST_FOR_OCTANTS;
    uint mask = octants(g, asks, begin, end);
    if (!asks && entries > 0u) mask = ALL_OCTANTS;
    if (is_leaf) atomicOr(masks.at[node >> 2u], mask << (8u * (node & 3u)));
    entries = subgroupMax(entries);
    flagged = subgroupAdd(flagged);
    if (subgroupElect()) {
        if (entries > 0u) {
            atomicMax(status.at[0].longest_leaf, entries);
            atomicMax(grid.at[0].longest, entries);
        }
        if (flagged > 0u) atomicAdd(status.at[0].boundary_leaves, flagged);
    }
}
