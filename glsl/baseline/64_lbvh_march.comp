#version 460
// LBVH baseline: marches rays through the binary tree.
#define BINARY_TREE
#include "query/volume_march.glsl"
