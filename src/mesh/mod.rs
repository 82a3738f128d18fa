//! Tetrahedral meshes in host memory: points, cells and scalar fields. Knows no Vulkan.

pub mod cases;
mod kuhn;
mod procedural;
pub(crate) use kuhn::hash;
pub use kuhn::{kuhn, kuhn_jittered};
pub use procedural::{graded, shell, slivers};

use crate::error::{Error, Result};

/// A tetrahedral mesh with scalar fields.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions, relative to [`Mesh::origin`].
    pub points: Vec<[f32; 3]>,
    /// Four indices into [`Mesh::points`] per tetrahedron; the order of the four, that is the sign of the cell, means nothing.
    pub tets: Vec<[u32; 4]>,
    /// For each tetrahedron the id of the cell it came from (cells of a file count from 0, all types included; a hexahedron becomes several
    /// tetrahedra with one id). `None`: tetrahedron `i` is cell `i`.
    pub cell_ids: Option<Vec<u32>>,
    /// For each point its number in the source, where the order is another one. `None`: point `i` is point `i`.
    pub point_ids: Option<Vec<u32>>,
    /// Number of cells of the source, those that are no tetrahedra included; equals `tets.len()` without `cell_ids`.
    pub source_cells: u32,
    /// Scalar fields.
    pub fields: Vec<Field>,
    /// Add this to a point to get the coordinates of the source. Zero unless single precision would have lost the shape (a small mesh far from 0).
    pub origin: [f64; 3],
}

/// What a field's values belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum On {
    /// One value per point, interpolated linearly in a cell.
    Points,
    /// One value per tetrahedron, constant in it.
    Cells,
}

impl On {
    /// Refuses values that are not as many as a mesh has points, or tetrahedra.
    pub(crate) fn check(self, values: &[f32], [points, tets]: [usize; 2]) -> Result<()> {
        let expected = if self == Self::Points { points } else { tets };
        if values.len() == expected {
            return Ok(());
        }
        let what = if self == Self::Points { "points" } else { "tetrahedra" };
        Err(Error::Invalid(format!("a field of {} values where the mesh has {expected} {what}", values.len())))
    }
}

/// A named scalar field.
#[derive(Clone, Debug)]
pub struct Field {
    /// Name, as in the source.
    pub name: String,
    /// Points or cells.
    pub on: On,
    /// One value per point or per tetrahedron of the mesh.
    pub values: Vec<f32>,
}

impl Field {
    /// Smallest and largest finite value; `None` if there is none.
    pub fn range(&self) -> Option<[f32; 2]> {
        let finite = self.values.iter().copied().filter(|v| v.is_finite());
        finite.fold(None, |range, v| match range {
            None => Some([v, v]),
            Some([lo, hi]) => Some([lo.min(v), hi.max(v)]),
        })
    }
}

impl Mesh {
    /// A mesh from points and cells, without fields.
    pub fn new(points: Vec<[f32; 3]>, tets: Vec<[u32; 4]>) -> Self {
        let source_cells = tets.len() as u32;
        Self { points, tets, source_cells, ..Self::default() }
    }

    /// The id that the source gave the cell of tetrahedron `tet`.
    pub fn cell_id(&self, tet: u32) -> u32 {
        self.cell_ids.as_ref().map_or(tet, |ids| ids[tet as usize])
    }

    /// The number that the source gave a point.
    pub fn point_id(&self, point: u32) -> u32 {
        self.point_ids.as_ref().map_or(point, |ids| ids[point as usize])
    }

    /// The field of that name.
    pub fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|f| f.name == name)
    }
}
