#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
// From face mates to neighbours and boundary bits (SPEC 2.3).
ARGUMENTS(6)
    uint tets;
END_ARGUMENTS
BUFFER(0, readonly, uint, bad)
BUFFER(1, readonly, uint, mates)
BUFFER(2, readonly, uint, flat_cells) // one bit per tetrahedron without volume
BUFFER16(3, writeonly, uvec4, neighbours)
BUFFER(4, READ_WRITE, uint, boundary) // one bit per tetrahedron, zeroed
BUFFER(5, READ_WRITE, MeshStatus, status)

const uint CROWDED = 0xfffffffeu;
const uint SIDE = 0x80000000u;

bool is_flat(uint t) { return (flat_cells.at[t >> 5u] >> (t & 31u) & 1u) != 0u; }

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
                if (!paired || (same_side && !is_flat(across[f]))) on_boundary = 1u;
            }
            if (is_flat(t)) on_boundary = 1u;
            if (on_boundary != 0u) atomicOr(boundary.at[t >> 5u], 1u << (t & 31u));
        }
        neighbours.at[t] = across;
    }
    on_boundary = subgroupAdd(on_boundary);
    if (on_boundary > 0u && subgroupElect()) atomicAdd(status.at[0].boundary, on_boundary);
}
