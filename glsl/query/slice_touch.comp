#version 460
// Boxes of voxels in the octree.
#include "query/slice_touch.glsl"
