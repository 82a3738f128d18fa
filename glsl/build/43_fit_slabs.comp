#version 460
// Leaves 3, where they have slabs: the slab of each leaf, behind PO. See src/reference/slabs.rs.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/tet.glsl"
NO_SCALARS(9)
GRID(0, readonly)
BUFFER(1, readonly, BuildStatus, status)
BUFFER(2, readonly, uint, codes)
BUFFER(3, READ_WRITE, uint, po)
BUFFER(4, readonly, uint, p)
BUFFER(5, readonly, uint, flags)
RECORDS(6, uvec4, cells)
RECORDS(7, vec4, vertices)
RECORDS(8, uvec4, neighbours)
#include "shared/boundary_node.glsl"
#include "shared/vertices.glsl"
#include "shared/slab.glsl"

const uint MAX_LIST_FOR_SLAB = 16384u; // Leaves with longer lists have no slab.
const uint LOOKED_AT = 16u; // Tetrahedra of a list whose faces may give the normal.
const uint PLACES = 4u * LOOKED_AT - 1u; // Bits for the place of a face among these.

// The corners of a tetrahedron in the caller's order.
vec3[4] corners_of(uint t) {
    uvec4 ids = words(cells.at[t]);
    return vec3[4](vertex(ids.x), vertex(ids.y), vertex(ids.z), vertex(ids.w));
}

uint normal_bits(vec3 n) {
    vec3 a = abs(n);
    uint axis = a.x >= a.y && a.x >= a.z ? 0u : 2u - uint(a.y >= a.z);
    float x = axis == 0u ? n.x : axis == 1u ? n.y : n.z, y = axis == 0u ? n.y : axis == 1u ? n.z : n.x;
    float z = axis == 0u ? n.z : axis == 1u ? n.x : n.y;
    float r = uintBitsToFloat(floatBitsToUint(reciprocal(x)) + (6u << 23u)); // 64 / x; drivers may fuse a product with 64
    precise vec2 part = vec2(y, z) * r + 64.5;
    part = clamp(part, vec2(0.0), vec2(127.0));
    return axis << 30 | whole_of(part.y) << 23 | whole_of(part.x) << 16;
}

// The bits of the normal of the largest boundary face among the first entries of [first, last), which the whole subgroup
// looks for together. Returns false if there is none.
bool largest_face(Grid g, uint first, uint last, SlabCell cell, out uint bits) {
    uint largest = 0u; // size and place of a face
    vec3 normal = vec3(0.0);
    last = min(last, first + LOOKED_AT);
    for (uint i = first + gl_SubgroupInvocationID; i < last; i += gl_SubgroupSize) {
        uint t = p.at[i] & g.ids;
        uvec4 beside = words(neighbours.at[t]);
        if (all(notEqual(beside, uvec4(NONE)))) continue;
        vec3 v[4] = corners_of(t);
        for (uint f = 0u; f < 4u; ++f) {
            uvec3 face = FACES[f];
            precise vec3 b = (v[face.y] - v[face.x]) * cell.inverse, c = (v[face.z] - v[face.x]) * cell.inverse;
            vec3 n = cross_product(b, c), a = abs(n);
            uint face_key = (floatBitsToUint(max(max(a.x, a.y), a.z)) & ~PLACES) | (PLACES - (4u * (i - first) + f));
            if (beside[f] != NONE || face_key <= largest) continue;
            largest = face_key;
            normal = n;
        }
    }
    uint most = subgroupMax(largest);
    bits = subgroupMax(largest == most ? normal_bits(normal) : 0u); // one face has this size and place
    return most > PLACES;
}

// A range of distances, enlarged by `by` and for the rounding of distances whose summands amount to `far`.
vec2 enlarged(float least, float most, float far, float by) {
    precise float more = by + (far * two_to(-16) + two_to(-10));
    precise vec2 r = vec2(least - more, most + more);
    return r;
}

// The smallest and the largest distance along n of a point in the cell that a tetrahedron may own.
vec2 range_of(Grid g, vec3 v[4], SlabCell cell, vec3 n) {
    Bounds box = bounds_of(v);
    precise vec3 beyond = g.extent.xyz * two_to(-9), size = (box.hi - box.lo) + beyond;
    precise float rounding = ((size.x * size.y) * size.z) * two_to(-18);
    float vol = abs(orient(v[0], v[1], v[2], v[3]));
    if (vol <= 4.0 * rounding) {
        precise vec3 lo = box.lo - beyond, hi = box.hi + beyond;
        vec3 a = in_cell(cell, lo), b = in_cell(cell, hi);
        precise vec3 from = n * a, to = n * b;
        vec3 lower = min(from, to), upper = max(from, to);
        precise float least = (lower.x + lower.y) + lower.z, most = (upper.x + upper.y) + upper.z;
        return enlarged(least, most, dot_product(abs(n), max(abs(a), abs(b))), 0.0);
    }
    float least = 3.40282347e38, most = -3.40282347e38;
    vec3 far = vec3(0.0);
    for (uint k = 0u; k < 4u; ++k) {
        vec3 y = in_cell(cell, v[k]);
        float d = dot_product(n, y);
        least = min(least, d);
        most = max(most, d);
        far = max(far, abs(y));
    }
    precise float room = vol - rounding;
    precise float e = two_to(-12) + rounding * reciprocal(room);
    precise float by = (3.0 * (most - least)) * e;
    return enlarged(least, most, dot_product(abs(n), far), by);
}

// The slab of a leaf with entries [first, last), for which the whole subgroup works together.
uint fitted(Grid g, uint first, uint last, uint code) {
    SlabCell cell = slab_cell(g, slab_scale(g), unmorton(code));
    uint bits;
    if (!largest_face(g, first, last, cell, bits)) return EVERYTHING;
    vec3 n = slab_normal(bits);
    uint lowest = 255u, highest = 0u;
    for (uint i = first + gl_SubgroupInvocationID; i < last; i += gl_SubgroupSize) {
        vec2 range = range_of(g, corners_of(p.at[i] & g.ids), cell, n);
        lowest = min(lowest, slab_place(range.x));
        highest = max(highest, slab_place(range.y));
    }
    return bits | subgroupMax(highest) << 8 | subgroupMin(lowest);
}

void main() {
    uint i = item_index();
    Grid g = grid.at[0];
    bool is_leaf = i < status.at[0].leaves && status.at[0].overflow == 0u;
    uint begin = 0u, end = 0u, code = 0u, slab = EVERYTHING;
    if (is_leaf && is_boundary_node(status.at[0].internal + i)) {
        begin = po.at[i];
        end = po.at[i + 1u];
        code = end > begin ? codes.at[end - 1u] : 0u;
    }
    bool asks = begin < end && end - begin <= MAX_LIST_FOR_SLAB && g.graded == 0u;
    while (subgroupAny(asks)) {
        bool turn = gl_SubgroupInvocationID == subgroupMin(asks ? gl_SubgroupInvocationID : NONE);
        uint of_leaf = fitted(g, subgroupMax(turn ? begin : 0u), subgroupMax(turn ? end : 0u), subgroupMax(turn ? code : 0u));
        if (turn) slab = of_leaf;
        asks = asks && !turn;
    }
    if (is_leaf) po.at[g.slabs + i] = slab;
}
