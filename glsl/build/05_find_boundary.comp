#version 460
// Sets boundary bits (SPEC 2.3). Before that, turns the mates of faces into neighbours, in place (MATES), or, where
// faces were matched before the points moved, parts tetrahedra from neighbours that have become bad.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/mates.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/corners.glsl"
#include "shared/shapes.glsl"
layout(constant_id = 2) const uint MATES = 1;
ARGUMENTS(9)
    uint tets;
    uint tile;  // tetrahedra per workgroup
END_ARGUMENTS
BUFFER(0, readonly, uint, bad)
BUFFER(1, readonly, uint, shapes) // see shapes.glsl
BUFFER16(2, READ_WRITE, uvec4, neighbours) // with MATES, mates on entry
BUFFER(3, READ_WRITE, uint, boundary) // one bit per tetrahedron, zeroed
BUFFER(4, READ_WRITE, MeshStatus, status)
RECORDS(5, uvec4, cells)
BUFFER(6, readonly, uint, thin) // thin corners at every vertex
BUFFER(7, readonly, uint, branches) // see mates.glsl
BUFFER(8, readonly, uint, table)    // of faces, see faces.glsl
#include "shared/bad.glsl"

bool any_branched = status.at[0].branched > 0u;

bool is_branched(uint face) { return any_branched && (branches.at[face >> 5u] >> (face & 31u) & 1u) != 0u; }

uint shape_of(uint t) { return shapes.at[t >> 4u] >> (2u * (t & 15u)) & 3u; }

bool is_crowded(uvec4 v) { return max(max(thin.at[v.x], thin.at[v.y]), max(thin.at[v.z], thin.at[v.w])) > MOST_THIN; }

uvec4 neighbours_of(uint t) {
    uvec4 held = neighbours.at[t], across = held;
    if (MATES == 0u) {
        for (uint f = 0u; f < 4u; ++f) {
            if (held[f] == NONE || is_bad(t) || is_bad(held[f])) across[f] = NONE;
        }
    } else {
        for (uint f = 0u; f < 4u; ++f) { // all loads first
            if (held[f] != NONE && held[f] >= IN_SLOT) across[f] = table.at[held[f] & ~IN_SLOT] & ~MATED;
        }
        for (uint f = 0u; f < 4u; ++f) {
            uint face = 4u * t + f, other = across[f];
            bool alone = other == NONE || other == face || is_branched(face) || is_branched(other);
            across[f] = alone ? NONE : other >> 2;
        }
    }
    if (MATES != 0u || across != held) neighbours.at[t] = across;
    if (MATES == 0u && across != held) status.at[0].parted = 1u;
    return across;
}

// Whether a tetrahedron, which is not flat, and its neighbour across face f, whose vertex opposite to that face is
// given, lie on the same side of it. A flat neighbour lies on no side.
bool is_fold(uint shape, uint theirs, uvec4 ids, uint f, uint opposite) {
    uvec4 below_mine = uvec4(lessThan(ids, uvec4(ids[f]))), below_theirs = uvec4(lessThan(ids, uvec4(opposite)));
    below_theirs[f] = 0u;
    uint crossed = (below_mine.x + below_mine.y + below_mine.z + below_mine.w) ^ (below_theirs.x + below_theirs.y + below_theirs.z + below_theirs.w);
    return theirs != FLAT && (shape == theirs) == ((crossed & 1u) == 0u);
}

void main() {
    uint boundary_cells = 0u;
    bool any_crowded = status.at[0].crowded > 0u;
    uvec2 items = items_of_tile(tile, tets);
    for (uint t = items.x; t < items.y; t += gl_SubgroupSize) {
        uvec4 across = neighbours_of(t);
        if (is_bad(t)) continue;
        uvec4 ids = words(cells.at[t]);
        uint shape = shape_of(t);
        bool on_boundary = any(equal(across, uvec4(NONE))) || shape == FLAT || (any_crowded && is_crowded(ids));
        if (!on_boundary) {
            // Those of the four neighbours are loaded together.
            uint all = ids.x ^ ids.y ^ ids.z ^ ids.w;
            uvec4 opposite, theirs;
            for (uint f = 0u; f < 4u; ++f) {
                uvec4 v = words(cells.at[across[f]]);
                opposite[f] = v.x ^ v.y ^ v.z ^ v.w ^ all ^ ids[f];
                theirs[f] = shape_of(across[f]);
            }
            for (uint f = 0u; f < 4u; ++f) on_boundary = on_boundary || is_fold(shape, theirs[f], ids, f, opposite[f]);
        }
        if (on_boundary) atomicOr(boundary.at[t >> 5u], 1u << (t & 31u));
        boundary_cells += uint(on_boundary);
    }
    boundary_cells = subgroupAdd(boundary_cells);
    if (boundary_cells > 0u && subgroupElect()) atomicAdd(status.at[0].boundary, boundary_cells);
}
