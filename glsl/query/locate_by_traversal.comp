#version 460
// Point location by the paper's traversal (SPEC 3.2), a baseline that must agree with the descent. The node predicate
// tests the point's cell, in integers.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/tree_buffers.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
#include "shared/node.glsl"
layout(constant_id = 2) const uint STACK = 8;
layout(constant_id = 3) const uint LISTS = 0;
// Most entries of a list for `LocateMethod::Traversal`: so many that no loop gets too long for a driver.
const uint MOST_TRAVERSED = 32000u;
ARGUMENTS(12)
    uint count;
    uint stride;
    float tolerance;
END_ARGUMENTS
TREE(0)
RECORDS(6, uvec4, cells)
RECORDS(7, vec4, vertices)
BUFFER(8, readonly, float, points)
BUFFER(9, writeonly, uint, owners)
BUFFER16(10, writeonly, vec4, barycentrics)
RECORDS(11, uvec4, neighbours)
#include "shared/tree.glsl"
#include "shared/owner_list.glsl"
#include "shared/owner_walk.glsl"
#include "shared/points.glsl"

uint point_code;
uint leaf_found;

bool visit_node(Node node) { return node.code == point_code >> (3u * (MAX_LEVEL - node.level)); }

bool visit_leaf(Node node) {
    leaf_found = node.index;
    return true;
}
#include "shared/traverse.glsl"

void main() {
    uint i = item_index();
    if (i >= count) return;
    Grid g = grid.at[0];
    vec3 at = point(i, stride);
    leaf_found = NONE;
    uint owner = NONE;
    vec4 b = vec4(0.0);
    vec3 x = normalise(g, at);
    if (in_reach(g, at, x, tolerance)) {
        point_code = morton(quantize(g, at));
        traverse(g.level);
    }
    if (leaf_found != NONE) {
        uvec2 range = entry_range(leaf_found);
        Best best = walked(g, leaf_found, range, at, x);
        uint end = walks_in(leaf_found, range) ? range.x : min(range.y, range.x + MOST_TRAVERSED);
        for (uint i = range.x; i < end && !best.inside; ++i) {
            uint t = listed_tet(i);
            Tet tet = load_tet(words(cells.at[t]));
            consider(best, t, tet, weights(tet, x));
        }
        owner = decide(best, leaf_found, tolerance);
        if (owner != NONE) b = barycentric(load_tet(words(cells.at[owner])), x);
    }
    owners.at[i] = owner;
    barycentrics.at[i] = b;
}
