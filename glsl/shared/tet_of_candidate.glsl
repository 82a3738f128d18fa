// Finds the tetrahedron that a candidate belongs to. The including kernel declares offsets, the tets + 1 scanned
// counts.

// The last tetrahedron t with offsets[t] <= i, for i below the total. Tetrahedra without candidates are skipped.
uint tet_of_candidate(uint i, uint tets) {
    // Where nearly every tetrahedron has one candidate (or one share of them), moving t by the difference of the
    // offsets leads almost to the right tetrahedron.
    uint t = min(i, tets - 1u);
    for (uint k = 0u; k < 4u; ++k) {
        uint at = offsets.at[t];
        if (at <= i && offsets.at[t + 1u] > i) return t;
        t = at > i ? t - min(t, at - i) : min(t + (i - at), tets - 1u);
    }
    uint lo = 0u, hi = tets;
    while (hi - lo > 1u) {
        uint mid = lo + (hi - lo) / 2u;
        if (offsets.at[mid] <= i) lo = mid;
        else hi = mid;
    }
    return lo;
}
