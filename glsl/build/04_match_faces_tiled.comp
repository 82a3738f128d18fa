#version 460
// 04_match_faces.comp for processors with many narrow cores. A workgroup first pairs the faces of its own consecutive
// tetrahedra in shared memory: most of them, since meshes are rarely in random order. The table of all faces receives
// each pair, so that a third face with its vertices is noticed, and the faces that are left.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
ARGUMENTS(6)
    uint tets;
    uint slots;      // of the table
    uint near_slots; // of the table per vertex, searched first
END_ARGUMENTS
RECORDS(0, uvec4, cells)
BUFFER(1, readonly, uint, bad)
BUFFER(2, READ_WRITE, uint, table) // faces, or NONE; filled with NONE
BUFFER16(3, writeonly, uvec4, mates)
BUFFER(4, READ_WRITE, MeshStatus, status)
BUFFER(5, READ_WRITE, uint, branches) // zeroed
#include "shared/bad.glsl"
#include "shared/faces.glsl"

const uint TILE_SLOTS = 8u * WORKGROUP;

// Faces of the tile are numbered from its first one.
shared uvec4 tile_cells[WORKGROUP];
// First a table of the tile's faces. Then the faces whose search in the table of all comes upon another face at once: two
// words each, the face (with MATED if it has a mate in the tile), and that other one.
shared uint tile_faces[TILE_SLOTS];
shared uint tile_mates[4u * WORKGROUP]; // per face, its mate in the tile, or NONE; then what is known of it
shared uint tile_listed;

// Pairs face `me` with another face of the tile, if that has come before, and says whether it did. Of more than two faces
// with the same vertices, those after the second are left alone.
bool pair_in_tile(uint me, uvec3 face) {
    uint slot = part_of(TILE_SLOTS, hash_of(face) + face.y * 0x9e3779b9u);
    for (uint i = 0u; i < TILE_SLOTS; ++i) {
        uint held = atomicCompSwap(tile_faces[slot], NONE, me);
        if (held == NONE) return false;
        if (face_of(tile_cells[held >> 2u], held & 3u) == face) {
            if (atomicCompSwap(tile_mates[held], NONE, me) != NONE) return false;
            tile_mates[me] = held;
            return true;
        }
        slot = slot + 1u == TILE_SLOTS ? 0u : slot + 1u;
    }
    return false;
}

void main() {
    uint i = local_index(), first_tet = group_index() * WORKGROUP, first = 4u * first_tet, t = first_tet + i;
    for (uint k = i; k < TILE_SLOTS; k += WORKGROUP) tile_faces[k] = NONE;
    [[unroll]] for (uint f = 0u; f < 4u; ++f) tile_mates[4u * i + f] = NONE;
    if (i == 0u) tile_listed = 0u;
    bool valid = t < tets && !is_bad(t);
    uvec4 ids = uvec4(0u);
    if (valid) ids = words(cells.at[t]);
    tile_cells[i] = ids;
    barrier();
    uint left = valid ? 15u : 0u; // bits of the faces to be looked for: one of each pair, and those alone
    [[unroll]] for (uint f = 0u; f < 4u && valid; ++f) left ^= uint(pair_in_tile(4u * i + f, face_of(ids, f))) << f;
    barrier();
    // First attempts of all faces at once, since each waits for memory.
    uvec4 slot, held = uvec4(NONE);
    [[unroll]] for (uint f = 0u; f < 4u; ++f) {
        if ((left >> f & 1u) == 0u) continue;
        slot[f] = slot_of(face_of(ids, f), 0u);
        held[f] = take(slot[f], first + 4u * i + f, tile_mates[4u * i + f] != NONE);
    }
    [[unroll]] for (uint f = 0u; f < 4u; ++f) {
        uint me = 4u * i + f;
        bool paired = tile_mates[me] != NONE;
        if (held[f] != NONE) {
            uint place = atomicAdd(tile_listed, 2u);
            tile_faces[place] = paired ? me | MATED : me;
            tile_faces[place + 1u] = held[f];
        } else if (!paired && valid) {
            tile_mates[me] = (slot[f] | IN_SLOT) - first;
        }
    }
    barrier();
    uint listed = tile_listed;
    for (uint k = 2u * i, attempt = 0u; k < listed;) {
        uint entry = tile_faces[k], other = tile_faces[k + 1u], me = entry & ~MATED;
        bool paired = entry != me;
        uvec3 face = face_of(tile_cells[me >> 2u], me & 3u);
        bool same = has_vertices(other & ~MATED, face);
        uint found = NONE;
        if (same) {
            found = meet(first + me, paired, other, slot_of(face, attempt));
        } else {
            ++attempt;
            uint next = slot_of(face, attempt);
            other = take(next, first + me, paired);
            if (other == NONE) found = next | IN_SLOT;
            tile_faces[k + 1u] = other;
            if (attempt == MAX_PROBES) status.at[0].overflow = 1u;
        }
        if (same || other == NONE || attempt == MAX_PROBES) {
            if (!paired) tile_mates[me] = found - first;
            k += 2u * WORKGROUP;
            attempt = 0u;
        }
    }
    barrier();
    if (t >= tets) return;
    uvec4 known = uvec4(NONE);
    [[unroll]] for (uint f = 0u; f < 4u && valid; ++f) known[f] = tile_mates[4u * i + f] + first;
    mates.at[t] = known;
}
