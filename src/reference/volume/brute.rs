//! The oracle for the renderers: it uses another camera formula, tests every tetrahedron at every sample in double
//! precision, and has neither tree nor table.

use super::Drawing;
use crate::mesh::{Bounds, On};
use crate::render::shading::SKIN;
use crate::render::{OPACITY_UNIT, Projection, RenderSettings, Shade};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// A tetrahedron prepared for tests: barycentric coordinates 1 to 3 are `inverse · (p − corner)`.
struct Cell {
    id: usize,
    corner: DVec3,
    inverse: DMat3,
}

/// Draws what [`super::render`] should draw for `settings`, in time proportional to samples × tetrahedra, as straight
/// RGBA. The transfer function of `settings` must have opacities. Only size, clips and light are taken from the scene's plan.
pub fn brute_force(scene: &Drawing<'_>, settings: &RenderSettings, bounds: &Bounds) -> Vec<u8> {
    let (cells, plan, range, camera) = (cells(scene), scene.plan(), scene.prepared.range, &scene.prepared.camera);
    let [width, height] = plan.size.map(f64::from);
    let diagonal = bounds.diagonal();
    let step = settings.step.unwrap_or(diagonal / 512.0);
    let corner = |i: u32| DVec3::from_array([0, 1, 2].map(|c| f64::from(if i >> c & 1 == 0 { bounds.lo[c] } else { bounds.hi[c] })));
    let near = (0..8).map(|i| (corner(i) - camera.eye).dot(camera.forward)).fold(f64::MAX, f64::min);
    let clips: Vec<_> = plan.clips.iter().map(|&[x, y, z, d]| (DVec3::new(x.into(), y.into(), z.into()), f64::from(d))).collect();
    let span = f64::from(range[1]) - f64::from(range[0]);
    let pixel = |i: u32| {
        let (x, y) = (f64::from(i % plan.size[0]), f64::from(i / plan.size[0]));
        let (s, t) = (((x + 0.5) / width * 2.0 - 1.0) * width / height, 1.0 - (y + 0.5) / height * 2.0);
        let (start, way) = match camera.projection {
            Projection::Perspective(fov) => {
                let half = (fov.to_radians() / 2.0).tan();
                let way = camera.forward + camera.right * (s * half) + camera.up * (t * half);
                (camera.eye + way * near.max(0.0), way.normalize())
            }
            Projection::Orthographic(h) => {
                (camera.eye + camera.forward * near + (camera.right * s + camera.up * t) * (h / 2.0), camera.forward)
            }
        };
        let half = plan.lighting.map(|light| light.half(way.as_vec3().to_array()));
        // The distance at which the ray enters through the last of the clips, and that clip's normal.
        let entries = clips.iter().filter(|(n, _)| n.dot(way) < 0.0).map(|&(n, d)| ((d - n.dot(start)) / n.dot(way), n));
        let cut = entries.filter(|&(from, _)| from > 0.0).max_by(|a, b| a.0.total_cmp(&b.0));
        let (mut sum, mut joins_next) = ([0.0f64; 4], false);
        let samples = ((start - corner(0)).length() + 2.0 * diagonal) / step;
        for k in 0..samples as u32 {
            let along = (f64::from(k) + 0.5) * step;
            let p = start + way * along;
            if clips.iter().any(|&(n, d)| n.dot(p) > d) {
                continue;
            }
            // The first sample that shows something after others that do not is lit where the ray enters its tetrahedron.
            let joins = std::mem::take(&mut joins_next);
            let Some((cell, b)) = cells.iter().find_map(|cell| Some((cell, cell.around(p)?))) else { continue };
            let value = value_at(scene, cell, b);
            if !value.is_finite() {
                continue;
            }
            let back = if joins { 0.0 } else { cell.way_back(b, way * step).min(along / step) };
            let normal = normal_at(scene, cell, cell.barycentric(p - way * (step * back)));
            let normal = cut.map_or(normal, |(from, n)| {
                let depth = along - from;
                let part = if depth < step { 1.0 } else { (1.0 - depth / (SKIN * diagonal)).max(0.0) };
                normal + (n - normal) * part
            });
            let place = ((value - f64::from(range[0])) / span).clamp(0.0, 1.0);
            let [r, g, b, a] = settings.transfer.at(place as f32);
            let a = 1.0 - (1.0 - f64::from(a)).powf(f64::from(settings.opacity_scale) * step / (OPACITY_UNIT * diagonal));
            let shade = match (plan.lighting, half) {
                (Some(light), Some(half)) if !scene.prepared.normals.is_empty() => {
                    light.shade(normal.as_vec3().to_array(), way.as_vec3().to_array(), half)
                }
                _ => Shade { factor: 1.0, added: 0.0, rim: 0.0 },
            };
            if a <= 0.0 {
                continue;
            }
            joins_next = true;
            let a = a + (1.0 - a) * f64::from(shade.rim);
            let w = (1.0 - sum[3]) * a;
            for (sum, c) in sum.iter_mut().zip([r, g, b]) {
                *sum += w * f64::from((c * shade.factor + shade.added).min(1.0));
            }
            sum[3] += w;
            if sum[3] >= f64::from(settings.termination) {
                break;
            }
        }
        settings.background.pixel(sum.map(|v| v as f32), y as u32, plan.size[1])
    };
    (0..plan.size[0] * plan.size[1]).into_par_iter().flat_map_iter(pixel).collect()
}

/// The valid tetrahedra that have a volume.
fn cells(scene: &Drawing<'_>) -> Vec<Cell> {
    let cell = |(id, ids): (usize, &[u32; 4])| {
        let [a, b, c, d] = ids.map(|i| DVec3::from_array(scene.mesh.points[i as usize].map(f64::from)));
        let edges = DMat3::from_cols(b - a, c - a, d - a);
        (edges.determinant() != 0.0).then(|| Cell { id, corner: a, inverse: edges.inverse() })
    };
    scene.mesh.tets.iter().enumerate().filter(|&(t, _)| scene.topology.is_valid(t as u32)).filter_map(cell).collect()
}

impl Cell {
    fn barycentric(&self, p: DVec3) -> [f64; 4] {
        let b = self.inverse * (p - self.corner);
        [1.0 - b.element_sum(), b.x, b.y, b.z]
    }

    /// Barycentric coordinates of a point in the tetrahedron.
    fn around(&self, p: DVec3) -> Option<[f64; 4]> {
        let b = self.barycentric(p);
        b.iter().all(|&b| b >= 0.0).then_some(b)
    }

    /// How many steps, one at most, lead back from a place in the tetrahedron to where it begins.
    fn way_back(&self, b: [f64; 4], step: DVec3) -> f64 {
        let change = self.inverse * step;
        let change = [-change.element_sum(), change.x, change.y, change.z];
        (0..4).filter(|&i| b[i] < change[i]).map(|i| b[i] / change[i]).fold(1.0, f64::min)
    }
}

/// The values of a tetrahedron's corners at barycentric coordinates `b`.
fn mix(b: [f64; 4], v: [f32; 4]) -> f64 {
    (0..4).map(|i| b[i] * f64::from(v[i])).sum()
}

fn value_at(scene: &Drawing<'_>, cell: &Cell, b: [f64; 4]) -> f64 {
    match scene.field.on {
        On::Points => mix(b, scene.mesh.tets[cell.id].map(|i| scene.field.values[i as usize])),
        On::Cells => f64::from(scene.field.values[cell.id]),
    }
}

fn normal_at(scene: &Drawing<'_>, cell: &Cell, b: [f64; 4]) -> DVec3 {
    let of = |c: usize| scene.mesh.tets[cell.id].map(|i| scene.prepared.normals.get(i as usize).map_or(0.0, |n| n[c]));
    DVec3::new(mix(b, of(0)), mix(b, of(1)), mix(b, of(2)))
}
