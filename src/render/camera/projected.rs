//! Views given by a matrix, as renderers have them.

use crate::error::{Error, Result};
use crate::mesh::Bounds;
use crate::render::RayGrid;
use crate::render::rays::View;
use glam::{DMat4, DVec2, DVec3, DVec4};

/// The view of a renderer, in whose picture the mesh appears at its place.
///
/// ```
/// use olbvh::glam::{DVec3, dcamera::rh::{proj::vulkan::perspective_infinite_reverse, view::look_at_mat4}};
/// use olbvh::{mesh::Bounds, render::{PicturePlan, ProjectedView, RenderSettings}};
///
/// let eye = look_at_mat4(DVec3::new(-3.0, -4.0, 5.0), DVec3::ZERO, DVec3::Z);
/// let view = ProjectedView { to_clip: perspective_infinite_reverse(0.8, 16.0 / 9.0, 0.1) * eye, reversed: true };
/// let bounds = Bounds { lo: [-1.0; 3], hi: [1.0; 3] };
/// let settings = RenderSettings { size: [1920, 1080], ..RenderSettings::default() };
/// let plan = PicturePlan::with_projected(&settings, &view, &bounds, [0.0; 3], Some([20.0, 95.0]))?;
/// // Upload plan.view() and plan.table, and give both to query::cmd_render, along with your depth buffer.
/// # Ok::<(), olbvh::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectedView {
    /// Takes points of the mesh (relative to [`crate::mesh::Mesh::origin`]) to Vulkan's clip space: projection · view ·
    /// model. Its y points down, so negate the second row of a matrix that is used with a viewport of negative height. The
    /// viewport is the picture, with depths from 0 to 1. It may come from a renderer that multiplies in single precision.
    pub to_clip: DMat4,
    /// Whether the near plane has depth 1, and what is far depth 0; otherwise it is the other way round. The far plane may
    /// lie at infinity.
    pub reversed: bool,
}

/// Planes of equal depth may be tilted by this much against the picture: several roundings to single precision.
const TILT: f64 = 1.0 / (1 << 18) as f64;

impl ProjectedView {
    /// The matrix with planes of equal depth that are exactly parallel to the picture, as they are in all matrices of
    /// cameras before these are multiplied in single precision; `None` if they are not parallel.
    fn levelled(&self) -> Option<DMat4> {
        let mut rows = self.to_clip.transpose();
        let (depth, ahead) = (rows.z_axis.truncate(), rows.w_axis.truncate());
        if ahead != DVec3::ZERO {
            let parallel = depth.project_onto(ahead);
            if depth.distance(parallel) > TILT * ahead.length() {
                return None;
            }
            rows.z_axis = parallel.extend(rows.z_axis.w);
        }
        Some(rows.transpose())
    }

    /// The view of a picture of this size.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the matrix has no inverse, or if its near plane is not parallel to the picture.
    pub(crate) fn view(&self, [width, height]: [u32; 2], bounds: &Bounds) -> Result<View> {
        let wrong = |why: &str| Err(Error::Invalid(format!("a matrix to clip space {why}")));
        let Some(to_clip) = self.levelled() else {
            return wrong("whose planes of equal depth are not parallel to the picture; render without an oblique near plane");
        };
        let inverse = to_clip.inverse();
        if !(to_clip.is_finite() && inverse.is_finite()) {
            return wrong("without an inverse");
        }
        // u grows from the near plane, where it is 0, to the far plane, where it is 1.
        let (base, slope) = if self.reversed { (1.0, -1.0) } else { (0.0, 1.0) };
        let at = |x: f64, y: f64, u: f64| inverse * DVec4::new(x, y, (u - base) * slope, 1.0);
        let clip = bounds.corners().map(|corner| to_clip * corner.extend(1.0));
        let depths = clip.iter().map(|c| if c.w > 0.0 { base + slope * c.z / c.w } else { 0.0 });
        let [nearest, farthest] = depths.fold([f64::MAX, f64::MIN], |[lo, hi], u| [lo.min(u), hi.max(u)]);
        // Rays start on the plane through the nearest corner, so that no single precision is wasted on the way to the mesh.
        let start = nearest.max(0.0);
        let rise = inverse.z_axis * slope;
        let weight = at(0.0, 0.0, start).w;
        // A point that lies u behind the start has the place `origin + way · u / (1 + u · bend)`.
        let bend = rise.w / weight;
        let origin = |x: f64, y: f64| at(x, y, start).truncate() / weight;
        let way = |x: f64, y: f64| (rise.truncate() - origin(x, y) * rise.w) / weight;
        // Centres of pixels.
        let [dx, dy] = [2.0 / f64::from(width), 2.0 / f64::from(height)];
        let first = DVec2::new(0.5 * dx - 1.0, 0.5 * dy - 1.0);
        let axes = |f: &dyn Fn(f64, f64) -> DVec3| {
            let [corner, right, down] = [f(first.x, first.y), f(first.x + 1.0, first.y), f(first.x, first.y + 1.0)];
            [corner, (right - corner) * dx, (down - corner) * dy].map(|v| v.as_vec3().to_array())
        };
        let longest = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].map(|[x, y]| way(x, y).length()).into_iter().fold(0.0, f64::max);
        // Directions of about unit length, so that their squares are neither denormal nor infinite in single precision.
        let unit = (-longest.log2().floor()).exp2();
        let [origins, ways] = [axes(&origin), axes(&|x, y| way(x, y) * unit)];
        let from = base - start;
        let depth = [from / unit, slope / unit, 1.0 + from * bend, slope * bend].map(|v| v as f32);
        let right = (origin(1.0, 0.0) - origin(-1.0, 0.0)).normalize();
        let up = (origin(0.0, -1.0) - origin(0.0, 1.0)).normalize();
        let ahead = way(0.0, 0.0);
        let forward = up.cross(right).normalize() * up.cross(right).dot(ahead).signum();
        let behind = (farthest - start).max(0.0);
        Ok(View {
            right,
            up,
            forward,
            rays: RayGrid {
                origin: origins[0],
                origin_x: origins[1],
                origin_y: origins[2],
                direction: ways[0],
                direction_x: ways[1],
                direction_y: ways[2],
                depth,
            },
            reach: longest * behind / (1.0 + behind * bend),
        })
    }
}

#[cfg(test)]
mod tests;
