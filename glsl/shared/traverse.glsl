// Traversal with predicates, using a short stack and a bit trail (SPEC 3.2, the paper's Alg. 3). Twin of
// src/reference/traverse.rs, which explains the trail. Before including this file, a kernel declares what tree.glsl
// needs and defines
//     bool visit_node(Node node);  // F_N: descend? Also asked for leaves. It may become stricter during a traversal.
//     bool visit_leaf(Node node);  // called for a leaf that F_N accepted; returns true to end the traversal
// and may define
//     ENTER_NODE(node, mask, first)  // done before F_N is asked about the children of the node; `first` is the first
//     KEEPS(node)                    // whether a node that F_N accepted earlier is still to be visited
//     FLIP                           // the children of a node are visited in the order of their digits XOR this
// STACK is the number of nodes on the short stack. Any size, from 0 on, gives the same leaves; a small one asks F_N more
// often.
#ifndef ENTER_NODE
#define ENTER_NODE(node, mask, first)
#endif
#ifndef KEEPS
#define KEEPS(node) true
#endif
#ifndef FLIP
#define FLIP 0u
#endif
const uint MAX_VISITS = 24000u; // loop limit; a traversal that reaches it returns false

// True if the traversal ended by itself, false at the loop limit.
bool traverse(uint level) {
    Node node = Node(0u, 0u, 0u);
    if (!visit_node(node)) return true;
    if (level == 0u) {
        visit_leaf(node);
        return true;
    }
    Node stack[STACK + uint(STACK == 0u)]; // no array is empty
    uint top = 0u, held = 0u; // ring buffer: if it is full, the oldest node is dropped
    uint trail = 0u, resume = 0u;
    for (uint visits = 0u; visits < MAX_VISITS; ++visits) {
        bool leaves = node.level + 1u == level;
        uint mask = child_mask(node.index), first = co.at[node.index] + 1u;
        uint accepted = 0u; // one bit per child, in the order of visits
        ENTER_NODE(node, mask, first);
        for (uint k = 0u; k < 8u; ++k) {
            uint digit = k ^ FLIP;
            if ((mask >> digit & 1u) == 0u) continue;
            Node child = Node(first + bitCount(mask & ((1u << digit) - 1u)), node.level + 1u, node.code << 3 | digit);
            if (!visit_node(child)) continue;
            if (!leaves) accepted |= 1u << k;
            else if (visit_leaf(child)) return true;
        }
        uint n = bitCount(accepted);
        if (n > 0u) {
            uint shift = 3u * node.level;
            if (node.level >= resume) trail |= (n - 1u) << shift;
            uint recorded = trail >> shift & 7u, left = min(recorded, n - 1u);
            if (left < recorded) {
                // F_N has become stricter, so the path may lead elsewhere, and the trail below it is another node's.
                trail = (trail & ((1u << shift) - 1u)) | left << shift;
                resume = node.level;
            }
            // Pushes the siblings after the next node, the last first; then takes the next node itself.
            Node parent = node;
            for (uint k = 0u; k <= left; ++k) {
                uint highest = uint(findMSB(accepted)), digit = highest ^ FLIP;
                accepted ^= 1u << highest;
                node = Node(first + bitCount(mask & ((1u << digit) - 1u)), parent.level + 1u, parent.code << 3 | digit);
                if (STACK > 0u && k < left) {
                    stack[top] = node;
                    top = top + 1u == STACK ? 0u : top + 1u;
                    held = min(held + 1u, STACK);
                }
            }
            continue;
        }
        do {
            if (trail == 0u) return true;
            uint at = uint(findMSB(trail)) / 3u;
            trail -= 1u << (3u * at);
            if (held > 0u) {
                top = top == 0u ? STACK - 1u : top - 1u;
                --held;
                node = stack[top];
                resume = 0u;
            } else {
                node = Node(0u, 0u, 0u);
                resume = at + 1u;
            }
        } while (resume == 0u && !KEEPS(node));
    }
    return false;
}
