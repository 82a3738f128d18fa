//! Shading: normals at the vertices, and the light.
//!
//! A vertex on the surface has the normal of the surface, of length 1 (shorter on coarse meshes, for the same effect).
//! A vertex inside has the gradient of the field, with a length that grows with its steepness up to 1. Interpolated
//! like any field, these normals light the surface and the fronts inside the mesh, and leave even regions alone.

use crate::mesh::{Field, Mesh, On};
use crate::render::{ValidTets, inverse_sqrt};
use glam::{DVec3, Vec3};

/// Part of the light that comes from all directions.
const AMBIENT: f32 = 0.42;
/// Part of the light that depends on the angle between normal and light.
const DIFFUSE: f32 = 0.72;
/// Strength of highlights (their exponent is 32).
const SPECULAR: f32 = 0.18;
/// Strength of a second light, at the viewer's eye, as a part of the first. The stronger of both counts, so that what
/// faces the viewer has nearly the colours of the legend, whatever the direction to the light.
const FILL: f32 = 0.75;
/// A normal of the surface has length 1 where the tetrahedra on it are at most this thick, in diagonals. So the lit
/// skin is equally deep on coarse and on fine meshes.
pub(crate) const SKIN: f64 = 0.02;
/// A gradient makes a normal of length 1 if it would cross the field's range on this part of the diagonal.
const STEEP: f64 = 0.12;

/// The light of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lighting {
    /// Unit vector to the light, in mesh coordinates.
    pub to_light: [f32; 3],
    /// Ambient, diffuse, specular.
    pub strength: [f32; 3],
    /// Strength of the light at the viewer's eye, as a part of the diffuse one.
    pub fill: f32,
    /// Opacity of one step on a surface seen exactly from the side.
    pub rim: f32,
}

/// The effect of light on a sample: `lit = min(color·factor + added, 1)`, `opacity' = a + (1 − a)·rim`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shade {
    /// Factor on the colour.
    pub factor: f32,
    /// White added.
    pub added: f32,
    /// Opacity added.
    pub rim: f32,
}

impl Lighting {
    /// The default strengths, with the light in this direction (unit vector).
    pub fn new(to_light: Vec3, rim: f32) -> Self {
        Self { to_light: to_light.to_array(), strength: [AMBIENT, DIFFUSE, SPECULAR], fill: FILL, rim }
    }

    /// The unit vector halfway between the directions to the light and to the viewer, for a ray with this unit
    /// direction; see [`Lighting::shade`].
    pub fn half(&self, direction: [f32; 3]) -> [f32; 3] {
        let h = [0, 1, 2].map(|c| self.to_light[c] - direction[c]);
        let square = dot(h, h).max(1e-12);
        let r = inverse_sqrt(square);
        h.map(|v| v * r)
    }

    /// The effect of light on a sample of a ray with this unit direction and its `half`.
    ///
    /// `n` is the interpolated normal, of length up to 1. With m = min(|n|, 1), f = min(|n·direction|/|n|, 1), c =
    /// max(|n·light|/|n|, fill·f), h = min(|n·half|/|n|, 1) and g = 1 − f (both sides of a surface look alike): factor =
    /// 1 + m·((ambient + diffuse·c) − 1), added = m·(specular·h^32), rim = m·(g⁴·rim).
    pub fn shade(&self, n: [f32; 3], direction: [f32; 3], half: [f32; 3]) -> Shade {
        let square = dot(n, n);
        if square < 1e-8 {
            return Shade { factor: 1.0, added: 0.0, rim: 0.0 };
        }
        let r = inverse_sqrt(square);
        let m = (square * r).min(1.0);
        let facing = (dot(n, direction).abs() * r).min(1.0);
        let c = (dot(n, self.to_light).abs() * r).max(self.fill * facing);
        let g = 1.0 - facing;
        let mut h = (dot(n, half).abs() * r).min(1.0);
        for _ in 0..5 {
            h *= h;
        }
        let [ambient, diffuse, specular] = self.strength;
        Shade { factor: 1.0 + m * ((ambient + diffuse * c) - 1.0), added: m * (specular * h), rim: m * ((g * g) * (g * g) * self.rim) }
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

/// A normal per vertex of the mesh, for shading. A field with values per tetrahedron has no gradient, so only the
/// surface is lit.
pub fn shading_normals(mesh: &Mesh, valid: &ValidTets<'_>, field: &Field, range: [f32; 2]) -> Vec<[f32; 3]> {
    let span = f64::from(range[1]) - f64::from(range[0]);
    let steep = if span > 0.0 { STEEP / span } else { 0.0 };
    normals(mesh, valid, |tet, i| valid.is_outside(tet, i), field, steep)
}

/// A normal of length 1 per vertex, for iso-surfaces: the gradient of the field, also on the surface of the mesh; 0
/// where there is none.
pub fn gradient_normals(mesh: &Mesh, valid: &ValidTets<'_>, field: &Field) -> Vec<[f32; 3]> {
    normals(mesh, valid, |_, _| false, field, f64::INFINITY)
}

/// Normals of the surface (the faces that `is_outside`); elsewhere the gradient (change of value per diagonal) times
/// `steep`, at most 1 long, or of length 1 if `steep` is infinite.
fn normals(mesh: &Mesh, valid: &ValidTets<'_>, is_outside: impl Fn(usize, usize) -> bool, field: &Field, steep: f64) -> Vec<[f32; 3]> {
    let length = valid.bounds.diagonal();
    let has_gradient = steep > 0.0 && field.on == On::Points && field.values.len() == mesh.points.len();
    // For each vertex: normal times area, volume of the tetrahedra below, area.
    let mut surface = vec![(DVec3::ZERO, 0.0, 0.0); mesh.points.len()];
    let mut inside = vec![(DVec3::ZERO, 0.0); mesh.points.len()];
    for (tet, ids) in valid.of(mesh) {
        // Lengths are in diagonals, so that no product overflows for meshes of any size.
        let p = ids.map(|id| DVec3::from_array(mesh.points[id].map(f64::from)) / length);
        let volume = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]);
        for i in 0..4 {
            let face = [(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)][i];
            let normal = (p[face.1] - p[face.0]).cross(p[face.2] - p[face.0]) * volume.signum();
            if is_outside(tet, i) {
                for k in [face.0, face.1, face.2] {
                    let (sum, below, area) = &mut surface[ids[k]];
                    *sum += normal;
                    *below += volume.abs();
                    *area += normal.length();
                }
            }
        }
        if has_gradient && volume != 0.0 {
            let v = ids.map(|id| f64::from(field.values[id]));
            if v.iter().all(|v| v.is_finite()) {
                let (a, b, c) = (p[1] - p[0], p[2] - p[0], p[3] - p[0]);
                // The gradient times the volume, so that the mean over the tetrahedra around a vertex is weighted by
                // volume.
                let gradient = (b.cross(c) * (v[1] - v[0]) + c.cross(a) * (v[2] - v[0]) + a.cross(b) * (v[3] - v[0])) * volume.signum();
                for id in ids {
                    inside[id].0 += gradient;
                    inside[id].1 += volume.abs();
                }
            }
        }
    }
    let normal = |((sum, below, area), (gradient, volume)): ((DVec3, f64, f64), (DVec3, f64))| {
        // Six times the volume over twice the area is the height of the tetrahedra.
        let skin = |n: DVec3| n * if below > SKIN * area { SKIN * area / below } else { 1.0 };
        let gradient = || match volume {
            0.0 => DVec3::ZERO,
            _ if steep.is_infinite() => (gradient / volume).normalize_or_zero(),
            _ => (gradient / volume * steep).clamp_length_max(1.0),
        };
        let n = sum.try_normalize().map_or_else(gradient, skin);
        n.as_vec3().to_array()
    };
    surface.into_iter().zip(inside).map(normal).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Bounds, kuhn};

    #[test]
    fn normals_of_a_corner_tetrahedron_point_outwards() {
        let mut mesh = Mesh::new(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], vec![[0, 1, 2, 3]]);
        mesh.fields.push(Field { name: "x".into(), on: On::Points, values: vec![0.0, 1.0, 0.0, 0.0] });
        let bounds = Bounds { lo: [0.0; 3], hi: [1.0; 3] };
        let valid = ValidTets { bounds, neighbours: &[[u32::MAX; 4]], is_valid: &|_| true };
        for ids in [[0, 1, 2, 3], [1, 0, 2, 3]] {
            mesh.tets = vec![ids];
            let normals = shading_normals(&mesh, &valid, &mesh.fields[0], [0.0, 1.0]);
            let s = normals[0][0];
            assert!(s < 0.0 && normals[0].iter().all(|v| (v - s).abs() < 1e-5), "{normals:?}");
            assert!(normals[1][0] > 0.0 && normals[2][1] > 0.0 && normals[3][2] > 0.0);
        }
    }

    #[test]
    fn gradients_inside_do_not_depend_on_scale() {
        for scale in [1.0, 1e-25, 1e30] {
            let mut mesh = kuhn([2, 2, 2]).unwrap();
            mesh.points.iter_mut().for_each(|p| *p = p.map(|v| v * scale));
            mesh.fields[0].values = mesh.points.iter().map(|p| p[1] / scale).collect();
            let bounds = Bounds { lo: [0.0; 3], hi: [2.0 * scale; 3] };
            // Without a surface every vertex has the gradient.
            let valid = ValidTets { bounds, neighbours: &vec![[0; 4]; mesh.tets.len()], is_valid: &|_| true };
            let normals = shading_normals(&mesh, &valid, &mesh.fields[0], [0.0, 2.0]);
            let expected = STEEP as f32 * 12f32.sqrt() / 2.0;
            assert!(normals.iter().all(|n| (n[1] - expected).abs() < 1e-4 && n[0].abs() < 1e-5), "{scale}: {:?} {expected}", normals[13]);
        }
    }

    #[test]
    fn light_on_a_facing_normal_is_brighter_than_on_a_grazing_one() {
        let light = Lighting::new(Vec3::Z, 0.25);
        let down = [0.0, 0.0, -1.0];
        let half = light.half(down);
        let facing = light.shade([0.0, 0.0, -1.0], down, half);
        let grazing = light.shade([1.0, 0.0, 0.0], down, half);
        let near = |a: f32, b: f32| (a - b).abs() < 1e-5;
        assert!(near(facing.factor, AMBIENT + DIFFUSE) && near(facing.added, SPECULAR) && near(facing.rim, 0.0), "{facing:?}");
        assert!(near(grazing.factor, AMBIENT) && grazing.added == 0.0 && near(grazing.rim, 0.25), "{grazing:?}");
        let from_the_side = Lighting::new(Vec3::X, 0.25);
        let seen = from_the_side.shade([0.0, 0.0, -1.0], down, from_the_side.half(down));
        assert!(near(seen.factor, AMBIENT + DIFFUSE * FILL), "what faces the viewer is never dark: {seen:?}");
        assert_eq!(light.shade([0.0; 3], down, half), Shade { factor: 1.0, added: 0.0, rim: 0.0 });
    }
}
