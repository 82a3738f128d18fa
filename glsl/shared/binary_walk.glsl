// Visits the tetrahedra of the baseline's binary tree in the order of their places, below the nodes that a predicate
// accepts. Internal node i splits after place i, so a walk can be paused and resumed at any place, by skipping the left
// children of the nodes before it. Needs binary_tree.glsl and root. Before including this file, a kernel defines
//     bool enters(uint reference);  // asked for every node on the way, leaves included
const uint WALK_DONE = 0xffffffffu;   // no more tetrahedra
const uint WALK_PAUSED = 0xfffffffeu; // the budget is spent; resume at resume_place

struct BinaryWalk {
    uint next;  // reference to visit next; NONE: take it from the stack
    uint place; // places before this one are skipped
    uint top;
    uint stack[BINARY_DEPTH]; // internal nodes whose right children are still to be visited
};

BinaryWalk binary_walk_from(uint place) {
    BinaryWalk w;
    w.next = root.at[0];
    w.place = place;
    w.top = 0u;
    return w;
}

// The budget, raised where needed so that a walk makes progress from any place.
uint binary_budget(uint work, uint budget) { return max(budget, work + 2u * BINARY_DEPTH); }

// The next place of the walk, WALK_DONE or WALK_PAUSED. `work` counts nodes, up to `budget`.
uint next_place(inout BinaryWalk w, inout uint work, uint budget) {
    for (; work < budget; ++work) {
        if (w.next == NONE) {
            if (w.top == 0u) return WALK_DONE;
            uint node = w.stack[--w.top];
            w.place = node + 1u;
            w.next = nodes.at[node].right;
        }
        uint reference = w.next, i = reference & BINARY_INDEX;
        w.next = NONE;
        if (reference == NONE || !enters(reference)) continue;
        if ((reference & BINARY_LEAF) != 0u) return i;
        bool both = i >= w.place;
        if (both) w.stack[w.top++] = i;
        w.next = both ? nodes.at[i].left : nodes.at[i].right;
    }
    return WALK_PAUSED;
}

// The place where a paused walk resumes; NONE if nothing is left.
uint resume_place(BinaryWalk w) {
    if (w.next != NONE) return w.place;
    return w.top > 0u ? w.stack[w.top - 1u] + 1u : NONE;
}
