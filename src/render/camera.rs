//! Cameras.

mod projected;
mod spec;

use super::RayGrid;
use super::rays::View;
use crate::error::{Error, Result};
use crate::mesh::Bounds;
use glam::{DMat3, DVec3};

pub use projected::ProjectedView;
pub use spec::{CameraSpec, HELP};

/// How rays spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Rays through one eye; the value is the angle between the top and the bottom of the picture, in degrees.
    Perspective(f64),
    /// Parallel rays; the value is the height of the picture in mesh units.
    Orthographic(f64),
}

/// A camera in mesh coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position of the eye.
    pub eye: DVec3,
    /// Unit vector into the picture.
    pub forward: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
    /// How rays spread.
    pub projection: Projection,
}

/// Default perspective angle, in degrees.
pub const DEFAULT_FOV: f64 = 30.0;
/// Part of the picture that a framed box fills.
const FILL: f64 = 0.94;

impl Camera {
    /// A camera at `eye` that looks at `target`. If `up` is parallel to the view, the back of the mesh is up (see
    /// [`upright`]).
    ///
    /// # Errors
    /// [`Error::Invalid`] if eye and target are the same point, a coordinate is not finite, or the projection has no
    /// extent.
    pub fn look_at(eye: DVec3, target: DVec3, up: DVec3, projection: Projection) -> Result<Self> {
        let forward = (target - eye).try_normalize().filter(|_| eye.is_finite() && target.is_finite());
        let Some(forward) = forward else {
            return Err(Error::Invalid(format!("a camera needs an eye and a target that differ, not {eye} and {target}")));
        };
        let (size, limit) = match projection {
            Projection::Perspective(degrees) => (degrees, 179.0),
            Projection::Orthographic(height) => (height, f64::MAX),
        };
        if !(size > 0.0 && size <= limit) {
            return Err(Error::Invalid("a camera's fov lies between 0 and 179 degrees, its ortho height above 0".into()));
        }
        let up = up.try_normalize().unwrap_or(DVec3::Z);
        let across = forward.cross(up);
        let right = if across.length_squared() > 1e-12 { across } else { forward.cross(upright(up).y_axis) }.normalize();
        Ok(Self { eye, forward, right, up: right.cross(forward), projection })
    }

    /// A camera on the side `from` (a direction of any length) of the box, placed so that all `points` just fit into
    /// the picture. `fov` is the perspective angle in degrees; `None`: orthographic.
    pub fn frame_from(bounds: &Bounds, points: &[DVec3], aspect: f64, from: DVec3, up: DVec3, fov: Option<f64>) -> Self {
        let corners = bounds.corners();
        let center = (corners[0] + corners[7]) * 0.5;
        let from = from.try_normalize().unwrap_or(DVec3::NEG_Y);
        let projection = Projection::Perspective(DEFAULT_FOV);
        let fallback = Self { eye: center, forward: -from, right: DVec3::X, up: DVec3::Z, projection };
        let mut camera = Self::look_at(center + from * bounds.diagonal(), center, up, projection).unwrap_or(fallback);
        let points = if points.is_empty() { &corners[..] } else { points };
        let place = |p: &DVec3| DVec3::new((p - center).dot(camera.right), (p - center).dot(camera.up), (p - center).dot(camera.forward));
        let local: Vec<DVec3> = points.iter().map(place).collect();
        let most = |f: &dyn Fn(DVec3) -> f64| local.iter().copied().map(f).fold(f64::MIN, f64::max);
        let smallest = bounds.diagonal() * 1e-6;
        let offset = if let Some(degrees) = fov {
            let ty = (degrees.clamp(0.01, 179.0).to_radians() * 0.5).tan() * FILL;
            let tx = ty * aspect;
            // Each point must satisfy X − ex ≤ (Z − ez)·tx and the three corresponding inequalities. Each pair of
            // opposite sides of the picture determines an eye; the one farther back is taken.
            let [r, l] = [most(&|p| p.x - p.z * tx), most(&|p| -p.x - p.z * tx)];
            let [t, b] = [most(&|p| p.y - p.z * ty), most(&|p| -p.y - p.z * ty)];
            camera.projection = Projection::Perspective(degrees);
            DVec3::new((r - l) * 0.5, (t - b) * 0.5, (-(r + l) * 0.5 / tx).min(-(t + b) * 0.5 / ty).min(-smallest))
        } else {
            let ([r, l], [t, b]) = ([most(&|p| p.x), most(&|p| -p.x)], [most(&|p| p.y), most(&|p| -p.y)]);
            let (w, h) = (r + l, t + b);
            camera.projection = Projection::Orthographic((h.max(w / aspect) / FILL).max(smallest));
            DVec3::new((r - l) * 0.5, (t - b) * 0.5, -bounds.diagonal())
        };
        camera.eye = center + camera.right * offset.x + camera.up * offset.y + camera.forward * offset.z;
        camera
    }

    /// The height of an orthographic picture with its centre on the view axis that all `points` just fit into.
    fn height_around(&self, bounds: &Bounds, points: &[DVec3], aspect: f64) -> f64 {
        let corners = bounds.corners();
        let points = if points.is_empty() { &corners[..] } else { points };
        let half = |p: &DVec3| (p - self.eye).dot(self.up).abs().max((p - self.eye).dot(self.right).abs() / aspect);
        (points.iter().map(half).fold(0.0, f64::max) * 2.0 / FILL).max(bounds.diagonal() * 1e-6)
    }

    /// The largest distance from the eye to a point of the box.
    pub(crate) fn distance(&self, bounds: &Bounds) -> f64 {
        bounds.corners().into_iter().map(|p| p.distance(self.eye)).fold(0.0, f64::max)
    }

    /// An upper bound on the distance from the origin of a ray of [`Camera::rays`] at which it can meet the box.
    fn reach(&self, size: [u32; 2], bounds: &Bounds) -> f64 {
        let depth = |p: DVec3| (p - self.eye).dot(self.forward);
        let corners = bounds.corners();
        let [near, far] = corners.into_iter().map(depth).fold([f64::MAX, f64::MIN], |[lo, hi], d| [lo.min(d), hi.max(d)]);
        let Projection::Perspective(degrees) = self.projection else { return far - near };
        let (near, [w, h]) = (near.max(0.0), size.map(f64::from));
        if far <= near {
            return 0.0;
        }
        let slope = (degrees.to_radians() * 0.5).tan() * (w / h).hypot(1.0);
        (self.distance(bounds) * (1.0 - near / far)).min(slope.hypot(1.0) * (far - near))
    }

    /// The view of a picture of `size`.
    pub(crate) fn view(&self, size: [u32; 2], bounds: &Bounds) -> View {
        let Self { right, up, forward, .. } = *self;
        View { right, up, forward, rays: self.rays(size, bounds), reach: self.reach(size, bounds) }
    }

    /// The rays of a picture of `size` (width, height) pixels. They start on the plane across the view through the
    /// nearest corner of `bounds`, or at the eye if that plane lies behind it, so that no single precision is wasted on
    /// the way to the mesh. Values of a depth buffer are distances from the eye along the axis of the view.
    pub fn rays(&self, size: [u32; 2], bounds: &Bounds) -> RayGrid {
        let [w, h] = size.map(f64::from);
        let depth = |p: DVec3| (p - self.eye).dot(self.forward);
        let nearest = bounds.corners().into_iter().map(depth).fold(f64::MAX, f64::min);
        // Centres of pixels: s = ((x + ½)·2/w − 1) to the right, t = 1 − (y + ½)·2/h upwards.
        let (s0, ds, t0, dt) = (1.0 / w - 1.0, 2.0 / w, 1.0 - 1.0 / h, -2.0 / h);
        let (half, perspective) = match self.projection {
            Projection::Perspective(degrees) => ((degrees.to_radians() * 0.5).tan(), true),
            Projection::Orthographic(height) => (height * 0.5, false),
        };
        let (across, upwards) = (self.right * (half * w / h), self.up * half);
        let (first, dx, dy) = (across * s0 + upwards * t0, across * ds, upwards * dt);
        let f = |v: DVec3| v.as_vec3().to_array();
        let start = if perspective { nearest.max(0.0) } else { nearest };
        let depth = [-start as f32, 1.0, 1.0, 0.0];
        if perspective {
            let near = start;
            let (base, near_dx, near_dy) = (self.eye + (self.forward + first) * near, dx * near, dy * near);
            RayGrid {
                origin: f(base),
                origin_x: f(near_dx),
                origin_y: f(near_dy),
                direction: f(self.forward + first),
                direction_x: f(dx),
                direction_y: f(dy),
                depth,
            }
        } else {
            let base = self.eye + self.forward * nearest + first;
            RayGrid {
                origin: f(base),
                origin_x: f(dx),
                origin_y: f(dy),
                direction: f(self.forward),
                direction_x: [0.0; 3],
                direction_y: [0.0; 3],
                depth,
            }
        }
    }
}

/// The axes of a mesh with this vertical axis, to its right, to its back, and up: x, y and z turned by the least angle
/// that brings z to `up`, a unit vector. So with y up, the front is towards +z.
pub fn upright(up: DVec3) -> DMat3 {
    let DVec3 { x, y, z } = up;
    if z < -1.0 + 1e-12 {
        return DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)); // any half turn will do
    }
    let k = 1.0 / (1.0 + z);
    DMat3::from_cols(DVec3::new(1.0 - x * x * k, -x * y * k, -x), DVec3::new(-x * y * k, 1.0 - y * y * k, -y), up)
}

/// The direction of the default view, from the mesh to the eye, along the axes of [`upright`]: front, right and top
/// sides are visible, larger sides more. `extent` is the size of the mesh along these axes.
pub fn three_quarter(extent: DVec3) -> DVec3 {
    let largest = extent.max_element().max(0.0);
    let e = extent.to_array().map(|x| if largest > 0.0 { (x / largest).max(0.02) } else { 1.0 });
    let sides = [e[1] * e[2], e[0] * e[2], e[0] * e[1]];
    let mean = (sides[0] * sides[1] * sides[2]).cbrt();
    let weight = sides.map(|side| (side / mean).powf(0.35).clamp(0.5, 2.0));
    DVec3::new(0.58 * weight[0], -weight[1], 0.55 * weight[2])
}

#[cfg(test)]
mod tests;
