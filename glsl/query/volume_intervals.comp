#version 460
// Ray intervals in the octree.
#include "query/volume_intervals.glsl"
