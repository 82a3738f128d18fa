// What the tiles of a sort tell those after them: a word per tile and digit, chain[tile * DIGITS + digit]. It is NOTHING
// first, then the pairs of the digit in the tile itself, and finally those in all tiles up to it, smaller digits included.
// Volatile, and so coherent, since a compiler might do an ordinary load twice, and get two answers.
#define CHAINED volatile
const uint NOTHING = 0u;
const uint FINAL = 0x80000000u;
const uint MOST_POLLS = 512u; // of words that are NOTHING, before who waits counts the missing tiles instead

uint own_count(uint pairs) { return pairs + 1u; }
uint all_up_to(uint pairs) { return pairs | FINAL; }
bool is_final(uint word) { return word >= FINAL; }
uint pairs_in(uint word) { return is_final(word) ? word & ~FINAL : word - 1u; }

// Takes what a tile tells into account. `from` is 1 + the tile that is looked at next, or 0 if no other needs to be.
void step_back(uint word, inout uint from, inout uint pairs) {
    pairs += pairs_in(word);
    from = is_final(word) ? 0u : from - 1u;
}
