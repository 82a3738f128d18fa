//! A distance of samples that suits a mesh.

use super::settings::DEFAULT_STEPS;

/// Tetrahedra that are looked at, spread evenly over the mesh.
const SAMPLES: usize = 1 << 17;
/// How many times finer than by default samples are at most.
const FINEST: f64 = 16.0;

/// How thin a mesh is, and the step that this suggests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuitedStep {
    /// Step for [`super::RenderSettings::step`], in mesh units: the thickness, at least 1/8192 of the diagonal. `None`
    /// where that is no less than the default step, 1/512 of the diagonal.
    pub step: Option<f64>,
    /// Median thickness of the tetrahedra, weighted by the areas of their largest faces, since that is what a picture
    /// shows of them. Parts that are thinner than the step show rings, or are missed.
    pub thickness: f64,
}

/// The step that suits a mesh which may be thinner than the default step, such as a plate, or consist of thin layers.
/// The thickness of a tetrahedron is its smallest altitude. `None` for a mesh without volume.
pub fn suited_step(points: &[[f32; 3]], tets: &[[u32; 4]]) -> Option<SuitedStep> {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let mut found: Vec<[f64; 2]> = Vec::new();
    for tet in tets.iter().step_by(tets.len().div_ceil(SAMPLES).max(1)) {
        let corners = tet.map(|v| points.get(v as usize).map(|p| p.map(f64::from)));
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { continue };
        let [altitude, area] = smallest_altitude([a, b, c, d]);
        if !(altitude > 0.0 && altitude.is_finite()) {
            continue;
        }
        found.push([altitude, area]);
        for p in [a, b, c, d] {
            for k in 0..3 {
                (lo[k], hi[k]) = (lo[k].min(p[k]), hi[k].max(p[k]));
            }
        }
    }
    found.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let half = found.iter().map(|[_, area]| area).sum::<f64>() / 2.0;
    let mut below = 0.0;
    let [thickness, _] = *found.iter().find(|[_, area]| {
        below += area;
        below >= half
    })?;
    let default = (0..3).map(|k| (hi[k] - lo[k]).powi(2)).sum::<f64>().sqrt() / DEFAULT_STEPS;
    Some(SuitedStep { step: (thickness < default).then(|| thickness.max(default / FINEST)), thickness })
}

/// The smallest altitude, three times the volume by the area of the largest face, and twice that area.
fn smallest_altitude([a, b, c, d]: [[f64; 3]; 4]) -> [f64; 2] {
    let sub = |p: [f64; 3], q: [f64; 3]| [0, 1, 2].map(|k| p[k] - q[k]);
    let cross = |u: [f64; 3], v: [f64; 3]| [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let dot = |u: [f64; 3], v: [f64; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let area = |p, q, r| {
        let normal = cross(sub(q, p), sub(r, p));
        dot(normal, normal).sqrt()
    };
    let volume = dot(cross(sub(b, a), sub(c, a)), sub(d, a)).abs();
    let largest = area(a, b, c).max(area(a, b, d)).max(area(a, c, d)).max(area(b, c, d));
    [volume / largest, largest]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat box of Kuhn tetrahedra, `height` thick.
    fn plate(height: f32) -> SuitedStep {
        let mut mesh = crate::mesh::kuhn([32, 32, 1]).unwrap();
        mesh.points.iter_mut().for_each(|p| p[2] *= height);
        suited_step(&mesh.points, &mesh.tets).unwrap()
    }

    #[test]
    fn thin_plates_get_finer_steps() {
        let diagonal = 2f64.sqrt() * 32.0;
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-3;
        assert_eq!(plate(1.0).step, None);
        // Half as thick as the default step: the altitude of these tetrahedra is nearly the height.
        let thin = plate(diagonal as f32 / 1024.0);
        assert!(near(thin.step.unwrap(), diagonal / 1024.0) && near(thin.thickness, diagonal / 1024.0), "{thin:?}");
        let film = plate(1e-4);
        assert!(near(film.step.unwrap(), diagonal / 8192.0) && near(film.thickness, 1e-4), "{film:?}");
        assert_eq!(suited_step(&[[0.0; 3]; 4], &[[0, 1, 2, 3], [0, 1, 2, 9]]), None);
    }
}
