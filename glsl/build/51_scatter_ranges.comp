#version 460
// Ranges of a field, 1 of 3: every valid tetrahedron with finite values adds the range of its values to the nodes that
// its quantized box meets on the deepest level where the box has at most SPAN cells along each axis, so that large
// tetrahedra do not become long loops. Twin of src/reference/ranges.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/ordered.glsl"
layout(constant_id = 2) const uint ON_CELLS = 0;
ARGUMENTS(9)
    uint tets;
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, vec4, vertices)
RECORDS(2, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, readonly, uint, field) // one float per point or tetrahedron, as bits
BUFFER(5, readonly, uint, masks)
BUFFER(6, readonly, uint, co)
BUFFER(7, readonly, BuildStatus, status)
// Two keys per node, the lower end complemented, so that both only grow. Zeroed.
BUFFER(8, READ_WRITE, uint, ranges)
#include "shared/cells.glsl"
#include "shared/children.glsl"

const uint SPAN = 4u; // Most nodes along an axis to which a tetrahedron adds its values.

bool is_finite(uint bits) { return (bits & 0x7f800000u) != 0x7f800000u; }

void main() {
    uint t = item_index();
    if (t >= tets || is_bad(t) || status.at[0].overflow != 0u) return;
    uvec4 ids = words(cells.at[t]);
    uvec4 values = ON_CELLS != 0u ? uvec4(field.at[t]) : uvec4(field.at[ids.x], field.at[ids.y], field.at[ids.z], field.at[ids.w]);
    uint lo = 0u, hi = 0u;
    for (uint i = 0u; i < 4u; ++i) {
        if (!is_finite(values[i])) return; // no point of it has a value
        lo = max(lo, ~ordered(values[i]));
        hi = max(hi, ordered(values[i]));
    }
    Grid g = grid.at[0];
    CellBox finest = finest_box(t), box = coarser(finest, g.level);
    uint level = g.level;
    while (max(max(box.size.x, box.size.y), box.size.z) > SPAN) box = coarser(finest, --level);
    // The smallest node that contains the whole box.
    uint first = morton(box.lo), last = morton(box.lo + box.size - 1u);
    uint from = first == last ? level : level - 1u - uint(findMSB(first ^ last)) / 3u;
    uint top = find_node(0u, 0u, from, first >> (3u * (level - from)));
    if (top == NONE) return;
    uvec3 at = box.lo;
    for (uint n = box.size.x * box.size.y * box.size.z; n > 0u; --n) {
        uint node = find_node(top, from, level, morton(at));
        at = next_candidate(box, at);
        if (node == NONE) continue;
        // A read spares those that add nothing to the node an atomic operation.
        if (ranges.at[2u * node] < lo) atomicMax(ranges.at[2u * node], lo);
        if (ranges.at[2u * node + 1u] < hi) atomicMax(ranges.at[2u * node + 1u], hi);
    }
}
