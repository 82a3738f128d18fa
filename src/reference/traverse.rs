//! Traversal for predicates with a short stack and a bit trail (SPEC 3.2, the paper's Alg. 3). Twin of `glsl/shared/traverse.glsl`.
//!
//! The trail has three bits per level: how many siblings of the node on the current path, accepted by `F_N` too, are still to be visited. (The
//! paper counts those that were visited; counting what is left says without a look at the tree whether and where there is more: at the
//! highest bit set.) The children of a node are at most eight, so at most seven are left; leaves are handled in their parent and have no digit,
//! so 27 bits serve 10 levels. The stack keeps the nearest of the siblings left; where it has run dry, the trail leads from the root
//! to the next one.

use crate::tree::TreeArrays;
use std::collections::VecDeque;
use std::ops::ControlFlow;

/// Nodes on a stack that never runs dry: seven siblings on each level but the first and the leaves', and the root's.
pub const fn full_stack(level: u32) -> usize {
    7 * level as usize + 8
}

/// A node as predicates see it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Node {
    /// Index of the node.
    pub index: u32,
    /// Its level, the root's being 0.
    pub level: u32,
    /// Morton code of its cell at that level.
    pub code: u32,
}

/// The short stack: the oldest node is dropped where there is no room.
struct Stack {
    nodes: VecDeque<Node>,
    size: usize,
}

impl Stack {
    fn push(&mut self, node: Node) {
        if self.nodes.len() == self.size {
            self.nodes.pop_front();
        }
        if self.size > 0 {
            self.nodes.push_back(node);
        }
    }
}

/// Calls `f_p` for every primitive of every leaf that `f_n` accepts and whose ancestors it accepts, in order, until it breaks. A primitive comes
/// once per such leaf.
pub fn traverse(tree: &TreeArrays, stack: usize, f_n: impl FnMut(Node) -> bool, mut f_p: impl FnMut(Node, u32) -> ControlFlow<()>) {
    traverse_leaves(tree, stack, f_n, |leaf| tree.primitives(leaf.index).iter().try_for_each(|&p| f_p(leaf, p)));
}

/// Calls `found` for every leaf that `f_n` accepts and whose ancestors it accepts, in order, until it breaks. Every size of the stack gives the
/// same leaves; a small one has `f_n` asked more often. `f_n` should answer the same whenever asked about a node; if it becomes stricter on the
/// way, no leaf that it still accepts is missed, but one may come twice.
pub fn traverse_leaves(tree: &TreeArrays, stack: usize, mut f_n: impl FnMut(Node) -> bool, mut found: impl FnMut(Node) -> ControlFlow<()>) {
    let root = Node::default();
    if !f_n(root) {
        return;
    }
    if tree.grid.level == 0 {
        let _ = found(root);
        return;
    }
    let mut stack = Stack { nodes: VecDeque::new(), size: stack.min(full_stack(tree.grid.level)) };
    let mut trail = 0u32;
    let mut node = root;
    // Levels below this one follow the trail.
    let mut resume = 0;
    loop {
        let leaf_level = node.level + 1 == tree.grid.level;
        let (mut accepted, mut n) = ([root; 8], 0);
        for digit in 0..8 {
            if let Some(index) = tree.child(node.index, digit) {
                let child = Node { index, level: node.level + 1, code: node.code << 3 | digit };
                if f_n(child) {
                    if leaf_level {
                        if found(child).is_break() {
                            return;
                        }
                    } else {
                        accepted[n] = child;
                        n += 1;
                    }
                }
            }
        }
        if n > 0 {
            let shift = 3 * node.level;
            if node.level >= resume {
                trail |= (n as u32 - 1) << shift;
            }
            let left = ((trail >> shift & 7) as usize).min(n - 1);
            for &sibling in accepted[n - left..n].iter().rev() {
                stack.push(sibling);
            }
            node = accepted[n - 1 - left];
            continue;
        }
        // Nothing below this node: on to the next sibling left, on the deepest level that has one.
        if trail == 0 {
            return;
        }
        let level = trail.ilog2() / 3;
        trail -= 1 << (3 * level);
        node = stack.nodes.pop_back().unwrap_or(root);
        resume = if node.level == 0 { level + 1 } else { 0 };
    }
}
