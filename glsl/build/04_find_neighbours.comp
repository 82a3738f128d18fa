#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
// From face mates to neighbours and boundary bits (SPEC 2.3).
ARGUMENTS(7)
    uint tets;
END_ARGUMENTS
BUFFER16(0, readonly, vec4, vertices)
BUFFER16(1, readonly, uvec4, cells)
BUFFER(2, readonly, uint, bad)
BUFFER(3, readonly, uint, mates)
BUFFER16(4, writeonly, uvec4, neighbours)
BUFFER(5, READ_WRITE, uint, boundary) // one bit per tetrahedron, zeroed
BUFFER(6, READ_WRITE, MeshStatus, status)

const uint CROWDED = 0xfffffffeu;
const uint SIDE = 0x80000000u;

float volume_of(uint t) {
    uvec4 ids = cells.at[t];
    return volume(make_tet(ids, vertices.at[ids.x].xyz, vertices.at[ids.y].xyz, vertices.at[ids.z].xyz, vertices.at[ids.w].xyz));
}

void main() {
    uint t = item_index();
    uint on_boundary = 0u;
    if (t < tets) {
        uvec4 across = uvec4(NONE);
        if ((bad.at[t >> 5u] >> (t & 31u) & 1u) == 0u) {
            for (uint f = 0u; f < 4u; ++f) {
                uint face = 4u * t + f;
                uint mate = mates.at[face];
                bool paired = mate < CROWDED;
                uint back = paired ? mates.at[mate & ~SIDE] : NONE;
                paired = paired && back < CROWDED && (back & ~SIDE) == face;
                if (paired) across[f] = (mate & ~SIDE) >> 2;
                // `back` tells this face's side, `mate` the other one's: equal sides are a fold, unless the other one is flat and has none.
                bool same_side = paired && ((back ^ mate) & SIDE) == 0u;
                if (!paired || (same_side && volume_of(across[f]) != 0.0)) on_boundary = 1u;
            }
            if (on_boundary == 0u && volume_of(t) == 0.0) on_boundary = 1u;
            if (on_boundary != 0u) atomicOr(boundary.at[t >> 5u], 1u << (t & 31u));
        }
        neighbours.at[t] = across;
    }
    on_boundary = subgroupAdd(on_boundary);
    if (on_boundary > 0u && subgroupElect()) atomicAdd(status.at[0].boundary, on_boundary);
}
