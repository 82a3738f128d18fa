#version 460
// Depth, 1 of 2 (SPEC 2.4): sums the estimates of Eq. 11, and counts the candidates (the entries with `Aabb`) that
// every level would have. Also finds out on which levels a tetrahedron has more than SHARE of them.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/share.glsl"
ARGUMENTS(5)
    uint tets;
    uint stride;
    uint tile; // tetrahedra per workgroup
END_ARGUMENTS
GRID(0, readonly)
BUFFER(1, readonly, float, positions)
RECORDS(2, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, READ_WRITE, BuildStatus, status)
#include "shared/positions.glsl"
#include "shared/bad.glsl"

// 64-bit sums of the workgroup: element 0 sums the estimates, element 1 + k the candidates of level k.
shared uint low[12];
shared uint high[12];

// Adds the 64-bit number (lo, hi) to the one in two words.
#define ADD_WIDE(low_word, high_word, lo, hi)                     \
    {                                                             \
        uint carry = uint(atomicAdd(low_word, lo) > NONE - (lo)); \
        if ((hi) + carry > 0u) atomicAdd(high_word, (hi) + carry); \
    }

void main() {
    for (uint i = local_index(); i < 12u; i += WORKGROUP) low[i] = high[i] = 0u;
    barrier();
    Grid g = grid.at[0];
    uint large = 0u;
    uvec2 sums[12];
    for (uint i = 0u; i < 12u; ++i) sums[i] = uvec2(0u);
    uvec2 items = items_of_tile(tile, tets);
    for (uint t = items.x; t < items.y; t += gl_SubgroupSize) {
        if (is_bad(t)) continue;
        uvec4 ids = words(cells.at[t]);
        vec3 a = position(ids.x, stride), b = position(ids.y, stride), c = position(ids.z, stride), d = position(ids.w, stride);
        vec3 lo = min(min(a, b), min(c, d)), hi = max(max(a, b), max(c, d));
        lo = vec3(canonical(lo.x), canonical(lo.y), canonical(lo.z));
        hi = vec3(canonical(hi.x), canonical(hi.y), canonical(hi.z));
        precise vec3 size = hi - lo;
        precise vec3 extent = vec3(canonical(size.x), canonical(size.y), canonical(size.z)) * g.inv.xyz;
        if (g.graded != 0u) extent = in_cells(g, from_corner(g, hi)) - in_cells(g, from_corner(g, lo));
        extent = floor(extent);
        float largest = min(max(max(extent.x, extent.y), extent.z), 1024.0);
        sums[0].x += max(floatBitsToUint(largest) >> 23, 127u) - 127u; // its base-2 logarithm, rounded down, at least 0
        // Since quantization is monotone, these are the corners of the box of the vertices' cells.
        uvec3 first = quantize(g, lo), last = quantize(g, hi);
        [[unroll]] for (uint level = 0u; level <= MAX_LEVEL; ++level) {
            uvec3 n = (last >> MAX_LEVEL - level) - (first >> MAX_LEVEL - level) + 1u;
            uint before = sums[1u + level].x, product = n.x * n.y * n.z;
            sums[1u + level].x = before + product;
            sums[1u + level].y += uint(before > NONE - product);
            large |= uint(product > SHARE) << level;
        }
    }
    large = subgroupOr(large);
    if (subgroupElect() && large != 0u) atomicOr(status.at[0].large_levels, large);
    [[unroll]] for (uint i = 0u; i < 12u; ++i) {
        // The subgroup's sum, by halves of the low word, which do not overflow.
        uint halves = subgroupAdd(sums[i].x & 0xffffu), others = subgroupAdd(sums[i].x >> 16), above = subgroupAdd(sums[i].y);
        uint upper = others + (halves >> 16);
        uvec2 sum = uvec2(upper << 16 | (halves & 0xffffu), above + (upper >> 16));
        if (subgroupElect()) ADD_WIDE(low[i], high[i], sum.x, sum.y)
    }
    barrier();
    for (uint i = local_index(); i < 12u; i += WORKGROUP) {
        uint k = 2u * i;
        if (i == 0u) ADD_WIDE(status.at[0].sum[0], status.at[0].sum[1], low[i], high[i])
        else ADD_WIDE(status.at[0].total[k - 2u], status.at[0].total[k - 1u], low[i], high[i])
    }
}
