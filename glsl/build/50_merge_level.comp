#version 460
// Computes one level of internal nodes from their children (Alg. 2): boundary flag, child mask, and the union of the
// boxes where boxes are stored. Dispatched once per level, from the level above the leaves up to the root, with a
// barrier between levels.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
layout(constant_id = 2) const uint BOXES = 0;
ARGUMENTS(8)
    uint level;
END_ARGUMENTS
GRID(0, readonly)
BUFFER(1, readonly, BuildStatus, status)
BUFFER(2, readonly, uint, codes)
BUFFER(3, readonly, uint, po)
BUFFER(4, readonly, uint, co)
BUFFER(5, READ_WRITE, uint, flags)
BUFFER(6, READ_WRITE, uint, masks) // zeroed; one byte per node
BUFFER(7, READ_WRITE, float, boxes)

void main() {
    uint first = level == 0u ? 0u : status.at[0].levels[level - 1u];
    uint node = first + item_index();
    if (level >= status.at[0].level || node >= status.at[0].levels[level] || status.at[0].overflow != 0u) return;
    uint begin = co.at[node] + 1u, end = co.at[node + 1u];
    Grid g = grid.at[0];
    uint shift = 3u * (g.level - 1u - level);
    uint flag = 0u, mask = 0u;
    vec3 lo = vec3(0.0), hi = vec3(0.0);
    // The last leaf below each child; if there are fewer than eight, the last one stands for the others. All children go down
    // together, so that their loads do not wait for each other.
    uint leaf[8];
    [[unroll]] for (uint k = 0u; k < 8u; ++k) leaf[k] = min(begin + k, end);
    for (uint below = level + 1u; below < g.level; ++below) {
        [[unroll]] for (uint k = 0u; k < 8u; ++k) leaf[k] = co.at[leaf[k] + 1u];
    }
    [[unroll]] for (uint k = 0u; k < 8u; ++k) leaf[k] = po.at[leaf[k] - g.first_leaf + 1u];
    [[unroll]] for (uint k = 0u; k < 8u; ++k) mask |= 1u << (codes.at[leaf[k] - 1u] >> shift & 7u);
    for (uint child = begin; child <= end; ++child) {
        flag |= flags.at[child >> 5u] >> (child & 31u) & 1u;
        if (BOXES != 0u) {
            for (uint c = 0u; c < 3u; ++c) {
                float least = boxes.at[6u * child + c], most = boxes.at[6u * child + 3u + c];
                lo[c] = child == begin ? least : min(lo[c], least);
                hi[c] = child == begin ? most : max(hi[c], most);
            }
        }
    }
    for (uint c = 0u; BOXES != 0u && c < 3u; ++c) {
        boxes.at[6u * node + c] = lo[c];
        boxes.at[6u * node + 3u + c] = hi[c];
    }
    if (flag != 0u) atomicOr(flags.at[node >> 5u], 1u << (node & 31u));
    atomicOr(masks.at[node >> 2u], mask << (8u * (node & 3u)));
}
