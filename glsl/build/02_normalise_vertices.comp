#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
// Vertices in normalised coordinates, 16 bytes each: what every query reads.
ARGUMENTS(3)
    uint points;
    uint stride; // floats from one point to the next
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER(1, readonly, float, positions)
BUFFER16(2, writeonly, vec4, vertices)

void main() {
    uint i = item_index();
    if (i >= points) return;
    vec3 x = vec3(positions.at[i * stride], positions.at[i * stride + 1u], positions.at[i * stride + 2u]);
    vertices.at[i] = vec4(normalise(grid.at[0], x), 0.0);
}
