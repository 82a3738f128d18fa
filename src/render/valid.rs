//! The tetrahedra that count.

use crate::mesh::{Bounds, Mesh};

/// The valid tetrahedra of a mesh, the only ones that are drawn.
#[derive(Clone, Copy)]
pub struct ValidTets<'a> {
    /// Their bounds.
    pub bounds: Bounds,
    /// Four entries per tetrahedron of the mesh, [`u32::MAX`] if the face opposite to that vertex is on the surface.
    /// They may be missing if only iso-surfaces are drawn.
    pub neighbours: &'a [[u32; 4]],
    /// Whether the tetrahedron of this number is valid.
    pub is_valid: &'a (dyn Fn(u32) -> bool + Sync),
}

impl ValidTets<'_> {
    /// Their numbers and vertices.
    pub(super) fn of(&self, mesh: &Mesh) -> impl Iterator<Item = (usize, [usize; 4])> {
        let numbered = mesh.tets.iter().enumerate().filter(|&(tet, _)| (self.is_valid)(tet as u32));
        numbered.map(|(tet, ids)| (tet, ids.map(|id| id as usize)))
    }

    /// Whether the face opposite to vertex `i` of a tetrahedron is on the surface.
    pub(super) fn is_outside(&self, tet: usize, i: usize) -> bool {
        self.neighbours.get(tet).is_some_and(|across| across[i] == u32::MAX)
    }
}
