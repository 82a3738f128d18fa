//! The cells that the boundary touches, and who is listed where under `Lists::Boundary` (SPEC 2.6). Twin of `glsl/shared/{marks,seeds}.glsl`.
//!
//! A cell is marked if a boundary primitive touches it, under the assignment. Any other cell lies inside the mesh as a whole or outside as a
//! whole: inside if a primitive that is no boundary contains its centre. Rounding may leave the centre in a gap between cells; then those that
//! come within the margin of their faces, at least one, stand for it.

use super::boundary::{NONE, bit};
use super::grid::morton;
use super::tet::{Tet, Vec3};
use super::walk::Walker;

/// One bit per cell of the level of the leaves, by Morton code.
#[derive(Clone, Debug)]
pub struct Marks(pub(super) Vec<u32>);

impl Marks {
    /// Whether the boundary touches the cell.
    pub fn contains(&self, cell: [u32; 3]) -> bool {
        bit(&self.0, morton(cell))
    }
}

/// Whether `t` is a seed of an unmarked cell with this centre: it contains it and no lower one does, or it is near and none does.
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
