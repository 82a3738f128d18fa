// Stretches of a ray where nothing is visible. Twin of src/reference/volume/skip.rs. Needs tree.glsl, rays.glsl, a
// `view` and a `plan`. The marks of visible nodes follow the boundary flags, from word `visible_at` of the plan on.
#ifdef BINARY_TREE
const uint SKIP = 0u;
#else
layout(constant_id = 5) const uint SKIP = 0;
#include "shared/boxes.glsl"

bool is_visible_node(uint node) { return (flags.at[plan.visible_at + (node >> 5u)] >> (node & 31u) & 1u) != 0u; }

// The sample after those samples from `k` on and before `end` that lie in the same cell of `level` as sample `k`, whose
// cell of the finest grid is `finest`. Rounding cannot lose a sample: the positions of a ray's samples and their cells
// are monotone, so every sample between two samples of a cell lies in that cell.
uint sample_behind(Grid g, vec3 origin, vec3 direction, vec3 inverse_direction, uint k, uint end, uvec3 finest, uint level) {
    uint shift = MAX_LEVEL - level;
    uvec3 cell = finest >> shift;
    vec3 sides = cell_sides(g, level, cell + uvec3(greaterThan(inverse_direction, vec3(0.0))));
    float leave = 3.40282347e38;
    for (uint c = 0u; c < 3u; ++c) {
        if (g.inv[c] == 0.0) continue;
        precise float t = (sides[c] - origin[c]) * inverse_direction[c];
        leave = min(leave, t);
    }
    precise float number = leave * view.inverse_step - 0.5;
    uint last = min(whole_of(clamp(number, float(k), float(end - 1u))), end - 1u);
    for (uint i = 0u; i < 2u && last > k; ++i) {
        if (quantize(g, sample_at(view, origin, direction, last)) >> shift == cell) return last + 1u;
        --last;
    }
    return k + 1u;
}

// The sample after those samples from `k` on and before `end` that lie in the same node as sample `k`: the highest node
// without anything visible (`hidden`), or else the leaf. Rounding cannot lose a sample, as in `sample_behind`.
uint stretch_end(Grid g, vec3 origin, vec3 direction, vec3 inverse_direction, uint k, uint end, out bool hidden) {
    uvec3 finest = quantize(g, sample_at(view, origin, direction, k));
    uint code = morton(finest), node = 0u, level = 0u;
    hidden = !is_visible_node(node);
    while (!hidden && level < g.level) {
        ++level;
        uint digit = code >> (3u * (MAX_LEVEL - level)) & 7u, mask = child_mask(node);
        hidden = (mask >> digit & 1u) == 0u;
        if (hidden) break;
        node = child_of(node, mask, digit);
        hidden = !is_visible_node(node);
    }
    return sample_behind(g, origin, direction, inverse_direction, k, end, finest, level);
}
#endif
