//! Estimates of the memory that a block takes.

use crate::build::{Capacity, CountScratch, FilterScratch, MAX_ENTRIES, MAX_TETS, MeshArrays, MeshScratch, SortedScratch, TreeMemory};
use crate::error::{Error, Result};
use crate::gpu::{Arena, Gpu};
use crate::grid::CellRange;
use crate::mesh::Mesh;
use crate::options::{BuildOptions, Lists};

/// Estimate: of the entries with `Lists::All`, one in this many remains with `Lists::Boundary`. *Jets* has one in 11 at
/// α = 0, smaller meshes have more. A block that turns out to be larger is cut again.
const SURFACE: u64 = 8;

/// The cells that the tetrahedra of a block meet.
#[derive(Clone, Copy, Default)]
pub(super) struct Extent {
    /// The bounding box of the block's own cells that they meet.
    pub(super) span: Option<CellRange>,
    /// The bounding box of all cells that they meet.
    reach: Option<CellRange>,
    /// The number of cells that they meet, summed over the tetrahedra.
    candidates: u64,
    /// The part of that sum for tetrahedra that also meet other cells than the block's own.
    crossing: u64,
}

impl Extent {
    /// Adds a tetrahedron that meets the cells `tet`.
    pub(super) fn with(self, block: CellRange, tet: CellRange) -> Self {
        let (span, candidates) = (block.common(&tet), u64::from(tet.count()));
        let crossing = if span == Some(tet) { 0 } else { candidates };
        self.and(Self { span, reach: Some(tet), candidates, crossing })
    }

    pub(super) fn and(self, other: Self) -> Self {
        let union = |a: CellRange, b: CellRange| CellRange {
            lo: [0, 1, 2].map(|c| a.lo[c].min(b.lo[c])),
            hi: [0, 1, 2].map(|c| a.hi[c].max(b.hi[c])),
        };
        let either = |a: Option<CellRange>, b| a.zip(b).map(|(a, b)| union(a, b)).or(a).or(b);
        Self {
            span: either(self.span, other.span),
            reach: either(self.reach, other.reach),
            candidates: self.candidates + other.candidates,
            crossing: self.crossing + other.crossing,
        }
    }
}

/// The quantities that the memory of a mesh and its tree depends on.
#[derive(Clone, Copy, Default)]
pub(super) struct Size {
    /// Upper bound of the number of points.
    pub(super) points: u32,
    pub(super) tets: usize,
    /// Cells in the quantized boxes of all tetrahedra.
    pub(super) candidates: u64,
    /// Estimated number of entries.
    pub(super) entries: u64,
    /// Upper bound of the number of leaves.
    pub(super) leaves: u64,
}

/// Estimate of the least bytes that a whole mesh takes, as if its tree had no entries.
pub(super) fn least_bytes(gpu: &Gpu, mesh: &Mesh, options: &BuildOptions) -> Result<u64> {
    let points = u32::try_from(mesh.points.len()).unwrap_or(u32::MAX);
    Size { points, tets: mesh.tets.len(), ..Size::default() }.bytes(gpu, &BuildOptions { level: Some(0), ..*options })
}

impl Size {
    /// The size of `tets` tetrahedra, which have at most `points` points and meet these cells.
    pub(super) fn new(tets: usize, points: u32, extent: &Extent, lists: Lists) -> Self {
        let Extent { reach, candidates, crossing, .. } = *extent;
        // The candidates of tetrahedra that reach beyond the block's own cells are all counted as entries, since the
        // block's boundary is there; of the others, only those near the surface of the mesh.
        let entries = if lists == Lists::All { candidates } else { crossing + (candidates - crossing) / SURFACE };
        Self { points, tets, candidates, entries, leaves: reach.map_or(0, |reach| u64::from(reach.count())) }
    }

    /// Estimate of the most bytes in use while the tree is built, the mesh included; `u64::MAX` if 32 bits cannot
    /// number the mesh, the tree, or what it is built from.
    pub(super) fn bytes(&self, gpu: &Gpu, options: &BuildOptions) -> Result<u64> {
        match self.numbered_bytes(gpu, options) {
            Err(Error::TooLarge(_)) => Ok(u64::MAX),
            bytes => bytes,
        }
    }

    /// [`Self::bytes`], or [`Error::TooLarge`] for sizes beyond 32 bits.
    fn numbered_bytes(&self, gpu: &Gpu, options: &BuildOptions) -> Result<u64> {
        let Self { points, tets, candidates, entries, leaves } = *self;
        if tets > MAX_TETS as usize || candidates > u64::from(u32::MAX) || entries > u64::from(MAX_ENTRIES) {
            return Ok(u64::MAX);
        }
        let (tets, candidates, entries, level) = (tets as u32, candidates as u32, entries as u32, options.level.unwrap_or(0));
        // Each level has about an eighth of the nodes of the next.
        let nodes = leaves.min(u64::from(entries)) as u32 / 7 * 8 + 64;
        let capacity = Capacity { candidates, entries, nodes, level };
        let kept = 12 * u64::from(points) + 16 * u64::from(tets) + Arena::measure(|a| MeshArrays::carve(a, points, tets))?;
        let faces = Arena::measure(|a| MeshScratch::carve(a, points, tets))?;
        let tree = Arena::measure(|a| {
            CountScratch::carve(gpu, a, tets)?;
            FilterScratch::carve(gpu, a, tets, options, &capacity)?;
            SortedScratch::carve(gpu, a, &capacity)?;
            TreeMemory::carve(a, &capacity, options)
        })?;
        Ok(kept + faces.max(tree))
    }
}
