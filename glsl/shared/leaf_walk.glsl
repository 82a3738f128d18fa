// The leaves of a tree among some cells, in Morton order, below the nodes that a predicate lets through, to be left and taken up again at any code.
// Twin of src/reference/leaf_walk.rs. Needs tree.glsl, node.glsl and quarters.glsl; before including this a kernel defines
//     uvec3 lo, hi;            // the cells of the finest grid that leaves meet
//     bool enters(Node node);  // asked for every node on the way but the root, leaves included
//     bool walk_ended;         // set to end the walk
const uint WALK_DONE = 0xffffffffu;   // no more leaves
const uint WALK_PAUSED = 0xfffffffeu; // the share of work is done; go on at `code`

struct LeafWalk {
    uint code;     // of the leaf, or where to look for the next
    uint last;     // the last of the cells
    uint depth;    // path[depth] is the deepest node known on the way to it
    uint path[12]; // one more than levels, so that it is no array of a shared struct
};

LeafWalk walk_from(uint level, uint code) {
    LeafWalk w;
    w.code = code;
    w.last = morton(hi) >> (3u * (MAX_LEVEL - level));
    w.depth = 0u;
    w.path[0] = 0u;
    return w;
}

// Goes to the first code behind the node of level `at` on the way; false if none of the cells is there.
bool walk_past(inout LeafWalk w, uint level, uint at) {
    uint shift = 3u * (level - at), here = w.code >> shift, next = here + 1u;
    if (next << shift > w.last) return false;
    w.code = next << shift;
    w.depth = min(w.depth, at - 1u - uint(findMSB(here ^ next)) / 3u);
    return true;
}

// The octants of a node's cell that the cells meet, a bit for each digit.
uint octants_met(uint level, uint code) {
    uvec3 middle = 2u * unmorton(code) + 1u;
    uint shift = MAX_LEVEL - level - 1u;
    return octants_of(uvec3(lessThan(lo >> shift, middle)) + 2u * uvec3(greaterThanEqual(hi >> shift, middle)));
}

// The next leaf at or behind the code. `work` counts nodes, up to `budget`.
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
