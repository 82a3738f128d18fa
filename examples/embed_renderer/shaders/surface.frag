#version 460
// The surface of the body, lit and coloured by the field.
#include "colour.glsl"
layout(location = 0) in vec3 place;
layout(location = 1) in float shown;
layout(location = 0) out vec4 colour;

void main() {
    vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
    colour = vec4(mix(colour_of(shown), vec3(0.8), 0.5) * (0.35 + 0.65 * abs(dot(normal, normalize(vec3(0.3, 0.5, 0.8))))), 1.0);
}
