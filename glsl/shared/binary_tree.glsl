// The nodes of the baseline's binary tree and references to them. Needs nodes, ids, cells, vertices.
#include "shared/vertices.glsl"
const uint BINARY_LEAF = 1u << 31;     // the rest is a place among the sorted tetrahedra, not an internal node
const uint BINARY_BOUNDARY = 1u << 30; // a boundary tetrahedron is below
const uint BINARY_INDEX = BINARY_BOUNDARY - 1u;
const uint BINARY_DEPTH = 64u; // codes have 30 bits and places 29, so the tree is no deeper

// Box of a node or leaf in normalised coordinates.
void box_of(uint reference, out vec3 lo, out vec3 hi) {
    uint i = reference & BINARY_INDEX;
    if ((reference & BINARY_LEAF) != 0u) {
        uvec4 v = words(cells.at[ids.at[i]]);
        vec3 a = vertex(v.x), b = vertex(v.y), c = vertex(v.z), d = vertex(v.w);
        lo = min(min(a, b), min(c, d));
        hi = max(max(a, b), max(c, d));
    } else {
        lo = vec3(nodes.at[i].lo[0], nodes.at[i].lo[1], nodes.at[i].lo[2]);
        hi = vec3(nodes.at[i].hi[0], nodes.at[i].hi[1], nodes.at[i].hi[2]);
    }
}
