//! Statistics and sizes of a tree.

use super::TreeArrays;
use crate::options::BuildOptions;

/// Statistics gathered by [`TreeArrays::validate`].
#[derive(Clone, Debug, PartialEq)]
pub struct TreeStats {
    /// Level of the leaves, l.
    pub level: u32,
    /// Entries, `n_m`.
    pub entries: u64,
    /// Nodes, `n_n`.
    pub nodes: u64,
    /// Internal nodes, `n_ni`.
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
    /// Mean number of entries per leaf.
    pub mean_leaf: f64,
    /// Number of nodes on each level.
    pub nodes_per_level: Vec<u64>,
}

/// Bytes of a tree, per array.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TreeBytes {
    /// Tetrahedron ids, with the quarters of the entries.
    pub p: u64,
    /// Entry offsets of the leaves.
    pub po: u64,
    /// Slabs of the leaves, 0 if they have none.
    pub slabs: u64,
    /// Child offsets.
    pub co: u64,
    /// Level offsets.
    pub no: u64,
    /// Boundary flags.
    pub boundary: u64,
    /// Masks of children and octants.
    pub mask: u64,
    /// Boxes, 0 if not stored.
    pub boxes: u64,
}

impl TreeBytes {
    /// Sizes for a tree with this many entries, nodes and internal nodes, and leaves on `level`.
    pub fn new(entries: u64, nodes: u64, internal: u64, level: u32, boxes: bool, slabs: bool) -> Self {
        Self {
            p: 4 * entries,
            po: 4 * (nodes - internal + 1),
            slabs: if slabs { 4 * (nodes - internal) } else { 0 },
            co: 4 * (internal + 1),
            no: 4 * (u64::from(level) + 1),
            boundary: 4 * nodes.div_ceil(32),
            mask: 4 * nodes.div_ceil(4),
            boxes: if boxes { 24 * nodes } else { 0 },
        }
    }

    /// Upper bounds for a tree with leaves on `level`, where `entries` are the numbers of `Aabb` entries on every
    /// level: a level has no more nodes than entries or cells. Twin of `most_words` in `glsl/build/11_choose_depth`.
    pub fn most(entries: &[u64; 11], level: u32, options: &BuildOptions) -> Self {
        let nodes = |levels: u32| 1 + (1..=levels).map(|k| entries[k as usize].min(8u64.pow(k))).sum::<u64>();
        let internal = if level == 0 { 0 } else { nodes(level - 1) };
        Self::new(entries[level as usize], nodes(level), internal, level, options.boxes, options.has_slabs())
    }

    /// Bytes as the paper's Table 2 counts them: 4·`n_m` + 25·`n_n` + 4·`n_ni`, which is P, boxes, one byte per
    /// boundary flag, and CO, without PO.
    pub fn paper(&self) -> u64 {
        let (leaves, internal) = (self.po / 4 - 1, self.co / 4 - 1);
        self.p + 25 * (leaves + internal) + 4 * internal
    }

    /// All arrays, named as in the paper where it has them.
    pub fn arrays(&self) -> [(&'static str, u64); 8] {
        let Self { p, po, slabs, co, no, boundary, mask, boxes } = *self;
        [("P", p), ("BV", boxes), ("CO", co), ("PO", po), ("BF", boundary), ("NO", no), ("mask", mask), ("slabs", slabs)]
    }

    /// Sum of all arrays.
    pub fn total(&self) -> u64 {
        self.arrays().into_iter().map(|a| a.1).sum()
    }
}

impl TreeArrays {
    /// Bytes of each array.
    pub fn memory(&self) -> TreeBytes {
        let (nodes, internal) = (u64::from(self.nodes()), u64::from(self.internal_nodes()));
        TreeBytes::new(self.p.len() as u64, nodes, internal, self.grid.level, self.boxes.is_some(), !self.slabs.is_empty())
    }

    /// Gathers the statistics of a valid tree.
    pub(crate) fn stats(&self) -> TreeStats {
        let leaves = u64::from(self.nodes() - self.internal_nodes());
        let lengths = || self.leaves().map(|j| (j, self.entries(j).len() as u64));
        let boundary = || lengths().filter(|&(j, _)| self.is_boundary(j));
        TreeStats {
            level: self.grid.level,
            entries: self.p.len() as u64,
            nodes: u64::from(self.nodes()),
            internal_nodes: u64::from(self.internal_nodes()),
            leaves,
            boundary_nodes: self.flags.iter().map(|w| u64::from(w.count_ones())).sum(),
            boundary_leaves: boundary().count() as u64,
            boundary_entries: boundary().map(|(_, n)| n).sum(),
            longest_leaf: lengths().map(|(_, n)| n).max().unwrap_or(0),
            mean_leaf: self.p.len() as f64 / leaves as f64,
            nodes_per_level: (0..=self.grid.level).map(|k| self.level_nodes(k).len() as u64).collect(),
        }
    }
}
