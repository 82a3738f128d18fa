// A tree as queries see it (SPEC 2.5). The including kernel declares: grid, masks, co, po, p, and where used flags, cells, vertices.

#include "shared/children.glsl"

// The leaf that stands for a cell of the finest grid, by descent over child masks; NONE if there is none.
uint find_leaf(uint level, uvec3 finest) { return find_node(0u, 0u, level, morton(finest) >> (3u * (MAX_LEVEL - level))); }

// First entry of a leaf and the one behind its last.
uvec2 entry_range(uint leaf) {
    uint i = leaf - grid.at[0].first_leaf;
    return uvec2(po.at[i], po.at[i + 1u]);
}
