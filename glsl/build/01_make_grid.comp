#version 460
// Makes the grid from the bounds (SPEC 2.1). Where the host divides floats, this kernel divides integers, since
// Vulkan's division is not correctly rounded. Where most of the tetrahedra lie in a small part of an axis, the grid is
// graded, by quantiles of a sample. One workgroup. Twin of src/mesh/grading.rs, which explains it.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/ordered.glsl"
ARGUMENTS(5)
    uint tets;
    uint stride; // floats from one point to the next
END_ARGUMENTS
BUFFER(0, readonly, MeshStatus, status)
BUFFER16(1, writeonly, Grid, grid)
BUFFER(2, readonly, float, positions)
RECORDS(3, uvec4, cells)
BUFFER(4, readonly, uint, bad)
#include "shared/positions.glsl"
#include "shared/bad.glsl"
#include "shared/mix_bits.glsl"

const uint SAMPLES = 256u; // Tetrahedra that are looked at.
const uint PLACES = 2u * SAMPLES; // As many even places as those of tetrahedra.
const float NOWHERE = 3.40282347e38;

shared float places[3][PLACES]; // distances from the lower corner, NOWHERE for a bad tetrahedron; sorted later
shared uint bad_samples;

float from_ordered(uint key) { return uintBitsToFloat(unordered(key)); }

// 1024 / e for a normal e, correctly rounded (to nearest, ties to even): long division of the mantissas.
float divide_1024(float e) {
    uint bits = floatBitsToUint(e);
    uint divisor = (bits & 0x007fffffu) | 0x00800000u;
    int exponent = int(bits >> 23) - 127;
    // The quotient 2^23 / (2^23 * m), m in [1, 2), lies in (1/2, 1]. It is doubled unless it is 1, so that its first
    // bit is set.
    uint remainder = 0x00800000u;
    int scale = 10 - exponent + 127;
    if (divisor != 0x00800000u) {
        remainder <<= 1;
        scale -= 1;
    }
    uint quotient = 0u;
    [[dont_unroll]] for (int i = 0; i < 25; ++i) { // 24 bits, and one for rounding
        quotient = quotient << 1 | uint(remainder >= divisor);
        if (remainder >= divisor) remainder -= divisor;
        remainder <<= 1;
    }
    bool up = (quotient & 1u) != 0u && (remainder != 0u || (quotient & 2u) != 0u);
    quotient = (quotient >> 1) + uint(up);
    // A carry out of the mantissa increments the exponent.
    return uintBitsToFloat((uint(scale) << 23) + (quotient - 0x00800000u));
}

// Distance from the lower corner of a place of sample k within its tetrahedron, along one axis.
float place_of(uint k, vec4 corners, float lo) {
    float a = canonical(corners.x), b = canonical(corners.y), c = canonical(corners.z), d = canonical(corners.w);
    float least = min(min(a, b), min(c, d)), most = max(max(a, b), max(c, d));
    precise float part = float(k * 0x9e3779b9u >> 8) * two_to(-24);
    precise float at = least + canonical(most - least) * part;
    precise float away = canonical(at) - lo;
    return max(canonical(away), 0.0);
}

void take_sample(uint k, vec3 lo, vec3 extent) {
    uint each = tets / SAMPLES;
    uint t = k * each + k * (tets % SAMPLES) / SAMPLES + (each == 0u ? 0u : mix_bits(k) % each);
    bool ok = !is_bad(t);
    if (!ok) atomicAdd(bad_samples, 1u);
    vec3 v[4];
    uvec4 ids = ok ? words(cells.at[t]) : uvec4(0u);
    for (uint i = 0u; i < 4u && ok; ++i) v[i] = position(ids[i], stride);
    [[dont_unroll]] for (uint c = 0u; c < 3u; ++c) {
        places[c][2u * k] = ok ? place_of(k, vec4(v[0][c], v[1][c], v[2][c], v[3][c]), lo[c]) : NOWHERE;
        precise float even = extent[c] * (float(k) * two_to(-8));
        places[c][2u * k + 1u] = even;
    }
}

// Sorts the places of all axes at once, by a bitonic network.
void sort_places() {
    [[dont_unroll]] for (uint run = 2u; run <= PLACES; run *= 2u) {
        [[dont_unroll]] for (uint apart = run / 2u; apart > 0u; apart /= 2u) {
            for (uint k = local_index(); k < 3u * PLACES / 2u; k += WORKGROUP) {
                uint c = k / (PLACES / 2u), pair = k % (PLACES / 2u);
                uint i = 2u * pair - pair % apart, j = i + apart; // i has no bit of `apart`
                float a = places[c][i], b = places[c][j];
                bool falls = (i & run) != 0u;
                places[c][i] = falls ? max(a, b) : min(a, b);
                places[c][j] = falls ? min(a, b) : max(a, b);
            }
            barrier();
        }
    }
}

float quantile(uint c, uint j, float extent) {
    return j == 0u ? 0.0 : j >= STRETCHES ? extent : min(places[c][j * (PLACES - bad_samples) / STRETCHES], extent);
}

// Whether a quarter of the stretches between quantiles are less than a quarter as wide as even ones.
bool is_steep(uint c, float extent) {
    precise float narrow = extent * two_to(-6);
    uint count = 0u;
    [[dont_unroll]] for (uint j = 0u; j < STRETCHES; ++j) {
        precise float width = quantile(c, j + 1u, extent) - quantile(c, j, extent);
        count += uint(width < narrow);
    }
    return 4u * count >= STRETCHES;
}

// Where stretch j begins: at the quantile, moved a little to where it would be in a grid that is not graded.
float knot_at(uint c, uint j, float extent, bool steep) {
    precise float even = extent * (float(j) * two_to(-4));
    precise float part = quantile(c, j, extent) * (1.0 - two_to(-6));
    precise float moved = part + even * two_to(-6);
    return j >= STRETCHES ? extent : steep ? moved : even;
}

void main() {
    vec3 lo = vec3(0.0), hi = vec3(0.0), extent = vec3(0.0);
    bool any_cell = status.at[0].hi[0] != 0u;
    for (uint c = 0u; any_cell && c < 3u; ++c) {
        lo[c] = from_ordered(~status.at[0].lo[c]);
        hi[c] = from_ordered(status.at[0].hi[c]);
        precise float d = hi[c] - lo[c];
        extent[c] = canonical(d);
    }
    if (local_index() == 0u) bad_samples = 0u;
    barrier();
    for (uint k = local_index(); any_cell && k < SAMPLES; k += WORKGROUP) take_sample(k, lo, extent);
    barrier();
    sort_places();
    const float MIN_EXTENT = uintBitsToFloat((127u - 103u) << 23);
    float largest = MIN_EXTENT;
    vec3 inv = vec3(0.0);
    bvec3 steep = bvec3(false);
    [[dont_unroll]] for (uint c = 0u; c < 3u; ++c) {
        largest = max(largest, extent[c]);
        if (extent[c] < MIN_EXTENT) continue;
        inv[c] = divide_1024(extent[c]);
        steep[c] = is_steep(c, extent[c]);
    }
    for (uint j = local_index(); j <= STRETCHES; j += WORKGROUP) {
        vec4 begin = vec4(0.0), rates = vec4(0.0);
        [[dont_unroll]] for (uint c = 0u; c < 3u && any(steep); ++c) {
            if (inv[c] == 0.0) continue;
            begin[c] = knot_at(c, j, extent[c], steep[c]);
            precise float width = knot_at(c, j + 1u, extent[c], steep[c]) - begin[c];
            precise float rate = divide_1024(width) * two_to(-4); // STRETCH_CELLS / width
            rates[c] = rate;
        }
        grid.at[0].knots[j] = begin;
        if (j < STRETCHES) grid.at[0].rates[j] = rates;
    }
    if (local_index() > 0u) return;
    Grid g;
    g.lo = vec4(lo, 0.0);
    uint exponent = floatBitsToUint(largest) >> 23;
    g.scale = uintBitsToFloat((254u - exponent) << 23);
    grid.at[0].lo = g.lo;
    grid.at[0].hi = vec4(hi, 0.0);
    grid.at[0].inv = vec4(inv, 0.0);
    grid.at[0].extent = vec4(normalise(g, hi), 0.0);
    grid.at[0].scale = g.scale;
    grid.at[0].level = MAX_LEVEL;
    grid.at[0].first_leaf = 0u;
    grid.at[0].ids = NONE;
    grid.at[0].slabs = 0u;
    grid.at[0].longest = 0u;
    grid.at[0].graded = uint(any(steep));
    grid.at[0].pad = 0u;
}
