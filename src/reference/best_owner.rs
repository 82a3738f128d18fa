//! Choice of the owner of a point among candidate tetrahedra (SPEC 3.1). Twin of `glsl/shared/best_owner.glsl`.

use super::tet::{Tet, Weights};
use crate::layout::NONE;

/// The best candidate so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Best {
    /// Number of the tetrahedron, or [`NONE`].
    pub owner: u32,
    /// Whether the tetrahedron contains the point.
    pub inside: bool,
    /// Whether its bounding box contains the point.
    pub in_box: bool,
    /// Its smallest barycentric coordinate; 0 if it contains the point.
    pub smallest: f32,
}

impl Default for Best {
    fn default() -> Self {
        Self::NONE
    }
}

impl Best {
    /// No candidate yet.
    pub const NONE: Self = Self { owner: NONE, inside: false, in_box: false, smallest: f32::MIN };

    /// A candidate that contains the point.
    pub fn inside(owner: u32) -> Self {
        Self { owner, inside: true, in_box: true, smallest: 0.0 }
    }

    /// Takes candidate `t` if it is better than the best so far. Candidates that contain the point come first, of those
    /// the lowest id. Then come candidates whose box contains it, then the largest smallest barycentric coordinate,
    /// then the lowest id. A flat tetrahedron that does not contain the point is never taken.
    pub fn consider(&mut self, t: u32, tet: &Tet, weights: &Weights) {
        if weights.inside {
            if !self.inside || t < self.owner {
                *self = Self::inside(t);
            }
            return;
        }
        let (in_box, smallest) = (weights.in_box, weights.smallest());
        let closer = smallest > self.smallest || (smallest == self.smallest && t < self.owner);
        let better = self.owner == NONE || (in_box && !self.in_box) || (in_box == self.in_box && closer);
        if !self.inside && better && tet.volume() != 0.0 {
            *self = Self { owner: t, inside: false, in_box, smallest };
        }
    }
}
