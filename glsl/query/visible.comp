#version 460
// Finds the nodes in which something is visible: a value in one of the ranges that are drawn. Twin of `visible` in
// src/reference/ranges.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(4)
    uint drawn_ranges;
END_ARGUMENTS
BUFFER(0, readonly, BuildStatus, status)
BUFFER(1, readonly, float, ranges) // of the field, two per node
BUFFER(2, readonly, float, drawn)  // two per range; the ranges are ascending and disjoint
BUFFER(3, writeonly, uint, marks)  // one bit per node

bool is_visible(float lo, float hi) {
    if (lo > hi) return false;
    // Interpolation may leave the range by this much.
    precise float rounding = max(abs(lo), abs(hi)) * uintBitsToFloat((127u - 19u) << 23);
    precise float a = canonical(lo) - canonical(rounding), b = canonical(hi) + canonical(rounding);
    a = canonical(a);
    b = canonical(b);
    // The first range that does not end before a.
    uint first = 0u, behind = drawn_ranges;
    while (first < behind) {
        uint mid = first + (behind - first) / 2u;
        if (drawn.at[2u * mid + 1u] >= a) behind = mid;
        else first = mid + 1u;
    }
    return first < drawn_ranges && drawn.at[2u * first] <= b;
}

void main() {
    // A tree that found no room has nothing visible; its root is looked up all the same.
    uint word = item_index(), nodes = status.at[0].overflow != 0u ? 0u : status.at[0].nodes;
    if (32u * word >= max(nodes, 1u)) return;
    uint bits = 0u;
    for (uint i = 0u; i < min(32u, nodes - 32u * word); ++i) {
        uint node = 32u * word + i;
        if (is_visible(ranges.at[2u * node], ranges.at[2u * node + 1u])) bits |= 1u << i;
    }
    marks.at[word] = bits;
}
