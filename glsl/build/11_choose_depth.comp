#version 460
// Depth, 2 of 2 (SPEC 2.4): chooses the largest level that the mean estimate allows (Eq. 12, in integers) and whose
// candidates and memory fit. Also plans the dispatch that counts candidates.
#include "shared/kernel.glsl"
#include "shared/layout.glsl"
#include "shared/grid.glsl"
#include "shared/clearing.glsl"
layout(constant_id = 2) const uint EACH = 64; // items per workgroup of that dispatch
ARGUMENTS(6)
    uint tets;
    uint alpha;    // in units of 1/65536
    uint requested; // level in place of the one by alpha; NONE: there is none
    uint capacity; // most candidates
    uint per_tet;  // most candidates per valid tetrahedron,
    uint ample;    // except that this many are always allowed
    uint deepest;  // deepest level allowed
    uint budget[2]; // most words of all arrays, low word first
    uint box_words; // words of a box, per node
    uint slab_words; // words of a slab, per leaf
    uint in_shares; // not 0: candidates are counted in shares
    uint marked;     // not 0: the dispatch also clears the marks of the level
END_ARGUMENTS
BUFFER(0, readonly, MeshStatus, mesh)
BUFFER16(1, writeonly, Grid, grid)
BUFFER(2, READ_WRITE, BuildStatus, status)
BUFFER(3, writeonly, uint, candidates) // word for the scans: candidates of the chosen level
BUFFER(4, writeonly, uint, live)       // counts to be scanned, see 20_count.comp
BUFFER(5, writeonly, uint, groups)     // workgroups (x, y, z) of the dispatch
#include "shared/groups.glsl"

bool less_equal(uvec2 a, uvec2 b) { return a.y < b.y || (a.y == b.y && a.x <= b.x); } // low word first

uvec2 plus(uvec2 a, uint b) {
    uint low = a.x + b;
    return uvec2(low, a.y + uint(low < b));
}

uvec2 total(uint level) { return uvec2(status.at[0].total[2u * level], status.at[0].total[2u * level + 1u]); }

// The most words that a tree of this level can take: P, PO, slabs, CO, NO, flags, masks, boxes. A level has at most as many
// nodes as it has entries or cells.
uvec2 most_words(uint level) {
    uint nodes = 1u, internal = 0u, leaves = 1u;
    for (uint k = 1u; k <= level; ++k) {
        uint cells = 1u << (3u * k);
        uvec2 entries = total(k);
        leaves = entries.y != 0u ? cells : min(entries.x, cells);
        internal = nodes;
        nodes += leaves;
    }
    uvec2 words = plus(plus(plus(total(level), leaves + 1u), slab_words * leaves), internal + 1u);
    words = plus(words, level + 1u + (nodes + 31u) / 32u + (nodes + 3u) / 4u);
    for (uint i = 0u; i < box_words; ++i) words = plus(words, nodes);
    return words;
}

bool fits(uint level, uvec2 most) {
    return less_equal(total(level), uvec2(capacity, 0u)) && less_equal(total(level), most) && less_equal(most_words(level), uvec2(budget[0], budget[1]));
}

void main() {
    if (item_index() > 0u) return;
    uint valid = tets - mesh.at[0].bad;
    uvec2 sum = uvec2(status.at[0].sum[0], status.at[0].sum[1]);
    uvec2 scaled = uvec2(sum.x << 16, sum.y << 16 | sum.x >> 16);
    // level >= k while sum * 65536 <= valid * ((10.5 - k) * 65536 - alpha)
    uint level = 0u;
    for (uint k = 1u; valid > 0u && k <= MAX_LEVEL; ++k) {
        int threshold = int((21u - 2u * k) << 15) - int(alpha);
        if (threshold < 0) break;
        uvec2 bound;
        umulExtended(valid, uint(threshold), bound.y, bound.x);
        if (less_equal(scaled, bound)) level = k;
    }
    if (requested != NONE && valid > 0u) level = min(requested, MAX_LEVEL);
    status.at[0].wanted_level = level;
    level = min(level, deepest);
    uvec2 most;
    umulExtended(valid, per_tet, most.y, most.x);
    if (less_equal(most, uvec2(ample, 0u))) most = uvec2(ample, 0u);
    while (level > 0u && !fits(level, most)) level -= 1u;
    if (!fits(level, most)) status.at[0].overflow = 1u;
    uint n = status.at[0].overflow != 0u ? 0u : status.at[0].total[2u * level];
    status.at[0].level = level;
    status.at[0].candidates = n;
    grid.at[0].level = level;
    candidates.at[0] = n;
    bool single = in_shares != 0u && (status.at[0].large_levels >> level & 1u) == 0u;
    uint counts = single ? 1u : tets + 1u;
    live.at[0] = counts;
    write_groups(0u, max(counts, marked == 0u ? 0u : clearing_items(level)), EACH);
}
