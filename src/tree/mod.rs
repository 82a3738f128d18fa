//! The arrays of a tree in host memory (SPEC 2.5, the paper's §3.1), equal byte for byte to those on a device.

mod stats;
pub mod stored;
pub use stats::{TreeBytes, TreeStats};

use crate::grid::{Box6, Grid, MAX_LEVEL, morton};
use crate::layout::bit;
use crate::options::{Assign, Lists};
use std::ops::Range;

/// An OLBVH. Nodes are in breadth-first order: node 0 is the root on level 0, and the leaves are on level l =
/// `grid.level`.
///
/// For a mesh without a valid tetrahedron the tree is one node, an empty leaf.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeArrays {
    /// The assignment that the entries follow.
    pub assign: Assign,
    /// The tetrahedra that a leaf lists.
    pub lists: Lists,
    /// The grid whose cells are the leaves; its `level` is l, its `first_leaf` is `n_ni`.
    pub grid: Grid,
    /// `P[n_m]`: tetrahedron ids in the order of the leaves' Morton codes, ascending within a leaf.
    pub p: Vec<u32>,
    /// For each entry, the quarters of its leaf's cell that it is near to (see [`crate::reference::quarters`]); empty
    /// where entries have none.
    pub quarters: Vec<u16>,
    /// `PO[n_l + 1]`: the entries of leaf j, which is node `n_ni + j`, are `po[j] .. po[j + 1]`. The paper stores
    /// offsets for every node; here those of internal nodes follow from their leaves.
    pub po: Vec<u32>,
    /// The slab of each leaf (see [`crate::reference::slabs`]); empty if they have none.
    pub slabs: Vec<u32>,
    /// `CO[n_ni + 1]`: the children of internal node i are `co[i] + 1 ..= co[i + 1]`.
    pub co: Vec<u32>,
    /// `NO[l + 1]`: `no[k]` is the number of nodes on levels 0…k.
    pub no: Vec<u32>,
    /// Boundary flag per node, bit j % 32 of word j / 32. It is set if the node lists a boundary tetrahedron, and where
    /// a leaf may lie outside of the mesh (see [`crate::reference::leaves::flag`]).
    pub flags: Vec<u32>,
    /// Mask per node, byte i % 4 of word i / 4. For an internal node, bit d says that the child with the 3-bit Morton
    /// digit d exists. For a leaf, bit d says that an entry is near to that octant of its cell (see
    /// [`crate::reference::leaves::octants`]); the other octants contain no part of the mesh.
    pub masks: Vec<u32>,
    /// Box per node, `[lo, hi]` in the units of the mesh: the cell's box for a leaf, the union of the children's boxes
    /// for others.
    pub boxes: Option<Vec<Box6>>,
}

impl TreeArrays {
    /// Number of nodes, `n_n`.
    pub fn nodes(&self) -> u32 {
        self.no.last().copied().unwrap_or(0)
    }

    /// Number of internal nodes, `n_ni`; they precede the leaves.
    pub fn internal_nodes(&self) -> u32 {
        self.co.len().saturating_sub(1) as u32
    }

    /// The node indices of the leaves.
    pub fn leaves(&self) -> Range<u32> {
        self.internal_nodes()..self.nodes()
    }

    /// The node indices of a level; empty beyond the last level.
    pub fn level_nodes(&self, level: u32) -> Range<u32> {
        let end = |k: u32| self.no.get(k as usize).copied().unwrap_or(self.nodes());
        if level == 0 { 0..end(0) } else { end(level - 1)..end(level) }
    }

    /// The children of a node, in the order of their Morton digits; empty for leaves.
    pub fn children(&self, node: u32) -> Range<u32> {
        match self.co.get(node as usize..node as usize + 2) {
            Some(co) => co[0] + 1..co[1] + 1,
            None => 0..0,
        }
    }

    /// The mask of a node: of its children, or of the octants of a leaf.
    pub fn mask_of(&self, node: u32) -> u32 {
        self.masks.get(node as usize / 4).map_or(0, |word| word >> (8 * (node % 4)) & 0xff)
    }

    /// Child mask of a node, 0 for leaves.
    pub fn child_mask(&self, node: u32) -> u32 {
        if node < self.internal_nodes() { self.mask_of(node) } else { 0 }
    }

    /// The child of a node with the 3-bit Morton digit `digit`.
    pub fn child(&self, node: u32, digit: u32) -> Option<u32> {
        let mask = self.child_mask(node);
        let before = (mask & ((1 << (digit & 7)) - 1)).count_ones();
        if digit < 8 && mask >> digit & 1 != 0 { self.co.get(node as usize).map(|co| co + 1 + before) } else { None }
    }

    /// The range of a node's entries in `p`, from those of its first leaf to those of its last; empty for a node that the
    /// tree does not have.
    pub fn entries(&self, node: u32) -> Range<usize> {
        let internal = self.internal_nodes() as usize;
        let child_offset = |node: usize| self.co.get(node).map_or(0, |&offset| offset as usize);
        let (mut first, mut last) = (node as usize, node as usize);
        for _ in 0..self.grid.level {
            if first < internal {
                (first, last) = (child_offset(first) + 1, child_offset(last + 1));
            }
        }
        let leaf_offset = |node: usize| node.checked_sub(internal).and_then(|leaf| self.po.get(leaf)).map_or(0, |&offset| offset as usize);
        leaf_offset(first)..leaf_offset(last + 1)
    }

    /// The tetrahedra of a node. For a leaf they are ascending and distinct; for an internal node the lists of its
    /// leaves follow one another.
    pub fn tets(&self, node: u32) -> &[u32] {
        self.p.get(self.entries(node)).unwrap_or_default()
    }

    /// The seed, from which a walk through a leaf starts, if the leaf has one: the leaf lies entirely within the mesh
    /// and its list is left out (SPEC 2.6).
    pub fn seed(&self, leaf: u32) -> Option<u32> {
        let full = self.lists == Lists::Boundary && !self.is_boundary(leaf);
        self.tets(leaf).first().copied().filter(|_| full)
    }

    /// Whether the mesh surface may pass through the node. If not, the node's leaves lie entirely within the mesh.
    pub fn is_boundary(&self, node: u32) -> bool {
        bit(&self.flags, node)
    }

    /// The leaf whose cell contains a cell of the finest grid (as returned by [`Grid::quantize`]), found by descent
    /// over the child masks; `None` if there is no leaf, or no entry is near that octant of it.
    pub fn find_leaf(&self, finest: [u32; 3]) -> Option<u32> {
        let (level, code) = (self.grid.level, morton(finest));
        let leaf = self.find_node(code >> (3 * (MAX_LEVEL - level)), level)?;
        let near = level == MAX_LEVEL || self.mask_of(leaf) >> (code >> (3 * (MAX_LEVEL - 1 - level)) & 7) & 1 != 0;
        near.then_some(leaf)
    }

    /// The node on a level whose cell has this Morton code.
    pub fn find_node(&self, code: u32, level: u32) -> Option<u32> {
        (0..level).try_fold(0, |node, k| self.child(node, code >> (3 * (level - 1 - k)) & 7))
    }
}
