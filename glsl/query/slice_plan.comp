#version 460
// Slicing (SPEC 3.4), first kernel: prepares the voxels for the other kernels, from the units of the mesh and the
// bounds, which only the device knows. Twin of `VoxelGrid::over` in src/slicing/mod.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
ARGUMENTS(2)
    float origin[3];
    float next_voxel[3];
    float next_row[3];
    float next_layer[3];
    float half0[3];
    float half1[3];
    float half2[3];
    uint width;
    uint height;
    uint layer;
    uint first;
    uint rows;
    uint first_cell;
    uint last_cell;
END_ARGUMENTS
GRID(0, readonly)
BUFFER16(1, writeonly, SliceUniforms, plans)

vec4 wide(float a[3]) { return vec4(a[0], a[1], a[2], 0.0); }

// Rounds to the nearest integer, halves away from 0. The difference to the floor is exact; x + 0.5 is not.
float rounded(float x) {
    float whole = floor(abs(x));
    precise float rest = abs(x) - whole;
    float up_or_down = rest >= 0.5 ? whole + 1.0 : whole;
    return x < 0.0 ? -up_or_down : up_or_down;
}

// x in normalised coordinates, in steps of 2^-42. Devices may flush denormals, so these are converted by their
// mantissa.
float steps(float x, float scale) {
    uint bits = floatBitsToUint(x);
    if ((bits & 0x7f800000u) == 0u) {
        precise float small = float(bits & 0x007fffffu) * (scale * two_to(-67));
        return (bits & 0x80000000u) != 0u ? -small : small;
    }
    precise float unit = x * scale;
    precise float many = canonical(unit) * two_to(82);
    return many;
}

// A half axis, its longest component (the first of several) longer by `gap`.
vec4 grown(vec4 axis, float gap) {
    uint longest = 0u;
    for (uint c = 1u; c < 3u; ++c) longest = abs(axis[c]) > abs(axis[longest]) ? c : longest;
    for (uint c = 0u; c < 3u; ++c) {
        precise float more = axis[c] + (axis[c] < 0.0 ? -gap : gap);
        if (c == longest) axis[c] = more;
    }
    return axis;
}

void main() {
    if (item_index() > 0u) return;
    Grid g = grid.at[0];
    SliceUniforms plan;
    plan.origin = wide(origin);
    plan.next_voxel = wide(next_voxel);
    plan.next_row = wide(next_row);
    plan.next_layer = wide(next_layer);
    plan.width = width;
    plan.height = height;
    plan.layer = layer;
    plan.first = first;
    plan.rows = rows;
    plan.listed = 0u;
    plan.first_cell = first_cell;
    plan.last_cell = last_cell;
    // 2 / scale: larger half axes are refused as they are, since scaling them could overflow.
    float most = uintBitsToFloat((255u << 23) - floatBitsToUint(g.scale));
    vec4 axes[3] = vec4[3](wide(half0), wide(half1), wide(half2)), normalised[3];
    bool flat_box = false, large = false;
    for (uint k = 0u; k < 3u; ++k) {
        bool nothing = true;
        normalised[k] = vec4(0.0);
        for (uint c = 0u; c < 3u; ++c) {
            float x = axes[k][c];
            if (abs(x) > most) {
                large = true;
                continue;
            }
            precise float fine = rounded(steps(x, g.scale)) * two_to(-42);
            normalised[k][c] = fine;
            nothing = nothing && fine == 0.0;
        }
        flat_box = flat_box || nothing;
    }
    float largest = 0.0;
    plan.reach = vec4(0.0);
    for (uint c = 0u; c < 3u; ++c) {
        precise float sum = (abs(normalised[0][c]) + abs(normalised[1][c])) + abs(normalised[2][c]);
        large = large || sum > two_to(41);
        precise float extent = g.hi[c] - g.lo[c];
        largest = max(largest, canonical(extent));
    }
    // Centres are rounded. Half axes grow so that boxes side by side leave no gap; see the twin.
    float far = 0.0;
    for (uint c = 0u; c < 3u; ++c) far = max(far, canonical(max(abs(g.lo[c]), abs(g.hi[c]))));
    precise float scaled = far * g.scale;
    precise float gap = ceil(canonical(scaled) * two_to(62)) * two_to(-42);
    for (uint c = 0u; c < 3u; ++c) {
        precise float sum = (abs(axes[0][c]) + abs(axes[1][c])) + abs(axes[2][c]);
        precise float own = sum * (1.0 + 1.0 / 1024.0);
        precise float away = far * (1.0 / 262144.0);
        precise float more = largest * (1.0 / 16384.0) + canonical(away);
        precise float reach = own + more;
        plan.reach[c] = reach;
    }
    plan.half0 = grown(normalised[0], gap);
    plan.half1 = grown(normalised[1], gap);
    plan.half2 = grown(normalised[2], gap);
    plan.refused = large ? 2u : uint(flat_box);
    plans.at[0] = plan;
}
