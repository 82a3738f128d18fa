//! The cells that the boundary touches, and the entries of cells with `Lists::Boundary` (SPEC 2.6). Twin of
//! `glsl/shared/{marks,seeds}.glsl`.
//!
//! A cell is marked if a boundary tetrahedron touches it according to the assignment. Any other cell lies either
//! entirely inside or entirely outside the mesh: inside if a non-boundary tetrahedron contains its centre. Because of
//! rounding the centre may lie in a gap between tetrahedra. Then the tetrahedra that have it within the margin of their
//! faces, at least one, are listed in place of the owner.

use super::tet::{Tet, Vec3};
use super::walk::Walker;
use crate::grid::morton;
use crate::layout::{NONE, bit};

/// One bit per cell at the level of the leaves, by Morton code.
#[derive(Clone, Debug)]
pub struct Marks(pub(super) Vec<u32>);

impl Marks {
    /// Whether the boundary touches the cell.
    pub fn contains(&self, cell: [u32; 3]) -> bool {
        bit(&self.0, morton(cell))
    }
}

/// Whether an unmarked cell with this centre lists `t`: `t` contains the centre and no lower tetrahedron does, or the
/// centre is within the margin of its faces and no tetrahedron contains it.
pub fn owns_centre(walker: &Walker<'_>, t: u32, tet: &Tet, centre: Vec3) -> bool {
    let weights = tet.weights(centre);
    if weights.clear || !weights.in_box || !weights.near() {
        return weights.clear;
    }
    let beaten_below = if weights.inside { t } else { NONE };
    let mut beaten = false;
    walker.star(t, centre, |u, _, weights| {
        beaten = weights.inside && u < beaten_below;
        beaten
    });
    !beaten
}
