const uint SHARE = 32u; // Candidates of a share: the bits of a word of hits.
