#version 460
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
// Depth, 1 of 2 (SPEC 2.4): the sum of the estimates of Eq. 11, and the number of entries that every level would have.
ARGUMENTS(5)
    uint tets;
    uint stride;
    uint groups;
END_ARGUMENTS
BUFFER16(0, readonly, Grid, grid)
BUFFER(1, readonly, float, positions)
RECORDS(2, uvec4, cells)
BUFFER(3, readonly, uint, bad)
BUFFER(4, READ_WRITE, BuildStatus, status)
#include "shared/positions.glsl"
#include "shared/bad.glsl"

// 64-bit sums of the workgroup: 0 the estimates, 1 + k the entries of level k.
shared uint low[12];
shared uint high[12];

void add(uint i, uint lo, uint hi) {
    uint carry = uint(atomicAdd(low[i], lo) > NONE - lo);
    if (hi + carry > 0u) atomicAdd(high[i], hi + carry);
}

void main() {
    for (uint i = local_index(); i < 12u; i += WORKGROUP) low[i] = high[i] = 0u;
    barrier();
    Grid g = grid.at[0];
    uvec2 sums[12];
    for (uint i = 0u; i < 12u; ++i) sums[i] = uvec2(0u);
    for (uint t = item_index(); t < tets; t += groups * WORKGROUP) {
        if (is_bad(t)) continue;
        uvec4 ids = words(cells.at[t]);
        vec3 lo = position(ids.x, stride), hi = lo;
        for (uint i = 1u; i < 4u; ++i) {
            vec3 p = position(ids[i], stride);
            lo = min(lo, p);
            hi = max(hi, p);
        }
        lo = vec3(canonical(lo.x), canonical(lo.y), canonical(lo.z));
        hi = vec3(canonical(hi.x), canonical(hi.y), canonical(hi.z));
        precise vec3 d = hi - lo;
        precise vec3 extent = floor(vec3(canonical(d.x), canonical(d.y), canonical(d.z)) * g.inv.xyz);
        float largest = min(max(max(extent.x, extent.y), extent.z), 1024.0);
        uint across = uint(largest);
        sums[0].x += across == 0u ? 0u : uint(findMSB(across));
        uvec3 first = quantize(g, lo), last = quantize(g, hi); // the box of the vertices' cells, since quantization is monotone
        for (uint level = 0u; level <= MAX_LEVEL; ++level) {
            uvec3 n = (last >> MAX_LEVEL - level) - (first >> MAX_LEVEL - level) + 1u;
            uint before = sums[1u + level].x, product = n.x * n.y * n.z;
            sums[1u + level].x = before + product;
            sums[1u + level].y += uint(before > NONE - product);
        }
    }
    for (uint i = 0u; i < 12u; ++i) add(i, sums[i].x, sums[i].y);
    barrier();
    for (uint i = local_index(); i < 12u; i += WORKGROUP) {
        uint lo = low[i];
        uint carry, hi = high[i];
        if (i == 0u) {
            carry = uint(atomicAdd(status.at[0].sum[0], lo) > NONE - lo);
            if (hi + carry > 0u) atomicAdd(status.at[0].sum[1], hi + carry);
        } else {
            uint k = 2u * (i - 1u);
            carry = uint(atomicAdd(status.at[0].total[k], lo) > NONE - lo);
            if (hi + carry > 0u) atomicAdd(status.at[0].total[k + 1u], hi + carry);
        }
    }
}
