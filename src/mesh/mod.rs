//! Tetrahedral meshes in host memory: points, tetrahedra and scalar fields. Does not depend on Vulkan.

mod along_curve;
mod bounds;
pub mod cases;
mod grading;
mod kuhn;
mod measure;
mod procedural;
mod validity;
mod warp;

pub use bounds::Bounds;
pub(crate) use kuhn::hash;
pub use kuhn::{kuhn, kuhn_jittered};
pub use procedural::{far_field, graded, shell, slivers};
pub use validity::{Fault, fault_of, is_usable, valid_grid};
pub(crate) use validity::{grid_of, words};

use crate::error::{Error, Result};

/// A tetrahedral mesh with scalar fields.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions, relative to [`Mesh::origin`].
    pub points: Vec<[f32; 3]>,
    /// Four indices into [`Mesh::points`] per tetrahedron. Their order, and so the sign of the volume, has no meaning.
    pub tets: Vec<[u32; 4]>,
    /// For each tetrahedron the id of the file cell it came from. File cells of all types are counted from 0; a
    /// hexahedron becomes several tetrahedra with the same id. `None`: tetrahedron `i` is file cell `i`.
    pub cell_ids: Option<Vec<u32>>,
    /// For each point its number in the source, if the order differs. `None`: point `i` is point `i` of the source.
    pub point_ids: Option<Vec<u32>>,
    /// Number of file cells, including those that have no tetrahedra; equals `tets.len()` without `cell_ids`.
    pub source_cells: u32,
    /// Scalar fields.
    pub fields: Vec<Field>,
    /// The offset to add to a point to get the coordinates of the source. Zero unless single precision would have lost
    /// the shape, as for a small mesh far from 0.
    pub origin: [f64; 3],
}

/// Whether a field's values belong to points or tetrahedra.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum On {
    /// One value per point, interpolated linearly in a tetrahedron.
    Points,
    /// One value per tetrahedron, constant in it.
    Cells,
}

impl On {
    /// Rejects values whose number differs from the mesh's number of points, or tetrahedra.
    pub(crate) fn check(self, values: &[f32], [points, tets]: [usize; 2]) -> Result<()> {
        match self.components(values, [points, tets])? {
            1 => Ok(()),
            several => Err(Error::Invalid(format!("a field of {several} components; this takes one"))),
        }
    }

    /// How many values there are for each of the mesh's points, or tetrahedra. Rejects any other number of values than a
    /// multiple of theirs.
    pub(crate) fn components(self, values: &[f32], [points, tets]: [usize; 2]) -> Result<usize> {
        let (expected, what) = if self == Self::Points { (points, "points") } else { (tets, "tetrahedra") };
        if values.len() == expected {
            return Ok(1);
        }
        if values.is_empty() || expected == 0 || !values.len().is_multiple_of(expected) {
            return Err(Error::Invalid(format!("a field of {} values where the mesh has {expected} {what}", values.len())));
        }
        Ok(values.len() / expected)
    }
}

/// A named scalar field.
#[derive(Clone, Debug)]
pub struct Field {
    /// Name, as in the source. Readers make several fields of an array of several components: those of a vector `v` are
    /// `v`, its length, and `v.x`, `v.y` and `v.z`; those of other arrays `a` are `a.0`, `a.1` and so on.
    pub name: String,
    /// Whether the values belong to points or tetrahedra.
    pub on: On,
    /// One value per point or per tetrahedron of the mesh.
    pub values: Vec<f32>,
}

impl Field {
    /// Smallest and largest finite value; `None` if no value is finite.
    pub fn range(&self) -> Option<[f32; 2]> {
        let finite = self.values.iter().copied().filter(|v| v.is_finite());
        finite.fold(None, |range, v| match range {
            None => Some([v, v]),
            Some([lo, hi]) => Some([lo.min(v), hi.max(v)]),
        })
    }
}

impl Mesh {
    /// A mesh from points and tetrahedra, without fields.
    pub fn new(points: Vec<[f32; 3]>, tets: Vec<[u32; 4]>) -> Self {
        let source_cells = tets.len() as u32;
        Self { points, tets, source_cells, ..Self::default() }
    }

    /// The id of the file cell that tetrahedron `tet` came from.
    pub fn cell_id(&self, tet: u32) -> u32 {
        self.cell_ids.as_ref().and_then(|ids| ids.get(tet as usize).copied()).unwrap_or(tet)
    }

    /// The number of a point in the source.
    pub fn point_id(&self, point: u32) -> u32 {
        self.point_ids.as_ref().and_then(|ids| ids.get(point as usize).copied()).unwrap_or(point)
    }

    /// The field with this name.
    pub fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|f| f.name == name)
    }
}
