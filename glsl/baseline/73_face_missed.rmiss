#version 460
// Ray tracing baseline, miss shader: the ray meets no face.
#extension GL_EXT_ray_tracing : require
layout(location = 0) rayPayloadInEXT uvec2 face;

void main() { face = uvec2(0xffffffffu, 0u); }
