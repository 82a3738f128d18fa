//! Stage 1: the depth of the tree, derived from the sizes of the tetrahedra (SPEC 2.4, the paper's Eq. 11–12). Twin of
//! `glsl/build/1*`.

use super::boundary::Topology;
use super::vertices::Vertices;
use crate::error::{Error, Result};
use crate::grid::{Grid, MAX_LEVEL, canonical, per_axis};
use crate::mesh::Mesh;
use crate::options::{BuildOptions, usual_capacity};
use crate::tree::TreeBytes;
use rayon::prelude::*;

/// Number of levels, and of values of `α_P`.
const LEVELS: usize = MAX_LEVEL as usize + 1;

/// Most candidates of a share: where candidates are tested, those of one tetrahedron are taken in shares.
pub use crate::layout::constants::share::SHARE;

/// What one pass over the tetrahedra gathers: enough to choose a level, and to bound the size of the tree at every
/// level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sizes {
    /// Numbers of tetrahedra with `α_P` = 0…10.
    pub histogram: [u64; LEVELS],
    /// `n_m(l)`: number of entries of the assignment `Aabb` at each level; an upper bound for the other assignments.
    pub entries: [u64; LEVELS],
    /// Bit k: on level k, some tetrahedron has more than [`SHARE`] such entries.
    pub large_levels: u32,
}

/// `α_P`: integer log2 of the longest side of the bounding box in finest cells (Eq. 11); 0 for a length of 0.
pub fn log_extent(points: [[f32; 3]; 4], grid: &Grid) -> u32 {
    let side = |c: usize| {
        let x = points.map(|p| canonical(p[c]));
        let (lo, hi) = (x[0].min(x[1]).min(x[2].min(x[3])), x[0].max(x[1]).max(x[2].max(x[3])));
        let at = |x: f32| grid.in_cells(c, canonical(x - grid.lo[c]));
        let size = if grid.graded == 0 { canonical(hi - lo) * grid.inv[c] } else { at(hi) - at(lo) };
        size.floor().clamp(0.0, 1024.0) as u32
    };
    side(0).max(side(1)).max(side(2)).checked_ilog2().unwrap_or(0)
}

/// Measures all valid tetrahedra.
pub fn measure(mesh: &Mesh, topology: &Topology, vertices: &Vertices) -> Sizes {
    let add = |mut sizes: Sizes, (t, &ids): (usize, &[u32; 4])| {
        if topology.is_valid(t as u32) {
            let points = ids.map(|v| mesh.points[v as usize]);
            sizes.histogram[log_extent(points, &topology.grid) as usize] += 1;
            let finest = vertices.cells(ids, MAX_LEVEL);
            for (level, entries) in sizes.entries.iter_mut().enumerate() {
                let shift = LEVELS - 1 - level;
                let [x, y, z] = per_axis(|c| u64::from((finest.hi[c] >> shift) - (finest.lo[c] >> shift) + 1));
                *entries += x * y * z;
                sizes.large_levels |= u32::from(x * y * z > u64::from(SHARE)) << level;
            }
        }
        sizes
    };
    mesh.tets.par_iter().enumerate().fold(Sizes::default, add).reduce(Sizes::default, Sizes::sum)
}

impl Sizes {
    fn sum(mut self, other: Self) -> Self {
        self.large_levels |= other.large_levels;
        for level in 0..LEVELS {
            self.histogram[level] += other.histogram[level];
            self.entries[level] += other.entries[level];
        }
        self
    }

    /// The level by Eq. 12 for α in units of 1/65536, using integer comparisons only:
    /// `l ≥ k ⟺ Σα_P·65536 ≤ N·((10.5 − k)·65536 − α)`.
    pub fn heuristic(&self, alpha: u32) -> u32 {
        let count = self.histogram.iter().sum::<u64>() as i64;
        let sum = (0..).zip(self.histogram).map(|(a, n)| a * n as i64).sum::<i64>();
        let reached = |k: &u32| sum * 65536 <= count * (688_128 - i64::from(*k) * 65536 - i64::from(alpha));
        if count == 0 { 0 } else { (1..=MAX_LEVEL).rev().find(reached).unwrap_or(0) }
    }

    /// The level to build: the requested one or the heuristic's, or else the finest coarser one within the capacity and
    /// the budget.
    ///
    /// # Errors
    /// [`Error::Invalid`] for α outside 0…10. [`Error::TooLarge`] if not even the root fits.
    pub fn level(&self, options: &BuildOptions) -> Result<u32> {
        let heuristic = self.heuristic(options.alpha_fixed()?);
        let valid = u32::try_from(self.histogram.iter().sum::<u64>()).unwrap_or(u32::MAX);
        // Without a valid tetrahedron, the tree is a root.
        let wanted = if valid == 0 { 0 } else { options.checked_level()?.unwrap_or(heuristic) };
        let most = u64::from(options.capacity.unwrap_or_else(|| usual_capacity(valid)));
        let fits = |&l: &u32| {
            self.entries[l as usize] <= most
                && options.budget.is_none_or(|budget| TreeBytes::most(&self.entries, l, options).total() <= budget)
        };
        (0..=wanted).rev().find(fits).ok_or_else(|| too_large(&self.entries, options))
    }
}

/// The options of a finer tree, if one suits [`crate::options::Fineness`] better than the tree of level `built` that
/// these options led to. `entries` and `leaves` are the numbers of that tree; `candidates` is [`Sizes::entries`], whose
/// first value is the number of valid tetrahedra.
pub(crate) fn finer(options: &BuildOptions, built: u32, entries: u64, leaves: u64, candidates: &[u64; LEVELS]) -> Option<BuildOptions> {
    let (longest, anyway) = options.fineness.limits()?;
    let (mut mean, mut level) = (entries / leaves.max(1), built);
    while mean > longest {
        // One level finer, a surface meets four times as many cells.
        (mean, level) = (mean / 4, level + 1);
    }
    let finest = |most: u64| (built + 1..=MAX_LEVEL).rev().find(|&l| candidates[l as usize] <= most);
    let most = u64::from(options.capacity.unwrap_or_else(|| usual_capacity(candidates[0] as u32)));
    let level = finest(anyway).map_or(level, |cheap| level.max(cheap)).min(finest(most)?);
    if level <= built || options.budget.is_some() || candidates[0] == 0 {
        return None;
    }
    log::info!(
        "leaves of level {built} list {} entries on average; level {level} suits {} better",
        entries / leaves.max(1),
        options.fineness
    );
    Some(BuildOptions { level: Some(level), ..*options })
}

/// The error for a mesh without tree, `entries` being [`Sizes::entries`].
pub fn too_large(entries: &[u64; LEVELS], options: &BuildOptions) -> Error {
    let root = entries[0];
    Error::TooLarge(match (options.capacity, options.budget) {
        (Some(capacity), _) if root > u64::from(capacity) => {
            format!("a tree of a single node has {root} entries, the capacity is {capacity}; raise it to that at least")
        }
        (_, Some(budget)) => {
            let bytes = TreeBytes::most(entries, 0, options).total();
            format!(
                "a tree of a single node takes {bytes} bytes for {root} entries, the budget is {budget} bytes; raise it to that at least"
            )
        }
        _ => format!("a tree of a single node has {root} entries, more than there is room for; take the mesh in blocks"),
    })
}
