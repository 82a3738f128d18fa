//! Traversal under a node predicate, with a short stack and a bit trail (SPEC 3.2, the paper's Alg. 3). Twin of
//! `glsl/shared/traverse.glsl`.
//!
//! The trail has three bits per level: the number of siblings of the node on the current path that `F_N` accepted too
//! and that are still to be visited. (The paper counts the siblings that were visited. Counting those left tells,
//! without reading the tree, whether more are to be visited and on which level: that of the highest bit set.) A node
//! has at most eight children, so at most seven are left. Leaves are handled in their parent and have no digit, so 27
//! bits suffice for 10 levels. The stack keeps the nearest of the siblings left. When it has run empty, the trail leads
//! from the root to the next sibling.

use crate::tree::TreeArrays;
use std::collections::VecDeque;
use std::ops::ControlFlow;

/// A size of the stack at which no node is ever dropped: at most seven siblings wait on each level.
pub const fn full_stack(level: u32) -> usize {
    7 * level as usize + 8
}

/// A node as predicates receive it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Node {
    /// Index of the node.
    pub index: u32,
    /// Level of the node; the root is on level 0.
    pub level: u32,
    /// Morton code of its cell at that level.
    pub code: u32,
}

/// The short stack. When it is full, the oldest node is dropped.
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

/// Calls `f_p` for every tetrahedron of every leaf that `f_n` accepts along with all its ancestors, in order, until
/// `f_p` breaks. A tetrahedron is passed once per such leaf.
pub fn traverse(tree: &TreeArrays, stack: usize, f_n: impl FnMut(Node) -> bool, mut f_p: impl FnMut(Node, u32) -> ControlFlow<()>) {
    traverse_leaves(tree, stack, f_n, |leaf| tree.tets(leaf.index).iter().try_for_each(|&p| f_p(leaf, p)));
}

/// Calls `found` for every leaf that `f_n` accepts along with all its ancestors, in order, until `found` breaks. The
/// leaves are the same for every size of the stack; with a small one `f_n` is called more often. `f_n` should always
/// give the same answer for a node. If it becomes stricter during the traversal, no leaf that it still accepts is
/// missed, but one may be visited twice.
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
    // Levels above this one follow the trail; from this level on it is written.
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
            let recorded = (trail >> shift & 7) as usize;
            let left = recorded.min(n - 1);
            if left < recorded {
                // F_N has become stricter, so the path may lead elsewhere, and the trail below it is another node's.
                trail = trail & ((1 << shift) - 1) | (left as u32) << shift;
                resume = node.level;
            }
            for &sibling in accepted[n - left..n].iter().rev() {
                stack.push(sibling);
            }
            node = accepted[n - 1 - left];
            continue;
        }
        // There is nothing below this node. Go on with the next sibling left, on the deepest level that has one.
        if trail == 0 {
            return;
        }
        let level = trail.ilog2() / 3;
        trail -= 1 << (3 * level);
        node = stack.nodes.pop_back().unwrap_or(root);
        resume = if node.level == 0 { level + 1 } else { 0 };
    }
}
