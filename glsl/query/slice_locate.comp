#version 460
// Locates the centres of voxels in the octree.
#include "query/slice_locate.glsl"
