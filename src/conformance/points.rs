//! The points that location cases use.

use super::data::Random;
use crate::mesh::Mesh;

/// Makes points in every kind of position. Returns with them the number of those, from the first on, that lie in the
/// closed tetrahedra as far as single precision can tell.
pub(crate) fn points(mesh: &Mesh) -> (Vec<[f32; 3]>, usize) {
    let mut random = Random::new(mesh.tets.len() as u32);
    let mut points = Vec::new();
    let used = |ids: &[u32; 4]| ids.map(|v| mesh.points.get(v as usize).copied());
    let cells: Vec<[[f32; 3]; 4]> = mesh.tets.iter().map(|t| used(t).map(|p| p.unwrap_or([f32::NAN; 3]))).collect();
    let finite: Vec<_> = cells.into_iter().filter(|c| c.iter().flatten().all(|x| x.abs() < 1e37)).collect();
    for _ in 0..if finite.is_empty() { 0 } else { 300 } {
        let v = finite[random.below(finite.len() as u32) as usize];
        let [a, b, c] = [random.unit(), random.unit(), random.unit()];
        let mix = |weights: [f32; 4]| {
            let sum: f32 = weights.iter().sum();
            [0, 1, 2].map(|i| {
                let x = (0..4).map(|k| v[k][i] * (weights[k] / sum)).sum::<f32>();
                let least = v.iter().fold(f32::MAX, |m, p| m.min(p[i]));
                let most = v.iter().fold(f32::MIN, |m, p| m.max(p[i]));
                x.clamp(least, most)
            })
        };
        points.push(v[0]);
        points.push(mix([1.0, 1.0, 0.0, 0.0]));
        points.push(mix([0.0, a, 1.0 - a, 0.0]));
        points.push(mix([0.0, 1.0, 1.0, 1.0]));
        points.push(mix([a + 0.01, b, c, 0.0]));
        points.push(mix([a, b, c, 1.0]));
    }
    let inside = points.len();
    let (lo, hi) = points
        .iter()
        .fold(([0.0f32; 3], [1.0f32; 3]), |(lo, hi), p| ([0, 1, 2].map(|i| lo[i].min(p[i])), [0, 1, 2].map(|i| hi[i].max(p[i]))));
    points.extend((0..500).map(|_| [0, 1, 2].map(|i| lo[i] + (random.unit() * 1.3 - 0.15) * (hi[i] - lo[i]))));
    points.extend([lo, hi, [lo[0], hi[1], lo[2]], [hi[0].next_up(), hi[1], hi[2]], lo.map(f32::next_down), hi.map(f32::next_up)]);
    points.extend([f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, -0.0, 1e-40, 1e30].map(|x| [x; 3]));
    for axis in 0..3 {
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e-42] {
            let mut p = [0, 1, 2].map(|i| f32::midpoint(lo[i], hi[i]));
            p[axis] = x;
            points.push(p);
        }
    }
    (points, inside)
}
