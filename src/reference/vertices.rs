//! What every stage needs to know of a vertex, computed once: its finest cell and its normalised coordinates (SPEC
//! 2.1). Twin of `glsl/build/02_normalise_vertices`.

use super::tet::{Tet, Vec3};
use crate::grid::{CellRange, Grid, MAX_LEVEL, per_axis};
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
        let lo = per_axis(|k| u32::from(a[k].min(b[k]).min(c[k].min(d[k]))) >> shift);
        let hi = per_axis(|k| u32::from(a[k].max(b[k]).max(c[k].max(d[k]))) >> shift);
        CellRange { lo, hi }
    }
}
