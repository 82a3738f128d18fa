#version 460
// The inside of the body: every fragment asks the tree for the tetrahedron that contains it, and shows the field there.
#include "olbvh.glsl"
#include "colour.glsl"
layout(location = 0) in vec3 place;
layout(location = 0) out vec4 colour;
layout(push_constant) uniform Push { mat4 camera; vec4 plane; vec4 corner; vec4 right; uvec2 tree; };

void main() {
    olbvh_open(tree);
    vec4 weights;
    uint owner = olbvh_locate(place, 0.0, weights);
    if (owner == OLBVH_NONE) discard;
    colour = vec4(colour_of(olbvh_value(owner, weights)), 1.0);
}
