// Ray tracing baseline: the first face that a short ray from a point meets gives the tetrahedron around the point (Wald
// et al. 2019). The device's intersections are not exact, so a tetrahedron is an answer only if it contains the point;
// a point whose ray slips past an edge is not found. The including shader traces the ray.
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
ARGUMENTS(8)
    uvec2 scene; // address of the acceleration structure
    uint count;
    uint stride;
END_ARGUMENTS
GRID(0, readonly)
ALIGNED_BUFFER(8, 1, readonly, uvec2, sides)
BUFFER(2, readonly, uint, longest)
RECORDS(3, uvec4, cells)
RECORDS(4, vec4, vertices)
BUFFER(5, readonly, float, points)
BUFFER(6, writeonly, uint, owners)
BUFFER16(7, writeonly, vec4, barycentrics)
#include "shared/best_owner.glsl"
#include "shared/points.glsl"

const vec3 WAY = vec3(0.36, 0.48, 0.8); // of unit length, and in no plane of a regular grid
// 2^-40, from normalised coordinates to those of the scene, [0, 2), where the device's arithmetic cannot overflow.
const float SCALE = 9.094947017729282379150390625e-13;

// The first face that the ray meets, or NONE, and whether the ray meets its front.
uvec2 first_face(vec3 origin, float most);

void locate(uint i) {
    if (i >= count) return;
    Grid g = grid.at[0];
    vec3 at = point(i, stride);
    uint owner = NONE;
    vec4 b = vec4(0.0);
    if (near_bounds(g, at)) {
        vec3 x = normalise(g, at);
        uvec2 face = first_face(x * SCALE, uintBitsToFloat(longest.at[0]) * (1.0625 * SCALE));
        if (face.x != NONE) {
            uvec2 pair = sides.at[face.x];
            // Almost certainly, the point lies in the tetrahedron on the side that the ray comes from.
            pair = face.y != 0u ? pair.xy : pair.yx;
            for (uint side = 0u; side < 2u && owner == NONE; ++side) {
                if (pair[side] == NONE) continue;
                Tet tet = load_tet(words(cells.at[pair[side]]));
                if (!weights(tet, x).inside) continue;
                owner = pair[side];
                b = barycentric(tet, x);
            }
        }
    }
    owners.at[i] = owner;
    barycentrics.at[i] = b;
}
