//! What every stage needs to know of a vertex, computed once: its finest cell and its normalised coordinates (SPEC
//! 2.1).

use super::grid::{Grid, MAX_LEVEL};
use super::tet::{Tet, Vec3};
use crate::mesh::Mesh;
use rayon::prelude::*;

/// Quantized and normalised points of a mesh. The values of points that are not finite have no meaning.
#[derive(Clone, Debug)]
pub struct Vertices {
    /// Cell of the finest grid for each point.
    pub cell: Vec<[u16; 3]>,
    /// Normalised coordinates of each point.
    pub normalised: Vec<Vec3>,
}

/// A box of cells of one level, including both corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellRange {
    /// Lowest cell.
    pub lo: [u32; 3],
    /// Highest cell.
    pub hi: [u32; 3],
}

impl Vertices {
    /// The vertices of `mesh` in `grid`.
    pub fn new(mesh: &Mesh, grid: &Grid) -> Self {
        let cell = mesh.points.par_iter().map(|&p| grid.quantize(p).map(|q| q as u16)).collect();
        let normalised = mesh.points.par_iter().map(|&p| grid.normalise(p)).collect();
        Self { cell, normalised }
    }

    /// The valid tetrahedron `ids` in normalised coordinates.
    pub fn tet(&self, ids: [u32; 4]) -> Tet {
        Tet::new(ids, &self.normalised)
    }

    /// The cells of level `level` that the bounding box of the valid tetrahedron `ids` meets (Eq. 5–6). Quantization is
    /// monotone, so the cells of the vertices bound those of every point between them.
    pub fn cells(&self, ids: [u32; 4], level: u32) -> CellRange {
        let [a, b, c, d] = ids.map(|id| self.cell[id as usize]);
        let shift = MAX_LEVEL - level;
        let lo = [0, 1, 2].map(|k| u32::from(a[k].min(b[k]).min(c[k].min(d[k]))) >> shift);
        let hi = [0, 1, 2].map(|k| u32::from(a[k].max(b[k]).max(c[k].max(d[k]))) >> shift);
        CellRange { lo, hi }
    }
}

impl CellRange {
    /// All cells of the finest grid.
    pub const WHOLE: Self = Self { lo: [0; 3], hi: [(1 << MAX_LEVEL) - 1; 3] };

    /// The first and the last cell, one word each, as kernels take cells of the finest grid.
    pub fn words(&self) -> [u32; 2] {
        [self.lo, self.hi].map(|[x, y, z]| x | y << MAX_LEVEL | z << (2 * MAX_LEVEL))
    }

    /// Converts a box of cells of `level` into cells of the finest grid.
    #[must_use]
    pub fn finest(&self, level: u32) -> Self {
        let shift = MAX_LEVEL - level;
        Self { lo: self.lo.map(|k| k << shift), hi: self.hi.map(|k| ((k + 1) << shift) - 1) }
    }

    /// The intersection of two boxes; `None` if it is empty.
    pub fn common(&self, other: &Self) -> Option<Self> {
        let range = Self { lo: [0, 1, 2].map(|c| self.lo[c].max(other.lo[c])), hi: [0, 1, 2].map(|c| self.hi[c].min(other.hi[c])) };
        (0..3).all(|c| range.lo[c] <= range.hi[c]).then_some(range)
    }

    /// Number of cells per axis.
    pub fn size(&self) -> [u32; 3] {
        [0, 1, 2].map(|c| self.hi[c] - self.lo[c] + 1)
    }

    /// Number of cells.
    pub fn count(&self) -> u32 {
        let [x, y, z] = self.size();
        x * y * z
    }

    /// Whether the range contains `cell`.
    pub fn contains(&self, cell: [u32; 3]) -> bool {
        (0..3).all(|c| self.lo[c] <= cell[c] && cell[c] <= self.hi[c])
    }

    /// Cell number `index` of [`CellRange::count`], with x varying fastest: index = (x−x0) + nx·((y−y0) + ny·(z−z0)).
    pub fn cell(&self, index: u32) -> [u32; 3] {
        let [nx, ny, _] = self.size();
        let (x, rest) = (index % nx, index / nx);
        [self.lo[0] + x, self.lo[1] + rest % ny, self.lo[2] + rest / ny]
    }

    /// All cells in that order.
    pub fn iter(&self) -> impl Iterator<Item = [u32; 3]> + use<> {
        let CellRange { lo, hi } = *self;
        (lo[2]..=hi[2]).flat_map(move |z| (lo[1]..=hi[1]).flat_map(move |y| (lo[0]..=hi[0]).map(move |x| [x, y, z])))
    }
}
