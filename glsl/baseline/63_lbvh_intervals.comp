#version 460
// LBVH baseline: ray intervals in the binary tree.
#define BINARY_TREE
#include "query/volume_intervals.glsl"
