#version 460
// Blends the colours of the volume, which are premultiplied, over the picture.
layout(location = 0) out vec4 colour;
layout(set = 0, binding = 0, std430) readonly buffer Colours { vec4 colours[]; };
layout(push_constant) uniform Push { uint width; };

void main() { colour = colours[uint(gl_FragCoord.y) * width + uint(gl_FragCoord.x)]; }
