//! What the reference builds, with everything in between that a device's stages leave behind.

use super::failure::Verdict;
use crate::layout::BuildStatus;
use crate::mesh::Mesh;
use crate::options::{Assign, BuildOptions, Lists};
use crate::reference::boundary::Topology;
use crate::reference::codes::Stage;
use crate::reference::depth::{Sizes, measure};
use crate::reference::marks::Marks;
use crate::reference::vertices::Vertices;
use crate::tree::TreeArrays;

/// A tree and its making.
pub(crate) struct Expected {
    /// What the depth is chosen from.
    pub sizes: Sizes,
    /// The level that the heuristic alone chooses.
    pub heuristic: u32,
    /// Where the candidates of every tetrahedron begin, or shares of 32 where they are filtered, and behind them their number.
    pub offsets: Vec<u32>,
    /// Sorted codes.
    pub codes: Vec<u32>,
    /// The tree.
    pub tree: TreeArrays,
    /// What the device's status block should say.
    pub status: BuildStatus,
}

impl Expected {
    /// Builds within `entries` candidates and down to `level` at most.
    pub(crate) fn new(mesh: &Mesh, topology: &Topology, options: &BuildOptions, entries: u32, level: u32) -> Verdict<Self> {
        let vertices = Vertices::new(mesh, &topology.grid);
        let sizes = measure(mesh, topology, &vertices);
        let heuristic = sizes.heuristic(options.alpha_fixed()?);
        let mut status = BuildStatus { heuristic_level: heuristic, ..BuildStatus::default() };
        let sum: u64 = (0..).zip(sizes.histogram).map(|(alpha, n): (u64, u64)| alpha * n).sum();
        status.sum = [sum as u32, (sum >> 32) as u32];
        for (k, n) in sizes.entries.iter().enumerate() {
            (status.total[2 * k], status.total[2 * k + 1]) = (*n as u32, (n >> 32) as u32);
        }
        // A capacity of the deepest level that is allowed is a capacity for no deeper one (more entries at each), except where levels tie.
        let fits = |k: u32| k <= level && sizes.entries[k as usize] <= u64::from(entries);
        let chosen = (0..=heuristic).rev().find(|&k| fits(k));
        let Some(chosen) = chosen else {
            status.overflow = 1;
            let tree = crate::reference::build::build(&Mesh::default(), &crate::reference::boundary::topology(&Mesh::default())?, options)?;
            return Ok(Self { sizes, heuristic, offsets: Vec::new(), codes: Vec::new(), tree, status });
        };
        let mut grid = topology.grid;
        grid.level = chosen;
        let tree = tree_at(mesh, topology, options, chosen, &sizes)?;

        let stage = Stage { mesh, topology, vertices: &vertices, grid: &grid, assign: Assign::Aabb, marks: None };
        let mut offsets = vec![0];
        let share = if options.assign == Assign::Aabb && options.lists == Lists::All { 1 } else { 32 };
        offsets.extend(stage.count().iter().scan(0u32, |sum, n: &u32| {
            *sum += n.div_ceil(share);
            Some(*sum)
        }));
        let stage = Stage { assign: options.assign, ..stage };
        let marks = (options.lists == Lists::Boundary).then(|| Marks::new(&stage));
        let stage = Stage { marks: marks.as_ref(), ..stage };
        let codes = stage.emit(&stage.count())?.sorted(chosen).codes;

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
        Ok(Self { sizes, heuristic, offsets, codes, tree, status })
    }
}

/// The reference's tree with leaves at a level at or above the heuristic's: by a capacity that only admits it, or where levels tie in entries, by α.
fn tree_at(mesh: &Mesh, topology: &Topology, options: &BuildOptions, level: u32, sizes: &Sizes) -> Verdict<TreeArrays> {
    let capacity = u32::try_from(sizes.entries[level as usize]).ok();
    let tree = crate::reference::build::build(mesh, topology, &BuildOptions { capacity, ..*options })?;
    if tree.grid.level == level {
        return Ok(tree);
    }
    // α is a difference of levels: what the heuristic lacks to `level`.
    let alpha = (0..=160)
        .map(|i| i as f32 / 16.0)
        .find(|&a| BuildOptions { alpha: a, ..*options }.alpha_fixed().is_ok_and(|a| sizes.heuristic(a) == level));
    Ok(crate::reference::build::build(mesh, topology, &BuildOptions { alpha: alpha.unwrap_or(options.alpha), ..*options })?)
}
