//! Where the voxels of `olbvh slice` lie, in the coordinates of the mesh file.

use crate::text::{joined, number, told_apart};
use olbvh::mesh::{Bounds, Mesh};
use olbvh::slicing::VoxelGrid;

/// Placement of a stack of voxels.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Number of voxels per row, rows per layer, and layers.
    pub size: [u32; 3],
    /// Centre of the first voxel of the first row of the first layer.
    pub origin: [f64; 3],
    /// Distance from voxel to voxel, row to row and layer to layer; the last is negative for layers that go downwards.
    pub spacing: [f64; 3],
    /// Unit vectors along rows, from row to row, and perpendicular to the layers.
    pub axes: [[f64; 3]; 3],
    /// Height of a voxel perpendicular to the layers.
    pub thickness: f64,
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| a[c] * b[c]).sum()
}

impl Placement {
    /// The placement of the voxels over a mesh.
    pub fn new(voxels: &VoxelGrid, mesh: &Mesh) -> Self {
        let wide = |v: [f32; 3]| v.map(f64::from);
        let length = |v: [f64; 3]| dot(v, v).sqrt();
        let halves = voxels.half.map(wide);
        // The direction of the layers is that of the half axis, since the distance between layers may be 0.
        let axes = halves.map(|v| v.map(|x| x / length(v)));
        let [next_voxel, next_row, next_layer] = [voxels.next_voxel, voxels.next_row, voxels.next_layer].map(wide);
        let [width, height] = voxels.size;
        Self {
            size: [width, height, voxels.layers],
            origin: [0, 1, 2].map(|c| mesh.origin[c] + f64::from(voxels.origin[c])),
            spacing: [length(next_voxel), length(next_row), length(next_layer).copysign(dot(next_layer, axes[2]))],
            axes,
            thickness: 2.0 * length(halves[2]),
        }
    }

    /// Lower and upper end of the layers along their axis.
    fn layers_span(&self) -> [f64; 2] {
        let first = dot(self.origin, self.axes[2]);
        let last = first + self.spacing[2] * (f64::from(self.size[2]) - 1.0);
        let half = 0.5 * self.thickness;
        [first.min(last) - half, first.max(last) + half]
    }

    /// Lower and upper end of a mesh along the axis of the layers.
    fn mesh_span(&self, bounds: &Bounds, mesh: &Mesh) -> [f64; 2] {
        let ends = [0, 1, 2].map(|c| [bounds.lo[c], bounds.hi[c]].map(|x| (mesh.origin[c] + f64::from(x)) * self.axes[2][c]));
        let sum = |pick: fn(f64, f64) -> f64| ends.iter().map(|&[a, b]| pick(a, b)).sum::<f64>();
        [sum(f64::min), sum(f64::max)]
    }

    /// A remark on voxels that are all empty: where the mesh and the layers lie along this axis, or along the normal if
    /// there is none.
    pub fn remark_on_emptiness(&self, axis: Option<&str>, bounds: &Bounds, mesh: &Mesh) -> String {
        let along = axis.map_or_else(|| format!("({})", joined(&self.axes[2].map(number), ", ")), str::to_owned);
        let ([mesh_lo, mesh_hi], [lo, hi]) = (self.mesh_span(bounds, mesh), self.layers_span());
        let [mesh_lo, mesh_hi, lo, hi] = told_apart([mesh_lo, mesh_hi, lo, hi]);
        format!("all voxels are empty: along {along} the mesh lies from {mesh_lo} to {mesh_hi}, the layers from {lo} to {hi}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use olbvh::slicing::{Plane, SliceSettings};

    /// Far from the origin, the placement is that of the file, not of the mesh's own coordinates.
    #[test]
    fn placements_are_in_coordinates_of_the_file() {
        let mut mesh = olbvh::mesh::kuhn([4, 3, 2]).unwrap_or_default();
        mesh.origin = [5e6, -3.0, 7.0];
        let bounds = Bounds { lo: [0.0; 3], hi: [4.0, 3.0, 2.0] };
        let settings = SliceSettings { plane: Plane::Axis(0), at: Some(10.0), layers: 3, size: [6, 4], ..SliceSettings::default() };
        let settings = SliceSettings { thickness: Some(0.5), spacing: Some(-2.0), ..settings };
        let placed = settings.voxels(bounds.lo, bounds.hi, mesh.origin).map(|voxels| Placement::new(&voxels, &mesh));
        let Ok(Placement { size, origin, spacing, axes, thickness }) = placed else { panic!("{placed:?}") };
        assert_eq!(size, [6, 4, 3]);
        assert_eq!(origin, [10.0, -2.75, 7.25]);
        assert_eq!((spacing, thickness), ([0.5, 0.5, -2.0], 0.5));
        assert_eq!(axes, [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]);
        let remark = placed.map(|placed| placed.remark_on_emptiness(Some("x"), &bounds, &mesh)).unwrap_or_default();
        assert_eq!(remark, "all voxels are empty: along x the mesh lies from 5000000 to 5000004, the layers from 5.75 to 10.25");
    }
}
