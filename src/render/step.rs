//! A distance of samples that suits a mesh.

use super::settings::DEFAULT_STEPS;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Tetrahedra that are looked at, spread evenly over the mesh.
const SAMPLES: usize = 1 << 17;
/// How many times finer than by default samples are at most.
const FINEST: f64 = 16.0;
/// Samples through a wall. With fewer, their number differs visibly from pixel to pixel: walls show grain like wood.
const IN_WALLS: f64 = 12.0;
/// How many times finer than one per layer samples are at most for the sake of walls.
const FINER: f64 = 4.0;

/// How thin a mesh is, and the step that this suggests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuitedStep {
    /// Step for [`super::RenderSettings::step`], in mesh units. `None` where nothing is gained over the default step,
    /// 1/512 of the diagonal. A layer gets one step; a wall gets 12, if they are no finer than a quarter of the default
    /// step or of the layer. No step is below 1/8192 of the diagonal.
    pub step: Option<f64>,
    /// Thickness of layers: the median smallest altitude of the tetrahedra, weighted by the areas of their largest
    /// faces, since that is what a picture shows of them. Layers that are thinner than the step show rings, or are
    /// missed.
    pub thickness: f64,
    /// Mean thickness of walls: twice the volume over the area of the surface.
    pub wall: f64,
}

/// The step that suits a mesh which may have thin walls, such as a plate or a pot, or consist of thin layers. `None`
/// for a mesh without volume.
pub fn suited_step(points: &[[f32; 3]], tets: &[[u32; 4]]) -> Option<SuitedStep> {
    let corner = |v: u32| points.get(v as usize).map(|&p| Vec3::from_array(p).as_dvec3());
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut found: Vec<[f64; 2]> = Vec::new();
    let every = tets.len().div_ceil(SAMPLES).max(1);
    for tet in tets.iter().step_by(every) {
        let [Some(a), Some(b), Some(c), Some(d)] = tet.map(corner) else { continue };
        let [altitude, area] = smallest_altitude([a, b, c, d]);
        if !(altitude > 0.0 && altitude.is_finite()) {
            continue;
        }
        found.push([altitude, area]);
        (lo, hi) = [a, b, c, d].into_iter().fold((lo, hi), |(lo, hi), p| (lo.min(p), hi.max(p)));
    }
    found.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let half = found.iter().map(|[_, area]| area).sum::<f64>() / 2.0;
    let mut below = 0.0;
    let [thickness, _] = *found.iter().find(|[_, area]| {
        below += area;
        below >= half
    })?;
    let default = (hi - lo).length() / DEFAULT_STEPS;
    // An altitude times twice the area of its face is six times the volume.
    let volume = found.iter().map(|[altitude, area]| altitude * area).sum::<f64>() / 6.0 * every as f64;
    let wall = 2.0 * volume / surface(&corner, tets);
    let layer = thickness.min(default);
    let step = layer.min((wall / IN_WALLS).max(layer / FINER)).max(default / FINEST);
    Some(SuitedStep { step: (step < default).then_some(step), thickness, wall })
}

/// The area of the faces that only one tetrahedron has. In large meshes, faces are taken by their lowest vertex, and
/// stand for the others.
fn surface(corner: &(impl Fn(u32) -> Option<DVec3> + Sync), tets: &[[u32; 4]]) -> f64 {
    let one_in = tets.len().div_ceil(SAMPLES).max(1) as u32;
    let is_taken = |v: u32| (v.wrapping_mul(0x9e37_79b9) >> 8).is_multiple_of(one_in);
    let faces = |&[a, b, c, d]: &[u32; 4]| {
        let taken = [[a, b, c], [a, b, d], [a, c, d], [b, c, d]].into_iter().filter(|&[p, q, r]| is_taken(p.min(q).min(r)));
        taken.map(|mut face| {
            face.sort_unstable();
            face
        })
    };
    let mut all: Vec<[u32; 3]> = tets.par_iter().flat_map_iter(faces).collect();
    all.par_sort_unstable();
    let area = |face: &[u32; 3]| {
        let [Some(p), Some(q), Some(r)] = face.map(corner) else { return 0.0 };
        double_area(p, q, r) / 2.0
    };
    all.chunk_by(|a, b| a == b).filter(|same| same.len() == 1).map(|same| area(&same[0])).sum::<f64>() * f64::from(one_in)
}

fn double_area(p: DVec3, q: DVec3, r: DVec3) -> f64 {
    (q - p).cross(r - p).length()
}

/// The smallest altitude, three times the volume by the area of the largest face, and twice that area.
fn smallest_altitude([a, b, c, d]: [DVec3; 4]) -> [f64; 2] {
    let volume = (b - a).cross(c - a).dot(d - a).abs();
    let largest = double_area(a, b, c).max(double_area(a, b, d)).max(double_area(a, c, d)).max(double_area(b, c, d));
    [volume / largest, largest]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat box of Kuhn tetrahedra, `height` thick.
    fn plate(layers: u32, height: f32) -> SuitedStep {
        let mut mesh = crate::mesh::kuhn([32, 32, layers]).unwrap();
        mesh.points.iter_mut().for_each(|p| p[2] *= height / layers as f32);
        suited_step(&mesh.points, &mesh.tets).unwrap()
    }

    fn near(a: f64, b: f64) -> bool {
        (a / b - 1.0).abs() < 2e-3
    }

    #[test]
    fn thin_plates_get_finer_steps() {
        let diagonal = 2f64.sqrt() * 32.0;
        // Half as thick as the default step: the altitude of these tetrahedra is nearly the height.
        let thin = plate(1, diagonal as f32 / 1024.0);
        assert!(near(thin.step.unwrap(), diagonal / 4096.0) && near(thin.thickness, diagonal / 1024.0), "{thin:?}");
        let film = plate(1, 1e-4);
        assert!(near(film.step.unwrap(), diagonal / 8192.0) && near(film.thickness, 1e-4), "{film:?}");
        assert_eq!(suited_step(&[[0.0; 3]; 4], &[[0, 1, 2, 3], [0, 1, 2, 9]]), None);
    }

    /// Walls of a few default steps get twelve steps, however they are cut into cells; thick ones keep the default.
    #[test]
    fn walls_get_twelve_steps() {
        let diagonal = 2f64.sqrt() * 32.0;
        let height = diagonal as f32 / 512.0 * 5.0;
        for layers in [1, 3] {
            let wall = plate(layers, height);
            assert!((wall.wall / f64::from(height) - 1.0).abs() < 0.05 && wall.step == Some(wall.wall / 12.0), "{layers}: {wall:?}");
        }
        for layers in [1, 16] {
            assert_eq!(plate(layers, 4.0).step, None, "{layers}");
        }
    }

    /// In large meshes a part of the faces stands for all.
    #[test]
    fn large_surfaces_are_estimated() {
        let mesh = crate::mesh::kuhn([64, 64, 16]).unwrap();
        assert!(mesh.tets.len() > 2 * SAMPLES);
        let wall = suited_step(&mesh.points, &mesh.tets).unwrap().wall;
        let exact = 2.0 * 65_536.0 / (2.0 * 4096.0 + 4.0 * 1024.0);
        assert!((wall / exact - 1.0).abs() < 0.1, "{wall} {exact}");
    }
}
