#version 460
// Ray tracing baseline, closest-hit shader: the number of the face, and whether the ray meets its front.
#extension GL_EXT_ray_tracing : require
layout(location = 0) rayPayloadInEXT uvec2 face;

void main() { face = uvec2(gl_PrimitiveID, gl_HitKindEXT == gl_HitKindFrontFacingTriangleEXT ? 1u : 0u); }
