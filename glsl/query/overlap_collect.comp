#version 460
// Overlap (SPEC 3.5), end of step 1: decides which tetrahedra intersect the other mesh by their vertices, and which
// must be searched for in its tree. An invocation takes 32 tetrahedra, one word of answers. Twin of
// src/reference/overlap.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/overlap.glsl"
ARGUMENTS(9)
    uint tets;
    uint stride;
END_ARGUMENTS
GRID(0, readonly) // of the other mesh
BUFFER(1, readonly, float, own_positions)
RECORDS(2, uvec4, own_cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, readonly, uint, places)
BUFFER(5, readonly, uint, around)
BUFFER(6, writeonly, uint, hits)    // one bit per tetrahedron
BUFFER(7, writeonly, uint, waiting) // in no particular order
BUFFER(8, READ_WRITE, OverlapStatus, status)

vec3 own_position(uint i) {
    return canonical3(vec3(own_positions.at[i * stride], own_positions.at[i * stride + 1u], own_positions.at[i * stride + 2u]));
}

void main() {
    uint word = item_index();
    uint begin = word * 32u, hit = 0u, wait = 0u;
    if (begin < tets) {
        uint healthy = status.at[0].empty != 0u ? 0u : ~bad.at[word], held = around.at[word];
        for (uint k = 0u; k < min(32u, tets - begin); ++k) {
            uint bit = 1u << k;
            if ((healthy & bit) == 0u) continue;
            uvec4 ids = words(own_cells.at[begin + k]);
            if ((held & bit) != 0u || (places.at[ids.x] | places.at[ids.y] | places.at[ids.z] | places.at[ids.w]) != 0u) {
                hit |= bit;
                continue;
            }
            vec3 a = own_position(ids.x), b = own_position(ids.y), c = own_position(ids.z), d = own_position(ids.w);
            if (boxes_meet(min(min(a, b), min(c, d)), max(max(a, b), max(c, d)), grid.at[0].lo.xyz, grid.at[0].hi.xyz)) wait |= bit;
        }
        hits.at[word] = hit;
    }
    uint count = bitCount(wait), total = subgroupAdd(count), before = subgroupExclusiveAdd(count), place = 0u;
    uint by_vertex = subgroupAdd(bitCount(hit));
    if (subgroupElect()) {
        if (total > 0u) place = atomicAdd(status.at[0].waiting, total);
        if (by_vertex > 0u) atomicAdd(status.at[0].by_vertex, by_vertex);
    }
    place = subgroupBroadcastFirst(place) + before;
    for (; wait != 0u; wait &= wait - 1u) waiting.at[place++] = begin + uint(findLSB(wait));
}
