//! The rays of a picture, in the form that kernels take. Twin of glsl/shared/rays.glsl.

use super::inverse_sqrt;
use crate::grid::reciprocal;
use crate::layout::constants::rays::{self as constants, MOST};
use glam::DVec3;

pub use crate::layout::constants::rays::LEAST;

/// Limit on the sample numbers of a ray: beyond it `k + ½` is no longer exact in single precision. The kernels store
/// flags from bit 30 on.
pub const MAX_SAMPLES: u32 = constants::MAX_SAMPLES as u32;

/// The ray of each pixel, as six vectors, and what values of a depth buffer mean on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayGrid {
    /// Origin of the ray of pixel (0, 0).
    pub origin: [f32; 3],
    /// Added to the origin for each pixel to the right.
    pub origin_x: [f32; 3],
    /// Added to the origin for each pixel down.
    pub origin_y: [f32; 3],
    /// Direction of the ray of pixel (0, 0), of any length.
    pub direction: [f32; 3],
    /// Added to the direction for each pixel to the right.
    pub direction_x: [f32; 3],
    /// Added to the direction for each pixel down.
    pub direction_y: [f32; 3],
    /// Four numbers p, q, r and s: value d of a depth buffer lies at `origin + direction·((p + d·q) / (r + d·s))`, with the
    /// direction before it becomes a unit vector.
    pub depth: [f32; 4],
}

impl RayGrid {
    /// Origin and unit direction of the ray of pixel (x, y), with row 0 on top. The origin is
    /// `(origin + x·origin_x) + y·origin_y` for each component. With w = `(direction + x·direction_x) + y·direction_y`,
    /// the direction is w · [`inverse_sqrt`]`((w₀² + w₁²) + w₂²)`. No operation is contracted.
    pub fn ray(&self, x: u32, y: u32) -> ([f32; 3], [f32; 3]) {
        let w = self.way(x, y);
        let r = inverse_sqrt(square(w));
        let (x, y) = (x as f32, y as f32);
        let origin = [0, 1, 2].map(|c| (self.origin[c] + x * self.origin_x[c]) + y * self.origin_y[c]);
        (origin, w.map(|v| v * r))
    }

    /// How many steps of `1 / inverse_step` from its origin the ray of pixel (x, y) reaches value `d` of a depth buffer, at
    /// least −1 and at most [`MAX_SAMPLES`], which also stands for infinity and for values that are not finite.
    pub fn steps_to(&self, x: u32, y: u32, d: f32, inverse_step: f32) -> f32 {
        let [p, q, r, s] = self.depth;
        let scale = r + d * s;
        if !(d.is_finite() && scale > LEAST && scale < MOST) {
            return MAX_SAMPLES as f32;
        }
        let square = square(self.way(x, y));
        let length = square * inverse_sqrt(square);
        let steps = (((p + d * q) * length) * reciprocal(scale)) * inverse_step;
        if steps < MAX_SAMPLES as f32 { steps.max(-1.0) } else { MAX_SAMPLES as f32 }
    }

    /// The value of a depth buffer at a place of the ray of pixel (x, y), `steps` steps of length `step` from its origin.
    /// Reverses [`RayGrid::steps_to`]. `None`: no value stands for that place.
    pub fn depth_at(&self, x: u32, y: u32, steps: f32, step: f32) -> Option<f32> {
        let [p, q, r, s] = self.depth;
        let way = (steps * step) * inverse_sqrt(square(self.way(x, y)));
        let below = q - way * s;
        (below.abs() > LEAST && below.abs() < MOST).then(|| (way * r - p) * reciprocal(below))
    }

    /// The direction of the ray of pixel (x, y), of any length.
    fn way(&self, x: u32, y: u32) -> [f32; 3] {
        let (x, y) = (x as f32, y as f32);
        [0, 1, 2].map(|c| (self.direction[c] + x * self.direction_x[c]) + y * self.direction_y[c])
    }

    /// Whether the rays of all pixels of a picture of this size are finite.
    pub(crate) fn is_finite(&self, [width, height]: [u32; 2]) -> bool {
        let [right, bottom] = [width, height].map(|n| n.saturating_sub(1));
        let corners = [(0, 0), (right, 0), (0, bottom), (right, bottom)].map(|(x, y)| self.ray(x, y));
        corners.iter().all(|(origin, direction)| origin.iter().chain(direction).all(|v| v.is_finite()))
    }
}

fn square(v: [f32; 3]) -> f32 {
    (v[0] * v[0] + v[1] * v[1]) + v[2] * v[2]
}

/// What a camera, or a renderer, sees.
pub(crate) struct View {
    /// Unit vectors to the right and to the top of the picture.
    pub right: DVec3,
    pub up: DVec3,
    /// Unit vector into the picture.
    pub forward: DVec3,
    pub rays: RayGrid,
    /// An upper bound on the distance from the origin of a ray at which it can meet the mesh's bounds.
    pub reach: f64,
}
