#version 460
// The places of the surface that are closest to points: the weights of the vertices, in the caller's order, of the
// tetrahedra that nearest.comp has found. Points whose search has not ended are passed over.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/separate.glsl"
ARGUMENTS(7)
    uint count;
    uint stride; // floats from one point to the next
END_ARGUMENTS
GRID(0, readonly)
RECORDS(1, uvec4, cells)
RECORDS(2, vec4, vertices)
RECORDS(3, uvec4, neighbours)
BUFFER(4, readonly, float, points)
BUFFER16(5, readonly, NearState, states)
BUFFER16(6, writeonly, vec4, barycentrics)
#include "shared/vertices.glsl"
#include "shared/points.glsl"
#include "shared/patch.glsl"

void main() {
    uint i = item_index();
    if (i >= count) return;
    NearState state = states.at[i];
    if (state.code != NONE) return;
    vec4 w = vec4(0.0);
    if (state.owner != NONE) {
        Patch found = patch_of(state.owner, words(neighbours.at[state.owner]), normalise(grid.at[0], point(i, stride)));
        closest_on(found.v, found.faces, w);
        w = vec4(w[found.rank.x], w[found.rank.y], w[found.rank.z], w[found.rank.w]);
    }
    barycentrics.at[i] = w;
}
