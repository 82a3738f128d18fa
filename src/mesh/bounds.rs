//! The bounds of a mesh.

use crate::grid::MIN_EXTENT;
use crate::layout::Grid;
use glam::DVec3;

/// A closed box in mesh coordinates (relative to [`crate::mesh::Mesh::origin`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lower corner.
    pub lo: [f32; 3],
    /// Upper corner.
    pub hi: [f32; 3],
}

impl From<&Grid> for Bounds {
    fn from(grid: &Grid) -> Self {
        let corner = |c: [f32; 4]| [c[0], c[1], c[2]];
        Self { lo: corner(grid.lo), hi: corner(grid.hi) }
    }
}

impl Bounds {
    /// The eight corners in double precision; the first is the lower one, the last the upper one.
    pub(crate) fn corners(&self) -> [DVec3; 8] {
        let (lo, hi) = (DVec3::from_array(self.lo.map(f64::from)), DVec3::from_array(self.hi.map(f64::from)));
        [0, 1, 2, 3, 4, 5, 6, 7].map(|i| {
            let pick = |bit: u32, c: usize| if i >> bit & 1 == 0 { lo[c] } else { hi[c] };
            DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2))
        })
    }

    /// Length of the diagonal; 1 for a box that counts as a point (see [`MIN_EXTENT`]), so that steps and units exist.
    pub fn diagonal(&self) -> f64 {
        let [lo, hi] = [self.corners()[0], self.corners()[7]];
        let d = (hi - lo).length();
        if d >= f64::from(MIN_EXTENT) && d.is_finite() { d } else { 1.0 }
    }
}
