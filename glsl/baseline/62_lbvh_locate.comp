#version 460
// LBVH baseline, point location: tests every tetrahedron whose box contains the point. A search that a dispatch leaves
// unfinished is kept in the outputs for the next one.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
ARGUMENTS(11)
    uint count;
    uint fresh;  // not 0: nothing has been done yet
    uint budget; // nodes and tetrahedra per point and dispatch
    float tolerance;
END_ARGUMENTS
GRID(0, readonly)
BUFFER16(1, readonly, LbvhNode, nodes)
BUFFER(2, readonly, uint, root)
BUFFER(3, readonly, uint, ids)
BUFFER(4, readonly, uint, boundary)
RECORDS(5, uvec4, cells)
RECORDS(6, vec4, vertices)
BUFFER(7, readonly, float, points)
BUFFER(8, READ_WRITE, uint, owners)
// Of unfinished points: NONE, where to resume, and what is known of the best candidate.
BUFFER16(9, READ_WRITE, uvec4, barycentrics)
BUFFER(10, READ_WRITE, uint, unfinished)
#include "shared/binary_owner.glsl"
#include "shared/points.glsl"

void main() {
    uint i = item_index();
    uint waits = 0u;
    uvec4 state = uvec4(0u);
    if (i < count && fresh == 0u) state = barycentrics.at[i];
    // No barycentric coordinate has the bits of NONE, which are a NaN that no operation produces.
    if (i < count && (fresh != 0u || state.x == NONE)) {
        Grid g = grid.at[0];
        vec3 at = point(i, 3u);
        vec3 x = normalise(g, at);
        OwnerSearch s = no_search();
        if (fresh == 0u) s = OwnerSearch(state.y, best_of(owners.at[i], state.z, uintBitsToFloat(state.w)));
        uint owner, work = 0u;
        if (find_owner(s, g, at, x, tolerance, work, budget, owner)) {
            vec4 b = vec4(0.0);
            if (owner != NONE) b = barycentric(load_tet(words(cells.at[owner])), x);
            state = floatBitsToUint(b);
        } else {
            waits = 1u;
            owner = s.best.owner;
            state = uvec4(NONE, s.cursor, best_bits(s.best), floatBitsToUint(s.best.smallest));
        }
        owners.at[i] = owner;
        barycentrics.at[i] = state;
    }
    waits = subgroupAdd(waits);
    if (subgroupElect() && waits > 0u) atomicAdd(unfinished.at[0], waits);
}
