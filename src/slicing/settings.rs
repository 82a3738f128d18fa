//! Converts what a user asks for (plane, place, layers, size, thickness) to a [`VoxelGrid`].

use super::{MOST_PER_AXIS, VoxelGrid};
use crate::error::{Error, Result};
use glam::DVec3;

/// The plane of the layers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Plane {
    /// Perpendicular to an axis: 0 is x, 1 is y, 2 is z. Rows run along the first of the other two axes, and the second
    /// leads from row to row: (y, z), (x, z) or (x, y).
    Axis(usize),
    /// Perpendicular to a direction of any length.
    Normal([f64; 3]),
}

/// A stack of layers as a user describes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SliceSettings {
    /// The plane of the layers.
    pub plane: Plane,
    /// Place of the first layer's centre along the (unit) normal, in the coordinates of the source. `None`: the layers
    /// fill the mesh.
    pub at: Option<f64>,
    /// Number of layers, upwards along the normal.
    pub layers: u32,
    /// Voxels per row, and rows; 0: as many as make the voxels square.
    pub size: [u32; 2],
    /// Size of a voxel along the normal. `None`: the absolute value of `spacing`. If that is 0 or not given, the size
    /// of a voxel in the plane for one layer or with `at`, else the layers' share of the mesh.
    pub thickness: Option<f64>,
    /// Distance of two layers, negative for layers that go downwards; `None`: their thickness.
    pub spacing: Option<f64>,
}

impl Default for SliceSettings {
    fn default() -> Self {
        Self { plane: Plane::Axis(2), at: None, layers: 1, size: [512, 0], thickness: None, spacing: None }
    }
}

/// Two unit vectors that form a right-handed system with the unit normal `n`. The first is perpendicular to the
/// coordinate axis with the smallest component of `n`.
fn in_plane(n: DVec3) -> (DVec3, DVec3) {
    let a = n.abs();
    let least = if a.x <= a.y && a.x <= a.z {
        DVec3::X
    } else if a.y <= a.z {
        DVec3::Y
    } else {
        DVec3::Z
    };
    let u = least.cross(n).normalize_or_zero();
    (u, n.cross(u))
}

impl SliceSettings {
    /// The voxels over a mesh with the bounds `[lo, hi]` relative to `origin`. They cover the bounds as seen along the
    /// normal.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a normal of no length, sizes of 0 or beyond 2^24, a thickness that is not above 0, or a
    /// mesh without extent.
    pub fn voxels(&self, lo: [f32; 3], hi: [f32; 3], origin: [f64; 3]) -> Result<VoxelGrid> {
        let invalid = |text: &str| Err(Error::Invalid(text.into()));
        let (n, u, v) = match self.plane {
            Plane::Axis(0) => (DVec3::X, DVec3::Y, DVec3::Z),
            Plane::Axis(1) => (DVec3::Y, DVec3::X, DVec3::Z),
            Plane::Axis(2) => (DVec3::Z, DVec3::X, DVec3::Y),
            Plane::Axis(_) => return invalid("an axis is x, y or z"),
            Plane::Normal(n) => {
                let n = DVec3::from_array(n);
                // Its square may be too large, or too small.
                let n = n / n.abs().max_element();
                let Some(n) = n.try_normalize() else { return invalid("the normal of a slice has no length") };
                let (u, v) = in_plane(n);
                (n, u, v)
            }
        };
        let corners = (0..8).map(|i| {
            let pick = |c: usize| f64::from(if i >> c & 1 == 0 { lo[c] } else { hi[c] });
            DVec3::new(pick(0), pick(1), pick(2))
        });
        let corners: Vec<DVec3> = corners.collect();
        let span = |d: DVec3| {
            let along = corners.iter().map(|p| p.dot(d));
            (along.clone().fold(f64::INFINITY, f64::min), along.fold(f64::NEG_INFINITY, f64::max))
        };
        let [(u0, u1), (v0, v1), (n0, n1)] = [u, v, n].map(span);
        let (wide, high) = (u1 - u0, v1 - v0);
        let largest = wide.max(high).max(n1 - n0);
        if !largest.is_finite() || largest <= 0.0 {
            return invalid("the mesh has no extent; there is nothing to slice");
        }
        // A side without extent gets voxels, too.
        let (wide, high) = (wide.max(largest * 1e-6), high.max(largest * 1e-6));
        let [w, h] = match self.size {
            [0, 0] => return invalid("a layer needs at least one voxel"),
            [w, 0] => [u64::from(w), (f64::from(w) * high / wide).ceil() as u64],
            [0, h] => [(f64::from(h) * wide / high).ceil() as u64, u64::from(h)],
            size => size.map(u64::from),
        };
        if self.layers == 0 || w.max(h).max(self.layers.into()) > u64::from(MOST_PER_AXIS) {
            return Err(Error::Invalid(format!("{w}×{h} voxels in {} layers; 1 to {MOST_PER_AXIS} along each axis", self.layers)));
        }
        let [w, h] = [w, h].map(|n| n as u32);
        let (du, dv) = if self.size.contains(&0) {
            let side = if self.size[1] == 0 { wide / f64::from(w) } else { high / f64::from(h) };
            (side, side)
        } else {
            (wide / f64::from(w), high / f64::from(h))
        };
        let deep = (n1 - n0).max(largest * 1e-6);
        let share = deep / f64::from(self.layers);
        let spaced = self.spacing.map(f64::abs).filter(|&s| s > 0.0);
        let thickness = self.thickness.or(spaced).unwrap_or(if self.layers > 1 && self.at.is_none() { share } else { du.max(dv) });
        let spacing = self.spacing.unwrap_or(thickness);
        if !(thickness > 0.0 && thickness.is_finite() && spacing.is_finite()) {
            return invalid("the thickness of a layer must be above 0");
        }
        let middle = f64::midpoint(n0, n1);
        let at = match self.at {
            Some(at) if at.is_finite() => at - DVec3::from_array(origin).dot(n),
            Some(_) => return invalid("the place of a slice must be a number"),
            None => middle - spacing * (f64::from(self.layers) - 1.0) * 0.5,
        };
        // Square voxels may extend beyond the mesh, so they are centred.
        let first = |lo: f64, hi: f64, d: f64, count: u32| f64::midpoint(lo, hi) - d * (f64::from(count) - 1.0) * 0.5;
        let corner = u * first(u0, u1, du, w) + v * first(v0, v1, dv, h) + n * at;
        let single = |d: DVec3| d.as_vec3().to_array();
        Ok(VoxelGrid {
            origin: single(corner),
            next_voxel: single(u * du),
            next_row: single(v * dv),
            next_layer: single(n * spacing),
            half: [single(u * (0.5 * du)), single(v * (0.5 * dv)), single(n * (0.5 * thickness))],
            size: [w, h],
            layers: self.layers,
        })
    }

    /// These settings with voxels that are cubes, as packages for printers require: the thickness and distance of
    /// layers equal the width of a voxel. With `fill`, there are as many layers as fill the mesh. For layers across
    /// axis y, rows run along z, so that the package is not a mirror image of the mesh.
    ///
    /// # Errors
    /// As [`SliceSettings::voxels`]; and [`Error::Invalid`] for settings whose voxels would not be cubes.
    pub fn cubes(&self, lo: [f32; 3], hi: [f32; 3], origin: [f64; 3], fill: bool) -> Result<Self> {
        let plane = if self.plane == Plane::Axis(1) { Plane::Normal([0.0, 1.0, 0.0]) } else { self.plane };
        let mut cubes = Self { size: [self.size[0], 0], plane, ..*self };
        let flat = cubes.voxels(lo, hi, origin)?;
        let length = |v: [f32; 3]| v.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>().sqrt();
        let side = length(flat.next_voxel);
        let differs = |given: Option<f64>| given.is_some_and(|t| (t - side).abs() > 1e-3 * side);
        if differs(self.thickness) || differs(self.spacing) || self.size[1] != 0 {
            let text = format!("voxels of this package are cubes, here of {side}; leave thickness, spacing and the height out");
            return Err(Error::Invalid(text));
        }
        (cubes.thickness, cubes.spacing) = (Some(side), Some(side));
        if fill {
            let unit = DVec3::from_array(flat.half[2].map(f64::from)).normalize_or_zero().abs();
            let deep = (0..3).map(|c| (f64::from(hi[c]) - f64::from(lo[c])) * unit[c]).sum::<f64>();
            cubes.layers = (deep / side - 1e-6).ceil().max(1.0) as u32;
        }
        Ok(cubes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOX: ([f32; 3], [f32; 3], [f64; 3]) = ([0.0; 3], [4.0, 2.0, 8.0], [0.0; 3]);

    fn voxels(settings: SliceSettings) -> Result<VoxelGrid> {
        settings.voxels(BOX.0, BOX.1, BOX.2)
    }

    /// A package does not store directions, so a left-handed one would be the mirror image of the mesh.
    #[test]
    fn packages_are_no_mirror_images() {
        let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
        for plane in [Plane::Axis(0), Plane::Axis(1), Plane::Axis(2), Plane::Normal([1.0, -2.0, 0.5]), Plane::Normal([0.0, -1.0, 0.0])] {
            let cubes = SliceSettings { plane, size: [16, 0], ..SliceSettings::default() }.cubes(BOX.0, BOX.1, BOX.2, true).unwrap();
            let grid = voxels(cubes).unwrap();
            let [x, y, z] = [grid.next_voxel, grid.next_row, grid.next_layer].map(wide);
            assert!(x.cross(y).dot(z) > 0.99 * x.length().powi(3), "{plane:?}");
        }
    }

    #[test]
    fn layers_may_go_downwards() {
        let settings = SliceSettings { layers: 3, at: Some(1.0), spacing: Some(-0.5), ..SliceSettings::default() };
        let grid = voxels(settings).unwrap();
        assert_eq!((grid.next_layer, grid.half[2]), ([0.0, 0.0, -0.5], [0.0, 0.0, 0.25]));
        // Layers at the same place, each as thick as a voxel is wide.
        let grid = voxels(SliceSettings { spacing: Some(0.0), size: [8, 0], ..settings }).unwrap();
        assert_eq!((grid.next_layer[2], grid.half[2]), (0.0, [0.0, 0.0, 0.25]));
    }

    /// A layer that would be cropped at the most voxels along an axis is refused instead.
    #[test]
    fn layers_cover_the_mesh_or_are_refused() {
        let settings = |size| SliceSettings { size, ..SliceSettings::default() };
        let of = |size, hi| settings(size).voxels([0.0; 3], hi, [0.0; 3]);
        assert_eq!(of([16_384, 0], [1.0, 1024.0, 1.0]).unwrap().size, [16_384, MOST_PER_AXIS]);
        assert_eq!(of([0, 16_384], [1024.0, 1.0, 1.0]).unwrap().size, [MOST_PER_AXIS, 16_384]);
        for (size, hi) in [([16_385, 0], [1.0, 1024.0, 1.0]), ([0, 16_385], [1024.0, 1.0, 1.0]), ([1 << 24, 0], [1.0, 1e6, 1.0])] {
            let error = of(size, hi).unwrap_err().to_string();
            assert!(error.contains("1 to 16777216 along each axis"), "{error}");
        }
        let filled = |width, hi| settings([width, 0]).cubes([0.0; 3], hi, [0.0; 3], true)?.voxels([0.0; 3], hi, [0.0; 3]);
        assert_eq!(filled(16_384, [1.0, 1.0, 1024.0]).unwrap().layers, MOST_PER_AXIS);
        assert!(filled(16_385, [1.0, 1.0, 1024.0]).is_err());
    }
}
