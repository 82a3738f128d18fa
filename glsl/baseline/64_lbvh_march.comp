#version 460
// LBVH baseline: marching in the binary tree.
#define BINARY_TREE
#include "query/volume_march.glsl"
