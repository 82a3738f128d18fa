//! Visits the leaves of a tree in Morton order, below the nodes that a predicate accepts. The kernels' version can be
//! interrupted and resumed at any Morton code. Twin of `glsl/shared/leaf_walk.glsl`.

use super::traverse::Node;
use crate::grid::{CellRange, Grid, MAX_LEVEL, canonical, unmorton};
use crate::tree::TreeArrays;

/// Calls `leaf` for every leaf that `enters` accepts, in Morton order, until `leaf` returns true. `enters` decides for
/// every node on the way, including the root and the leaf, whether to go on below it.
pub fn walk_leaves(tree: &TreeArrays, mut enters: impl FnMut(Node) -> bool, mut leaf: impl FnMut(Node) -> bool) {
    let mut path = vec![Node { index: 0, level: 0, code: 0 }];
    while let Some(node) = path.pop() {
        if !enters(node) {
            continue;
        }
        if node.level == tree.grid.level {
            if leaf(node) {
                return;
            }
            continue;
        }
        for digit in (0..8).rev() {
            if let Some(index) = tree.child(node.index, digit) {
                path.push(Node { index, level: node.level + 1, code: node.code << 3 | digit });
            }
        }
    }
}

/// Whether the cell of a node overlaps a range of cells of the finest grid.
pub fn meets(node: Node, range: &CellRange) -> bool {
    let cell = unmorton(node.code);
    let shift = MAX_LEVEL - node.level;
    (0..3).all(|c| range.lo[c] >> shift <= cell[c] && cell[c] <= range.hi[c] >> shift)
}

/// The cells of the finest grid that the box around `centre` with the half extent `reach` meets; `None` if it lies
/// outside of the bounds. Quantization is monotone, so the cell of every point of the box is in this range.
pub fn reached_cells(grid: &Grid, centre: [f32; 3], reach: [f32; 3]) -> Option<CellRange> {
    let mut range = CellRange { lo: [0; 3], hi: [0; 3] };
    for c in 0..3 {
        let d = canonical(canonical(centre[c]) - grid.lo[c]);
        let (a, b) = (canonical(d - reach[c]), canonical(d + reach[c]));
        if !(b >= 0.0 && a <= canonical(grid.hi[c] - grid.lo[c])) {
            return None;
        }
        range.lo[c] = grid.in_cells(c, a).floor().clamp(0.0, 1023.0) as u32;
        range.hi[c] = grid.in_cells(c, b).floor().clamp(0.0, 1023.0) as u32;
    }
    Some(range)
}
