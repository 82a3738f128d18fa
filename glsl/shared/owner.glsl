// Which tetrahedron a candidate belongs to. The including kernel declares offsets (the scanned counts, tets + 1).

// The last tetrahedron t with offsets[t] <= i, for i below the total; skips those without candidates.
uint owner_of(uint i, uint tets) {
    if (i < tets && offsets.at[i] == i && offsets.at[i + 1u] > i) return i; // as where each before has one
    uint lo = 0u, hi = tets;
    while (hi - lo > 1u) {
        uint mid = lo + (hi - lo) / 2u;
        if (offsets.at[mid] <= i) lo = mid;
        else hi = mid;
    }
    return lo;
}

// The loops that step to the next tetrahedron with candidates test before their body: SwiftShader loses what lanes that leave a do-while early
// computed in its last pass.
