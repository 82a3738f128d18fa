// The clearing of the marks of a level's cells, in passing, by a dispatch over something else.

// Words of one bit for each cell of a level.
uint cell_words(uint level) { return ((1u << 3u * level) + 31u) / 32u; }

// Invocations for it, 16 words each.
uint clearing_items(uint level) { return (cell_words(level) + 15u) / 16u; }
