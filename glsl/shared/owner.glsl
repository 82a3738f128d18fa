// Which tetrahedron a candidate belongs to. The including kernel declares offsets (the scanned counts, tets + 1).

// The last tetrahedron t with offsets[t] <= i, for i below the total; skips those without candidates.
uint owner_of(uint i, uint tets) {
    // Where nearly each has one candidate (or share of them), as many steps as the place is off lead nearly there.
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

// The loops that step to the next tetrahedron with candidates test before their body: SwiftShader loses what lanes that leave a do-while early
// computed in its last pass.
