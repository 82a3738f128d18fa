#version 460
// Marching in the octree.
#include "query/volume_march.glsl"
