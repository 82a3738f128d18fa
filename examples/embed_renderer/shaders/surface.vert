#version 460
// The surface of the body, with its near side cut away.
layout(location = 0) in vec3 position;
layout(location = 1) in float value;
layout(location = 0) out vec3 place;
layout(location = 1) out float shown;
layout(push_constant) uniform Push { mat4 camera; vec4 plane; };
out gl_PerVertex { vec4 gl_Position; float gl_ClipDistance[1]; };

void main() {
    place = position;
    shown = value;
    gl_Position = camera * vec4(position, 1.0);
    gl_ClipDistance[0] = dot(plane, vec4(position, 1.0));
}
