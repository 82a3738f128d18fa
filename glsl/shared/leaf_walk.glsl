// Visits the leaves of a tree that meet a range of cells, in Morton order, below the nodes that a predicate accepts. A
// walk can be paused and resumed at any code. Twin of src/reference/leaf_walk.rs. Needs tree.glsl, node.glsl and
// quarters.glsl. Before including this file, a kernel defines
//     uvec3 lo, hi;            // range of finest-grid cells that leaves must meet
//     bool enters(Node node);  // asked for every node on the way but the root, leaves included
//     bool walk_ended;         // set to end the walk
const uint WALK_DONE = 0xffffffffu;   // no more leaves
const uint WALK_PAUSED = 0xfffffffeu; // the budget is spent; resume at `code`

struct LeafWalk {
    uint code;     // Morton code of the leaf, or where the search for the next one starts
    uint last;     // Morton code of the last cell of the range
    uint depth;    // path[depth] is the deepest node known on the path to `code`
    uint path[12]; // one longer than `levels` of BuildStatus, so that the two types stay apart
};

LeafWalk walk_from(uint level, uint code) {
    LeafWalk w;
    w.code = code;
    w.last = morton(hi) >> (3u * (MAX_LEVEL - level));
    w.depth = 0u;
    w.path[0] = 0u;
    return w;
}

// Moves on to the first code after the node of level `at` on the path. Returns false if none of the cells lies there.
bool walk_past(inout LeafWalk w, uint level, uint at) {
    uint shift = 3u * (level - at), here = w.code >> shift, next = here + 1u;
    if (next << shift > w.last) return false;
    w.code = next << shift;
    w.depth = min(w.depth, at - 1u - uint(findMSB(here ^ next)) / 3u);
    return true;
}

// The octants of a node's cell that the range of cells meets, one bit per 3-bit Morton digit.
uint octants_met(uint level, uint code) {
    uvec3 middle = 2u * unmorton(code) + 1u;
    uint shift = MAX_LEVEL - level - 1u;
    return octants_of(uvec3(lessThan(lo >> shift, middle)) + 2u * uvec3(greaterThanEqual(hi >> shift, middle)));
}

// The next leaf at or after `code`, WALK_DONE or WALK_PAUSED. `work` counts nodes, up to `budget`.
uint next_leaf(inout LeafWalk w, uint level, inout uint work, uint budget) {
    for (; work < budget && !walk_ended; ++work) {
        if (w.depth == level) return w.path[level];
        uint shift = 3u * (level - w.depth - 1u), node = w.path[w.depth];
        uint digit = w.code >> shift & 7u, mask = child_mask(node);
        uint rest = (mask & octants_met(w.depth, w.code >> shift >> 3u)) >> digit;
        if (rest == 0u) {
            if (!walk_past(w, level, w.depth)) return WALK_DONE;
            continue;
        }
        uint skip = uint(findLSB(rest));
        if (skip > 0u) w.code = ((w.code >> shift) + skip) << shift;
        Node child = Node(child_of(node, mask, digit + skip), w.depth + 1u, w.code >> shift);
        if (enters(child)) w.path[++w.depth] = child.index;
        else if (!walk_past(w, level, child.level)) return WALK_DONE;
    }
    return walk_ended ? WALK_DONE : WALK_PAUSED;
}
