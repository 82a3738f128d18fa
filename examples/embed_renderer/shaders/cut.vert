#version 460
// A square in the plane of the cut, drawn as two triangles.
layout(location = 0) out vec3 place;
layout(push_constant) uniform Push { mat4 camera; vec4 plane; vec4 corner; vec4 right; uvec2 tree; };

void main() {
    vec2 at = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
    place = corner.xyz + at.x * right.xyz + at.y * cross(plane.xyz, right.xyz);
    gl_Position = camera * vec4(place, 1.0);
}
