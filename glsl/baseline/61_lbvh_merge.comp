#version 460
// LBVH baseline, hierarchy: an invocation climbs from every leaf. At each node, the first to arrive stores its half and
// stops; the second goes on (Apetrei 2014). No invocation waits for another, so no forward progress between workgroups
// is needed. On Mesa 22.3, lavapipe suspends the whole workgroup at a memory barrier as at a control barrier, and Metal
// before 3.2 has only control barriers. This loop survives neither, so a workgroup is one subgroup there.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(9)
    uint tets;
END_ARGUMENTS
RECORDS(0, vec4, vertices)
RECORDS(1, uvec4, cells)
BUFFER(2, readonly, uint, boundary)
BUFFER(3, readonly, uint, codes)
BUFFER(4, readonly, uint, ids)
BUFFER16(5, coherent, LbvhNode, nodes)
// Per internal node, filled with NONE: the other end of the half that came first.
BUFFER(6, coherent, uint, arrivals)
BUFFER(7, writeonly, uint, root)    // reference of the root
BUFFER(8, readonly, MeshStatus, status)

#include "shared/binary_tree.glsl"
#include "shared/boundary_tet.glsl"

// Whether places i and i + 1 are closer together than j and j + 1: the smaller difference of codes, then of places.
bool closer(uint i, uint j) {
    uint a = codes.at[i] ^ codes.at[i + 1u], b = codes.at[j] ^ codes.at[j + 1u];
    if (a != b) return a < b;
    uint c = i ^ (i + 1u), d = j ^ (j + 1u);
    return c != d ? c < d : i < j;
}

void main() {
    uint valid = tets - status.at[0].bad; // bad tetrahedra come after the valid ones
    uint first = item_index(), last = first, me = first | BINARY_LEAF;
    vec3 lo, hi;
    bool climbs = first < valid;
    if (climbs) {
        box_of(me, lo, hi);
        uint t = ids.at[first];
        if (is_boundary_tet(t)) me |= BINARY_BOUNDARY;
    }
    for (uint depth = 0u; climbs && depth < BINARY_DEPTH; ++depth) {
        if (first == 0u && last == valid - 1u) {
            root.at[0] = me;
            climbs = false;
            continue;
        }
        bool left = first == 0u || (last != valid - 1u && closer(last, first - 1u));
        uint parent = left ? last : first - 1u;
        if (left) nodes.at[parent].left = me;
        else nodes.at[parent].right = me;
        memoryBarrierBuffer();
        uint other_end = atomicExchange(arrivals.at[parent], left ? first : last);
        climbs = other_end != NONE;
        if (!climbs) continue;
        memoryBarrierBuffer();
        uint sibling = left ? nodes.at[parent].right : nodes.at[parent].left;
        vec3 sibling_lo, sibling_hi;
        box_of(sibling, sibling_lo, sibling_hi);
        lo = min(lo, sibling_lo);
        hi = max(hi, sibling_hi);
        for (uint k = 0u; k < 3u; ++k) {
            nodes.at[parent].lo[k] = lo[k];
            nodes.at[parent].hi[k] = hi[k];
        }
        if (left) last = other_end;
        else first = other_end;
        me = parent | ((me | sibling) & BINARY_BOUNDARY);
    }
}
