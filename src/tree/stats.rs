//! Figures about a tree.

use super::TreeArrays;

/// What [`TreeArrays::validate`] found while it checked.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeStats {
    /// Level of the leaves, l.
    pub level: u32,
    /// Entries, `n_m`.
    pub entries: u64,
    /// Nodes, `n_n`.
    pub nodes: u64,
    /// Nodes that are not leaves, `n_ni`.
    pub internal_nodes: u64,
    /// Leaves.
    pub leaves: u64,
    /// Nodes with the boundary flag.
    pub boundary_nodes: u64,
    /// Leaves with the boundary flag.
    pub boundary_leaves: u64,
    /// Entries of leaves with the boundary flag.
    pub boundary_entries: u64,
    /// Entries of the longest leaf.
    pub longest_leaf: u64,
    /// Entries per leaf.
    pub mean_leaf: f64,
    /// Nodes of each level.
    pub nodes_per_level: Vec<u64>,
}

/// Bytes of a tree, per array.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Primitive ids.
    pub p: u64,
    /// Primitive offsets.
    pub po: u64,
    /// Child offsets.
    pub co: u64,
    /// Level offsets.
    pub no: u64,
    /// Boundary flags.
    pub boundary: u64,
    /// Child masks.
    pub mask: u64,
    /// Boxes, 0 if not stored.
    pub boxes: u64,
}

impl Memory {
    /// All arrays, by the names of the paper where it has one.
    pub fn arrays(&self) -> [(&'static str, u64); 7] {
        let Self { p, po, co, no, boundary, mask, boxes } = *self;
        [("P", p), ("BV", boxes), ("CO", co), ("PO", po), ("BF", boundary), ("NO", no), ("mask", mask)]
    }

    /// Sum over the arrays.
    pub fn total(&self) -> u64 {
        self.arrays().into_iter().map(|a| a.1).sum()
    }
}

impl TreeArrays {
    /// Bytes of each array.
    pub fn memory(&self) -> Memory {
        let words = |v: &[u32]| 4 * v.len() as u64;
        Memory {
            p: words(&self.p),
            po: words(&self.po),
            co: words(&self.co),
            no: words(&self.no),
            boundary: words(&self.boundary),
            mask: words(&self.mask),
            boxes: self.boxes.as_ref().map_or(0, |b| 24 * b.len() as u64),
        }
    }

    /// Bytes as the paper's Table 2 counts them: 4·`n_m` + 25·`n_n` + 4·`n_ni`, that is P, boxes, a byte per flag, CO, and no PO.
    pub fn paper_bytes(&self) -> u64 {
        4 * self.p.len() as u64 + 25 * u64::from(self.nodes()) + 4 * u64::from(self.internal_nodes())
    }

    /// Figures of the tree, which must be a valid one.
    pub(super) fn stats(&self) -> TreeStats {
        let leaves = u64::from(self.nodes() - self.internal_nodes());
        let lengths = || self.leaves().map(|j| (j, self.entries(j).len() as u64));
        let boundary = || lengths().filter(|&(j, _)| self.is_boundary(j));
        TreeStats {
            level: self.grid.level,
            entries: self.p.len() as u64,
            nodes: u64::from(self.nodes()),
            internal_nodes: u64::from(self.internal_nodes()),
            leaves,
            boundary_nodes: self.boundary.iter().map(|w| u64::from(w.count_ones())).sum(),
            boundary_leaves: boundary().count() as u64,
            boundary_entries: boundary().map(|(_, n)| n).sum(),
            longest_leaf: lengths().map(|(_, n)| n).max().unwrap_or(0),
            mean_leaf: self.p.len() as f64 / leaves as f64,
            nodes_per_level: (0..=self.grid.level).map(|k| self.level_nodes(k).len() as u64).collect(),
        }
    }
}
