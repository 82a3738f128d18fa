#version 460
// LBVH baseline: locates the centres of voxels in the binary tree.
#define BINARY_TREE
#include "query/slice_locate.glsl"
