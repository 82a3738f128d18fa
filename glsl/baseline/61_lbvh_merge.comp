#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
// LBVH baseline, hierarchy: every leaf climbs; at each node the first to arrive leaves its half and stops, the second goes on (Apetrei 2014).
// Nobody waits for anybody, so no forward progress between workgroups is needed.
ARGUMENTS(7)
    uint tets;  // valid ones
    uint stride;
END_ARGUMENTS
BUFFER(0, readonly, float, positions)
BUFFER16(1, readonly, uvec4, cells)
BUFFER(2, readonly, uint, codes)
BUFFER(3, readonly, uint, ids)
BUFFER16(4, coherent, LbvhNode, nodes)
BUFFER(5, coherent, uint, arrivals) // per internal node, filled with all ones: the other end of the half that came first
BUFFER(6, writeonly, uint, root)    // child reference of the root

const uint LEAF = 0x80000000u;

vec3 position(uint v) { return vec3(positions.at[v * stride], positions.at[v * stride + 1u], positions.at[v * stride + 2u]); }

// Whether places i and i + 1 are closer together than j and j + 1: the smaller difference of codes, then of places.
bool closer(uint i, uint j) {
    uint a = codes.at[i] ^ codes.at[i + 1u], b = codes.at[j] ^ codes.at[j + 1u];
    if (a != b) return a < b;
    uint c = i ^ (i + 1u), d = j ^ (j + 1u);
    return c != d ? c < d : i < j;
}

void leaf_box(uint place, out vec3 lo, out vec3 hi) {
    uvec4 v = cells.at[ids.at[place]];
    vec3 a = position(v.x), b = position(v.y), c = position(v.z), d = position(v.w);
    lo = min(min(a, b), min(c, d));
    hi = max(max(a, b), max(c, d));
}

void main() {
    uint place = item_index();
    if (place >= tets) return;
    vec3 lo, hi;
    leaf_box(place, lo, hi);
    uint first = place, last = place, me = place | LEAF;
    // A code has 30 bits and a place 29: the tree is no deeper.
    for (uint depth = 0u; depth < 64u; ++depth) {
        if (first == 0u && last == tets - 1u) {
            root.at[0] = me;
            return;
        }
        bool left_child = first == 0u || (last != tets - 1u && closer(last, first - 1u));
        uint parent = left_child ? last : first - 1u;
        if (left_child) nodes.at[parent].left = me;
        else nodes.at[parent].right = me;
        memoryBarrierBuffer();
        uint other_end = atomicExchange(arrivals.at[parent], left_child ? first : last);
        if (other_end == NONE) return;
        memoryBarrierBuffer();
        uint sibling = left_child ? nodes.at[parent].right : nodes.at[parent].left;
        vec3 sibling_lo, sibling_hi;
        if ((sibling & LEAF) != 0u) {
            leaf_box(sibling & ~LEAF, sibling_lo, sibling_hi);
        } else {
            for (uint k = 0u; k < 3u; ++k) {
                sibling_lo[k] = nodes.at[sibling].lo[k];
                sibling_hi[k] = nodes.at[sibling].hi[k];
            }
        }
        lo = min(lo, sibling_lo);
        hi = max(hi, sibling_hi);
        for (uint k = 0u; k < 3u; ++k) {
            nodes.at[parent].lo[k] = lo[k];
            nodes.at[parent].hi[k] = hi[k];
        }
        if (left_child) last = other_end;
        else first = other_end;
        me = parent;
    }
}
