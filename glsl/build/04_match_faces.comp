#version 460
// Finds the two tetrahedra that share each face (SPEC 2.3) with a table of all faces. mates[tetrahedron] receives what is
// known of its faces, see mates.glsl. What follows from it does not depend on the order of arrival: where more than two
// faces have the same vertices, none becomes a neighbour, whichever are first. For processors; see
// 04_match_faces_tiled.comp.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
ARGUMENTS(6)
    uint tets;
    uint slots;      // of the table
    uint near_slots; // of the table per vertex, searched first
    uint tile;       // tetrahedra per workgroup
END_ARGUMENTS
RECORDS(0, uvec4, cells)
BUFFER(1, readonly, uint, bad)
BUFFER(2, READ_WRITE, uint, table) // faces, or NONE; filled with NONE
BUFFER16(3, writeonly, uvec4, mates)
BUFFER(4, READ_WRITE, MeshStatus, status)
BUFFER(5, READ_WRITE, uint, branches) // zeroed
#include "shared/bad.glsl"
#include "shared/faces.glsl"

void main() {
    uvec2 items = items_of_tile(tile, tets);
    for (uint t = items.x; t < items.y; t += gl_SubgroupSize) {
        uvec4 ids = words(cells.at[t]), known = uvec4(NONE);
        // An attempt of one of the four faces per pass, so that invocations do not wait for each other's.
        for (uint f = is_bad(t) ? 4u : 0u, attempt = 0u; f < 4u;) {
            uint me = 4u * t + f;
            uvec3 face = face_of(ids, f);
            uint slot = slot_of(face, attempt), held = table.at[slot];
            if (held == NONE) held = take(slot, me, false); // reading costs less, and every second face finds the first
            bool same = held != NONE && has_vertices(held & ~MATED, face);
            uint found = held == NONE ? slot | IN_SLOT : NONE;
            if (same) found = meet(me, false, held, slot);
            known[f] = found;
            ++attempt;
            if (attempt == MAX_PROBES) status.at[0].overflow = 1u;
            if (held == NONE || same || attempt == MAX_PROBES) {
                ++f;
                attempt = 0u;
            }
        }
        mates.at[t] = known;
    }
}
