// Splits between neighbouring codes (the paper's stage 3). The including kernel declares codes.

// The first 3-bit digit, counted from the top, in which `code` differs from `next`: 1 to `level`, or level + 1 if they
// are equal; 0 after the last code, where a node ends on every level.
uint split_level(uint code, uint next, uint level, bool last) {
    if (last) return 0u;
    uint difference = code ^ next;
    return difference == 0u ? level + 1u : level - uint(findMSB(difference)) / 3u;
}
