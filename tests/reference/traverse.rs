//! Traversal with a short stack visits the leaves that a recursion visits.

use super::{level_of, prepared, tree};
use olbvh::grid::unmorton;
use olbvh::mesh::cases::cases;
use olbvh::mesh::kuhn_jittered;
use olbvh::options::Assign;
use olbvh::reference::leaves::cell_box;
use olbvh::reference::traverse::{Node, full_stack, traverse, traverse_leaves};
use olbvh::tree::TreeArrays;
use std::cell::Cell;
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
            assert_eq!(level_of(&tree, node.index), node.level);
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

/// The squared distance from a point to the cell of a node.
fn square(tree: &TreeArrays, node: Node, x: [f32; 3]) -> f32 {
    let cell = cell_box(&tree.grid, node.level, node.code);
    (0..3).map(|c| (cell[c] - x[c]).max(x[c] - cell[c + 3]).max(0.0).powi(2)).sum()
}

/// A search for the nearest leaf rejects more and more nodes, and still finds it.
#[test]
fn a_predicate_may_become_stricter() {
    let (mesh, topology) = prepared(kuhn_jittered([17; 3], 0.3, 2).unwrap());
    let tree = tree(&mesh, &topology, 0.0, Assign::Aabb);
    let kept = |node: Node, seed: u32| node.level < tree.grid.level || scramble(node, seed).trailing_zeros() >= 5;
    for seed in 0..400 {
        let x = [0, 1, 2].map(|c| 17.0 * (scramble(Node { index: c, ..Node::default() }, seed) & 0xffff) as f32 / 65535.0);
        let all = leaves(&tree, usize::MAX, &|node| kept(node, seed));
        let nearest = all.iter().map(|&leaf| square(&tree, leaf, x)).fold(f32::INFINITY, f32::min);
        for stack in [0, 1, 2, 8] {
            let best = Cell::new(f32::INFINITY);
            let closer = |node| kept(node, seed) && square(&tree, node, x) < best.get();
            traverse_leaves(&tree, stack, closer, |leaf| {
                best.set(square(&tree, leaf, x));
                ControlFlow::Continue(())
            });
            assert_eq!(best.get(), nearest, "stack {stack}, seed {seed}");
        }
    }
}
