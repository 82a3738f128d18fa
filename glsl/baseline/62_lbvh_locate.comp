#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
// LBVH baseline, point location: every primitive whose box holds the point, in any order; the owner is the one that the octree finds.
// Boxes are grown by GROW of their size, so that cells that hold the point within the tolerance are met too.
ARGUMENTS(9)
    uint count;
    uint stride;
    float tolerance;
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER16(1, readonly, LbvhNode, nodes)
BUFFER(2, readonly, uint, ids)
BUFFER(3, readonly, uint, root)
BUFFER16(4, readonly, uvec4, cells)
BUFFER16(5, readonly, vec4, vertices)
BUFFER(6, readonly, float, points)
BUFFER(7, writeonly, uint, owners)
BUFFER16(8, writeonly, vec4, barycentrics)
#include "shared/lbvh.glsl"

void main() {
    uint i = item_index();
    if (i >= count) return;
    Grid g = grid.at[0];
    vec3 at = vec3(points.at[i * stride], points.at[i * stride + 1u], points.at[i * stride + 2u]);
    vec3 x = normalise(g, at);
    uint owner = NONE;
    if (near_bounds(g, at)) owner = lbvh_owner(at, x, tolerance);
    vec4 b = vec4(0.0);
    if (owner != NONE) {
        Tet tet = load_tet(cells.at[owner]);
        b = barycentric(weights(tet, x), tet.rank);
    }
    owners.at[i] = owner;
    barycentrics.at[i] = b;
}
