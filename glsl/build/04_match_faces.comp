#version 460
// Finds the two tetrahedra that share each face (SPEC 2.3) with a hash table with open addressing. A face is searched
// for first in the slots near the place of its middle vertex, which its neighbours in the file have just used, so that
// this memory is likely to be cached; then anywhere in the table. (The smallest vertex of a face would not do: a vertex
// before all its neighbours is that of all its faces, which its slots cannot hold.) mates[face] receives the other face
// (see mates.glsl). The result does not depend on the order of arrival: only the second face of a pair writes mates, those
// of both, and where there are more than two, none becomes a neighbour, whichever is second.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/mates.glsl"
ARGUMENTS(6)
    uint tets;
    uint slots;      // of the table
    uint near_slots; // of the table per vertex, searched first
    uint share;      // tetrahedra per workgroup
END_ARGUMENTS
RECORDS(0, uvec4, cells)
BUFFER(1, readonly, uint, bad)
BUFFER(2, READ_WRITE, uint, table) // faces, or NONE; filled with NONE
BUFFER(3, writeonly, uint, mates) // of the four faces of every tetrahedron; zeroed
BUFFER(4, READ_WRITE, MeshStatus, status)
BUFFER(5, READ_WRITE, uint, branches) // zeroed
#include "shared/bad.glsl"

const uint MATED = 0x80000000u; // above a face in the table: a second face with its vertices was found
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

// The slot of the table that a face is looked for in at a given attempt.
uint slot_of(uvec3 face, uint attempt) {
    uint h = mix_bits(face.x ^ mix_bits(face.z)), place, slot;
    if (attempt < min(NEAR_PROBES, near_slots)) {
        umulExtended(h, near_slots, place, slot);
        place += attempt;
        return min(face.y * near_slots, slots - near_slots) + (place < near_slots ? place : place - near_slots);
    }
    // Every further probe is hashed anew: where the faces of many vertices crowd, long stretches of the table are full.
    umulExtended(mix_bits(h ^ face.y ^ attempt * 0x9e3779b9u), slots, slot, place);
    return slot;
}

bool has_vertices(uint other, uvec3 face) { return face_of(words(cells.at[other >> 2]), other & 3u) == face; }

// Notes that face `me` has the vertices of `other`, the face in a slot.
void mate_with(uint me, uint other, uint slot) {
    if ((atomicOr(table.at[slot], MATED) & MATED) == 0u) {
        mates.at[me] = mate(other);
        mates.at[other] = mate(me);
    } else {
        uint bit = 1u << (other & 31u);
        if ((atomicOr(branches.at[other >> 5u], bit) & bit) == 0u) atomicAdd(status.at[0].branched, 1u);
    }
}

// What a slot holds, face `me` if it was free.
uint take(uint slot, uint me) {
    uint held = table.at[slot];
    return held == NONE ? atomicCompSwap(table.at[slot], NONE, me) : held; // a slot never changes its face
}

void main() {
    uvec2 items = items_of_share(share, tets);
    for (uint t = items.x; t < items.y; t += gl_SubgroupSize) {
        if (is_bad(t)) continue;
        uvec4 ids = words(cells.at[t]);
        // An attempt of one of the four faces per pass, so that invocations do not wait for each other's.
        for (uint f = 0u, attempt = 0u; f < 4u;) {
            uint me = 4u * t + f;
            uvec3 face = face_of(ids, f);
            uint slot = slot_of(face, attempt), held = take(slot, me);
            bool same = held != NONE && has_vertices(held & ~MATED, face);
            if (same) mate_with(me, held & ~MATED, slot);
            ++attempt;
            if (attempt == MAX_PROBES) status.at[0].overflow = 1u;
            if (held == NONE || same || attempt == MAX_PROBES) {
                ++f;
                attempt = 0u;
            }
        }
    }
}
