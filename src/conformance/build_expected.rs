//! The tree that a device should build, and what the stages of its construction should leave in memory.

use super::failure::Verdict;
use super::twin::{Built, Twin};
use crate::layout::BuildStatus;
use crate::options::{Assign, BuildOptions, Lists};
use crate::reference::codes::Stage;
use crate::reference::depth::SHARE;
use crate::tree::TreeArrays;
use std::sync::Arc;

/// A tree and the intermediate results of its construction.
pub(crate) struct Expected {
    /// Where the candidates of each tetrahedron start (or, if candidates are filtered, their shares of 32), followed by
    /// the total number; empty where every tetrahedron has one share, so that only their number is needed.
    pub offsets: Vec<u32>,
    /// The total number of candidates or shares.
    pub shares: u32,
    /// Whether the device stores boxes; the reference implementation always does.
    pub boxes: bool,
    /// Expected content of the device's status block.
    pub status: BuildStatus,
    /// The tree of the reference implementation; `None` if not even the root fits.
    built: Option<Arc<Built>>,
}

impl Expected {
    /// The tree within `room` candidates (`None`: too few even for the root), at most `most` entries, and down to
    /// `level` at most.
    pub(crate) fn new(twin: &mut Twin, options: &BuildOptions, room: Option<u32>, most: u32, level: u32) -> Verdict<Self> {
        let sizes = twin.sizes;
        let heuristic = sizes.heuristic(options.alpha_fixed()?);
        let mut status = BuildStatus { wanted_level: heuristic, ..BuildStatus::default() };
        let sum: u64 = (0..).zip(sizes.histogram).map(|(alpha, n): (u64, u64)| alpha * n).sum();
        status.large_levels = sizes.large_levels;
        status.sum = [sum as u32, (sum >> 32) as u32];
        for (k, n) in sizes.entries.iter().enumerate() {
            (status.total[2 * k], status.total[2 * k + 1]) = (*n as u32, (n >> 32) as u32);
        }
        // A level needs at least as many entries as a coarser one. A capacity that just suffices for one level
        // therefore excludes deeper ones, except where levels tie.
        let fits = |k: u32| k <= level && room.is_some_and(|room| sizes.entries[k as usize] <= u64::from(room));
        let Some(mut chosen) = (0..=heuristic).rev().find(|&k| fits(k)) else {
            status.overflow = 1;
            return Ok(Self { offsets: Vec::new(), shares: 0, boxes: options.boxes, status, built: None });
        };
        let first = chosen;
        let mut built = twin.built(options.assign, options.lists, chosen)?;
        while chosen > 0 && built.tree().p.len() as u64 > u64::from(most) {
            chosen -= 1;
            built = twin.built(options.assign, options.lists, chosen)?;
        }
        let tree = built.tree();

        let share = if options.assign == Assign::Aabb && options.lists == Lists::All { 1 } else { SHARE };
        let (mesh, topology, vertices) = (&twin.mesh, &twin.topology, &twin.vertices);
        let candidates = Stage { mesh, topology, vertices, grid: &tree.grid, assign: Assign::Aabb, marks: None };
        let mut offsets = vec![0];
        offsets.extend(candidates.count().iter().scan(0u32, |sum, n: &u32| {
            *sum += if share > 1 { n.div_ceil(share).max(1) } else { *n };
            Some(*sum)
        }));

        let shares = offsets.last().copied().unwrap_or(0);
        // Where a coarser level was chosen because of its entries, candidates were counted in any case.
        let counted = share == 1 || status.large_levels >> first & 1 != 0 || chosen < first;
        offsets.retain(|_| counted);

        status.level = chosen;
        status.candidates = sizes.entries[chosen as usize] as u32;
        status.entries = tree.p.len() as u32;
        status.nodes = tree.nodes();
        status.internal = tree.internal_nodes();
        status.leaves = status.nodes - status.internal;
        status.boundary_leaves = tree.leaves().filter(|&j| tree.is_boundary(j)).count() as u32;
        status.longest_leaf = tree.leaves().map(|j| tree.entries(j).len()).max().unwrap_or(0) as u32;
        for (k, n) in status.levels.iter_mut().enumerate() {
            *n = tree.no.get(k).copied().unwrap_or(status.nodes);
        }
        Ok(Self { offsets, shares, boxes: options.boxes, status, built: Some(built) })
    }

    /// The tree of the reference implementation, with boxes; `None` if not even the root fits.
    pub(crate) fn tree(&self) -> Option<&TreeArrays> {
        Some(self.built.as_ref()?.tree())
    }

    /// The sorted codes of the entries.
    pub(crate) fn codes(&self) -> &[u32] {
        self.built.as_ref().map_or(&[], |built| &built.made.codes)
    }
}
