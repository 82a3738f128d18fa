#version 460
// LBVH baseline: tests the boxes of voxels in the binary tree.
#define BINARY_TREE
#include "query/slice_touch.glsl"
