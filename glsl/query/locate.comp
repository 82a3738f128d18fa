#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
// Point location by descent over child masks (SPEC 3.1), then by a list or a walk. Lists are searched in slices of at most SLICE entries per dispatch; between slices
// the best candidate waits in the outputs.
layout(constant_id = 2) const uint HINTS = 0;
layout(constant_id = 3) const uint SLICE = 16384;
layout(constant_id = 4) const uint LISTS = 0;
ARGUMENTS(13)
    uint count;
    uint stride; // floats from one point to the next
    uint slice;  // number of this dispatch
    uint last;   // not 0: lists end in this slice
    float tolerance;
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER(1, readonly, uint, masks)
BUFFER(2, readonly, uint, co)
BUFFER(3, readonly, uint, po)
BUFFER(4, readonly, uint, p)
BUFFER(5, readonly, uint, flags)
BUFFER16(6, readonly, uvec4, cells)
BUFFER16(7, readonly, vec4, vertices)
BUFFER(8, readonly, float, points)
BUFFER(9, readonly, uint, hints)
BUFFER(10, READ_WRITE, uint, owners)
BUFFER16(11, READ_WRITE, vec4, barycentrics) // between slices: inside, in_box, smallest
BUFFER16(12, readonly, uvec4, neighbours)
#include "shared/tree.glsl"
#include "shared/owner_list.glsl"
#include "shared/owner_walk.glsl"

void main() {
    uint i = item_index();
    if (i >= count) return;
    Grid g = grid.at[0];
    vec3 at = vec3(points.at[i * stride], points.at[i * stride + 1u], points.at[i * stride + 2u]);
    uint leaf = near_bounds(g, at) ? find_leaf(g.level, quantize(g, at)) : NONE;
    if (leaf == NONE) {
        owners.at[i] = NONE;
        barycentrics.at[i] = vec4(0.0);
        return;
    }
    vec3 x = normalise(g, at);
    Best best = no_best();
    uint hint = HINTS != 0u && slice == 0u ? hints.at[i] : NONE;
    if (slice > 0u) {
        vec4 state = barycentrics.at[i];
        best = Best(owners.at[i], state.x != 0.0, state.y != 0.0, state.z);
    } else if (hint != NONE) {
        Weights w = weights(load_tet(cells.at[hint]), x);
        if (w.clear) best = Best(hint, true, true, 0.0);
    }
    uvec2 range = entry_range(leaf);
    if (slice == 0u && !best.inside) best = walked(g, leaf, range, hint, at, x);
    if (!best.inside && !walks_in(leaf, range)) {
        uint begin = min(range.y, range.x + slice * SLICE);
        search(best, begin, min(range.y, begin + SLICE), x);
    }
    if (last == 0u) {
        owners.at[i] = best.owner;
        barycentrics.at[i] = vec4(float(best.inside), float(best.in_box), best.smallest, 0.0);
        return;
    }
    uint owner = decide(best, leaf, tolerance);
    owners.at[i] = owner;
    vec4 b = vec4(0.0);
    if (owner != NONE) {
        Tet tet = load_tet(cells.at[owner]);
        b = barycentric(weights(tet, x), tet.rank);
    }
    barycentrics.at[i] = b;
}
