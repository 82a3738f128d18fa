#version 460
// Tests the boxes of voxels in the octree.
#include "query/slice_touch.glsl"
