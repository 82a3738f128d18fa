//! Traversal with a short stack visits the leaves that a recursion visits.

use super::{prepared, tree};
use olbvh::grid::unmorton;
use olbvh::mesh::cases::cases;
use olbvh::mesh::kuhn_jittered;
use olbvh::options::Assign;
use olbvh::reference::leaves::cell_box;
use olbvh::reference::traverse::{Node, full_stack, traverse, traverse_leaves};
use olbvh::tree::TreeArrays;
use std::ops::ControlFlow;

/// The leaves that a recursion visits.
fn recursive(tree: &TreeArrays, node: Node, f_n: &dyn Fn(Node) -> bool, found: &mut Vec<Node>) {
    if f_n(node) {
        if node.level == tree.grid.level {
            found.push(node);
        }
        for digit in 0..8 {
            if let Some(index) = tree.child(node.index, digit) {
                recursive(tree, Node { index, level: node.level + 1, code: node.code << 3 | digit }, f_n, found);
            }
        }
    }
}

fn leaves(tree: &TreeArrays, stack: usize, f_n: &dyn Fn(Node) -> bool) -> Vec<Node> {
    let mut found = Vec::new();
    traverse_leaves(tree, stack, f_n, |leaf| {
        found.push(leaf);
        ControlFlow::Continue(())
    });
    found
}

fn scramble(node: Node, seed: u32) -> u32 {
    (node.index.wrapping_mul(0x9e37_79b9) ^ seed.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35) >> 7
}

#[test]
fn every_stack_gives_the_leaves_of_a_recursion() {
    let mut meshes: Vec<_> = cases().unwrap().into_iter().map(|c| c.mesh).collect();
    meshes.push(kuhn_jittered([9, 7, 8], 0.3, 2).unwrap());
    for mesh in meshes {
        let (mesh, topology) = prepared(mesh);
        let tree = tree(&mesh, &topology, 0.0, Assign::Aabb);
        let full = full_stack(tree.grid.level);
        for seed in 0..12 {
            let predicates: [&dyn Fn(Node) -> bool; 4] =
                [&|_| true, &|n| scramble(n, seed) & 3 != 0, &|n| scramble(n, seed) & 1 == 0 || n.level == 0, &|n| {
                    tree.is_boundary(n.index)
                }];
            for f_n in predicates {
                let mut expected = Vec::new();
                recursive(&tree, Node::default(), f_n, &mut expected);
                for stack in [0, 1, 2, 3, 5, 8, 13, full, usize::MAX] {
                    assert_eq!(leaves(&tree, stack, f_n), expected, "stack {stack}");
                }
            }
        }
    }
}

#[test]
fn nodes_know_their_level_and_code() {
    let (mesh, topology) = prepared(kuhn_jittered([6; 3], 0.3, 2).unwrap());
    let tree = tree(&mesh, &topology, 0.0, Assign::Aabb);
    let boxes = tree.boxes.clone().unwrap();
    traverse_leaves(
        &tree,
        2,
        |node| {
            assert_eq!(tree.level_of(node.index), node.level);
            assert!(unmorton(node.code).iter().all(|k| k >> node.level == 0));
            true
        },
        |leaf| {
            assert_eq!(boxes[leaf.index as usize], cell_box(&tree.grid, leaf.level, leaf.code));
            ControlFlow::Continue(())
        },
    );
}

#[test]
fn primitives_come_leaf_by_leaf_until_a_break() {
    let (mesh, topology) = prepared(kuhn_jittered([6; 3], 0.3, 2).unwrap());
    let tree = tree(&mesh, &topology, 1.0, Assign::Exact);
    let mut all = Vec::new();
    traverse(
        &tree,
        4,
        |_| true,
        |_, p| {
            all.push(p);
            ControlFlow::Continue(())
        },
    );
    assert_eq!(all, tree.p);
    let mut few = Vec::new();
    traverse(
        &tree,
        4,
        |_| true,
        |_, p| {
            few.push(p);
            if few.len() < 100 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        },
    );
    assert_eq!(few, tree.p[..100]);
}

/// With a short stack, predicates are asked again after a restart, but never for more than the path to the next
/// sibling.
#[test]
fn a_full_stack_asks_every_node_once() {
    let (mesh, topology) = prepared(kuhn_jittered([9; 3], 0.3, 2).unwrap());
    let tree = tree(&mesh, &topology, 0.0, Assign::Aabb);
    let asked = |stack| {
        let mut n = 0u32;
        let count = |_| {
            n += 1;
            true
        };
        traverse_leaves(&tree, stack, count, |_| ControlFlow::Continue(()));
        n
    };
    assert_eq!(asked(full_stack(tree.grid.level)), tree.nodes());
    assert_eq!(asked(usize::MAX), tree.nodes());
    assert!(asked(8) >= tree.nodes() && asked(0) > asked(8));
    assert!(asked(0) <= tree.nodes() * 8 * tree.grid.level);
}
