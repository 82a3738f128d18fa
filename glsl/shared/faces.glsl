// The hash table of faces, with open addressing. A face is searched for first in the slots near the place of its middle
// vertex, which its neighbours in the file have just used, so that this memory is likely to be cached; then anywhere in
// the table. (The smallest vertex of a face would not do: a vertex before all its neighbours is that of all its faces,
// which its slots cannot hold.) The including kernel declares cells, table, status, branches, slots and near_slots.
#include "shared/mates.glsl"
#include "shared/mix_bits.glsl"

const uint NEAR_PROBES = 16u;
const uint MAX_PROBES = 8192u;

// The vertices of face f (opposite to vertex f) in ascending order.
uvec3 face_of(uvec4 v, uint f) {
    uvec3 t = f == 0u ? v.yzw : f == 1u ? v.xzw : f == 2u ? v.xyw : v.xyz;
    uint lo = min(t.x, min(t.y, t.z)), hi = max(t.x, max(t.y, t.z));
    return uvec3(lo, t.x ^ t.y ^ t.z ^ lo ^ hi, hi);
}

uint hash_of(uvec3 face) { return mix_bits(face.x ^ mix_bits(face.z)); }

// The part h / 2^32 of n.
uint part_of(uint n, uint h) {
    uint part, rest;
    umulExtended(h, n, part, rest);
    return part;
}

// The slot of the table that a face is looked for in at a given attempt.
uint slot_of(uvec3 face, uint attempt) {
    uint h = hash_of(face);
    if (attempt < min(NEAR_PROBES, near_slots)) {
        uint place = part_of(near_slots, h) + attempt;
        return min(face.y * near_slots, slots - near_slots) + (place < near_slots ? place : place - near_slots);
    }
    // Every further probe is hashed anew: where the faces of many vertices crowd, long stretches of the table are full.
    return part_of(slots, mix_bits(h ^ face.y ^ attempt * 0x9e3779b9u));
}

bool has_vertices(uint other, uvec3 face) { return face_of(words(cells.at[other >> 2]), other & 3u) == face; }

// Marks a face, and says whether it was not marked.
bool mark_branched(uint face) {
    uint bit = 1u << (face & 31u);
    return (atomicOr(branches.at[face >> 5u], bit) & bit) == 0u;
}

// What a slot holds, NONE if it was free; then it holds face `me` now. A face that is `paired` has its mate already, and is
// looked for so that a third face with its vertices is noticed.
uint take(uint slot, uint me, bool paired) { return atomicCompSwap(table.at[slot], NONE, paired ? me | MATED : me); }

// What is known of face `me` once the face `held` in a slot turns out to have the same vertices. The second face of a pair
// takes the place of the first; then the slot does not change any more.
uint meet(uint me, bool paired, uint held, uint slot) {
    uint first = held;
    if (paired) held = atomicOr(table.at[slot], MATED);
    else if ((held & MATED) == 0u) held = atomicCompSwap(table.at[slot], first, me | MATED);
    if (!paired && (held & MATED) == 0u) return first;
    if (paired) mark_branched(me);
    if (mark_branched(held & ~MATED)) atomicAdd(status.at[0].branched, 1u);
    return NONE;
}
