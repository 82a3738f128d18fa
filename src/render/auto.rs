//! Automatic opacity, for fields without an opacity given.

use super::{OPACITY_UNIT, ValidTets};
use crate::mesh::{Field, Mesh, On};
use glam::DVec3;

/// Bins of the histogram.
const BINS: usize = 64;
/// Control points of the result.
const POINTS: usize = 33;
/// How much rare values gain over common ones; with 1 every value would show equally.
const EQUALITY: f64 = 0.85;
/// Optical depth of the mesh along an average ray.
const DEPTH: f64 = 1.4;
/// Largest opacity of a value, per unit.
const MOST: f64 = 0.85;

/// Opacity points for a field over `range`, derived from the distribution of its values over the mesh's volume. Common
/// values become faint, so that rare ones show through them, and high values count somewhat more than low ones. The
/// opacities are scaled so that about a quarter of the light passes an average ray, whose length is the mean chord of
/// the mesh (four times volume over surface).
pub fn auto_opacity(mesh: &Mesh, valid: &ValidTets<'_>, field: &Field, range: [f32; 2]) -> Vec<(f32, f32)> {
    let unit = valid.bounds.diagonal() * OPACITY_UNIT;
    let (lo, span) = (f64::from(range[0]), f64::from(range[1]) - f64::from(range[0]));
    let mut bins = [0.0f64; BINS];
    let (mut volume, mut surface) = (0.0, 0.0);
    for (tet, ids) in valid.of(mesh) {
        let p = ids.map(|id| DVec3::from_array(mesh.points[id].map(f64::from)) / unit);
        let v = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]).abs() / 6.0;
        volume += v;
        for (i, face) in [(1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2)].into_iter().enumerate() {
            if valid.is_outside(tet, i) {
                surface += (p[face.1] - p[face.0]).cross(p[face.2] - p[face.0]).length() / 2.0;
            }
        }
        let value = |i: usize| field.values.get(i).map_or(f64::NAN, |&v| (f64::from(v) - lo) / span);
        let values = if field.on == On::Points { ids.map(value) } else { [value(tet); 4] };
        if values.iter().all(|v| (0.0..=1.0).contains(v)) {
            // The volume of the tetrahedron is spread evenly over the bins from the smallest to the largest value.
            let bin = |v: f64| ((v * BINS as f64) as usize).min(BINS - 1);
            let (first, last) = (bin(values.into_iter().fold(1.0, f64::min)), bin(values.into_iter().fold(0.0, f64::max)));
            bins[first..=last].iter_mut().for_each(|b| *b += v / (last - first + 1) as f64);
        }
    }
    let total: f64 = bins.iter().sum();
    if !(total > 0.0 && surface > 0.0 && volume.is_finite()) {
        return super::transfer::DEFAULT_OPACITY.to_vec();
    }
    for _ in 0..3 {
        let old = bins;
        for (i, b) in bins.iter_mut().enumerate() {
            *b = (old[i.saturating_sub(1)] + 2.0 * old[i] + old[(i + 1).min(BINS - 1)]) / 4.0;
        }
    }
    let share = bins.map(|b| b / total);
    let weight = |i: usize| (share[i] * BINS as f64 + 0.01).powf(-EQUALITY) * (0.5 + (i as f64 + 0.5) / BINS as f64);
    let mean: f64 = (0..BINS).map(|i| share[i] * weight(i)).sum();
    // Extinction per unit length and weight.
    let scale = DEPTH / (mean * 4.0 * volume / surface);
    let opacity = |i: usize| (1.0 - (-scale * weight(i)).exp()).min(MOST) as f32;
    let point = |k: usize| {
        let x = k as f64 / (POINTS - 1) as f64;
        (x as f32, opacity(((x * BINS as f64) as usize).min(BINS - 1)))
    };
    (0..POINTS).map(point).collect()
}
