#version 460
// Centres of voxels in the octree.
#include "query/slice_locate.glsl"
