#version 460
// Writes 16 bytes per vertex: its normalised coordinates, which every query reads, and its cell of the finest grid,
// which the construction and the search of lists read.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(3)
    uint points;
    uint stride; // floats from one point to the next
END_ARGUMENTS
GRID(0, readonly)
BUFFER(1, readonly, float, positions)
BUFFER16(2, writeonly, uvec4, vertices)
#include "shared/positions.glsl"

void main() {
    uint i = item_index();
    if (i >= points) return;
    vec3 x = position(i, stride);
    Grid g = grid.at[0];
    vertices.at[i] = uvec4(floatBitsToUint(normalise(g, x)), pack_cell(quantize(g, x)));
}
