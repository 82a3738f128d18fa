#version 460
// Marches rays through the octree.
#include "query/volume_march.glsl"
