#version 460
// Finds the two tetrahedra that share each face (SPEC 2.3) with a hash table with open addressing. A face is searched
// for first in the slots near the place of its middle vertex, which its neighbours in the file have just used, so that
// this memory is likely to be cached; then anywhere in the table. (The smallest vertex of a face would not do: a vertex
// before all its neighbours is that of all its faces, which its slots cannot hold.) mates[face] receives the other face
// (see mates.glsl). The result does not depend on the order of arrival, since the words of `mates` only grow.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/mates.glsl"
ARGUMENTS(5)
    uint tets;
    uint slots;      // of the table
    uint near_slots; // of the table per vertex, searched first
    uint share;      // tetrahedra per workgroup
END_ARGUMENTS
RECORDS(0, uvec4, cells)
BUFFER(1, readonly, uint, bad)
BUFFER(2, READ_WRITE, uint, table) // faces, or NONE; filled with NONE
BUFFER(3, READ_WRITE, uint, mates) // of the four faces of every tetrahedron; zeroed
BUFFER(4, READ_WRITE, MeshStatus, status)
#include "shared/bad.glsl"

const uint NEAR_PROBES = 16u;
const uint MAX_PROBES = 8192u;

uint mix_bits(uint h) {
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ (h >> 16);
}

// The vertices of face f (opposite to vertex f) in ascending order.
uvec3 face_of(uvec4 v, uint f) {
    uvec3 t = f == 0u ? v.yzw : f == 1u ? v.xzw : f == 2u ? v.xyw : v.xyz;
    uint lo = min(t.x, min(t.y, t.z)), hi = max(t.x, max(t.y, t.z));
    return uvec3(lo, t.x ^ t.y ^ t.z ^ lo ^ hi, hi);
}

void main() {
    uvec2 items = items_of_share(share, tets);
    for (uint t = items.x; t < items.y; t += gl_SubgroupSize) {
        if (is_bad(t)) continue;
        uvec4 ids = words(cells.at[t]);
        for (uint f = 0u; f < 4u; ++f) {
            uvec3 face = face_of(ids, f);
            uint me = 4u * t + f;
            uint h = mix_bits(face.x ^ mix_bits(face.z));
            uint near_base = min(face.y * near_slots, slots - near_slots), place, unused;
            umulExtended(h, near_slots, place, unused);
            uint probe = 0u;
            for (; probe < MAX_PROBES; ++probe) {
                uint slot = near_base + place;
                place = place + 1u == near_slots ? 0u : place + 1u;
                // Every probe is hashed anew: where the faces of many vertices crowd, long stretches of the table are
                // full.
                if (probe >= min(NEAR_PROBES, near_slots)) umulExtended(mix_bits(h ^ face.y ^ probe * 0x9e3779b9u), slots, slot, unused);
                uint other = atomicCompSwap(table.at[slot], NONE, me);
                if (other == NONE) break;
                if (face_of(words(cells.at[other >> 2]), other & 3u) == face) {
                    uint third = atomicCompSwap(mates.at[other], ALONE, mate(me));
                    if (third == ALONE) {
                        atomicMax(mates.at[me], mate(other));
                    } else {
                        atomicExchange(mates.at[other], CROWDED);
                        atomicExchange(mates.at[me], CROWDED);
                        if (third != CROWDED) atomicExchange(mates.at[face_of_mate(third)], CROWDED);
                    }
                    break;
                }
            }
            if (probe == MAX_PROBES) status.at[0].overflow = 1u;
        }
    }
}
