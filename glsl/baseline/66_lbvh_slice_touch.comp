#version 460
// LBVH baseline: boxes of voxels in the binary tree.
#define BINARY_TREE
#include "query/slice_touch.glsl"
