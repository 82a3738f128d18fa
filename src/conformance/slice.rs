//! Cases that compare conservative slicing with the reference implementation (SPEC 3.4): kinds and owners to the bit.

use super::failure::{Stop, Verdict, compare_one, fail};
use super::meshes::MeshRecipe;
use super::twin::Twin;
use crate::build::{DeviceMesh, Tree};
use crate::error::Error;
use crate::gpu::Gpu;
use crate::mesh::{Bounds, Field, Mesh, On};
use crate::options::{Assign, BuildOptions, Lists};
use crate::query::{SILENT, slice};
use crate::reference::slice::Slicer;
use crate::slicing::{Band, Extrapolate, Plane, SliceSettings};

/// A small stack of layers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SliceCase {
    pub mesh: MeshRecipe,
    pub alpha: f32,
    pub assign: Assign,
    pub lists: Lists,
    pub stack: Stack,
}

/// Plane, layers, voxels, and the field that is interpolated in them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stack {
    pub name: &'static str,
    plane: Plane,
    layers: u32,
    size: [u32; 2],
    field: Option<On>,
    extrapolate: Extrapolate,
}

/// The stacks of the suite: every plane, field and extrapolation; voxels from fine ones to ones larger than tetrahedra.
pub(crate) const STACKS: [Stack; 4] = [
    Stack { name: "x", plane: Plane::Axis(0), layers: 1, size: [37, 21], field: None, extrapolate: Extrapolate::Nearest },
    Stack { name: "y", plane: Plane::Axis(1), layers: 4, size: [9, 7], field: Some(On::Points), extrapolate: Extrapolate::Nearest },
    Stack {
        name: "oblique",
        plane: Plane::Normal([1.0, -2.0, 0.7]),
        layers: 3,
        size: [37, 21],
        field: Some(On::Points),
        extrapolate: Extrapolate::Linear,
    },
    Stack { name: "z", plane: Plane::Axis(2), layers: 2, size: [3, 2], field: Some(On::Cells), extrapolate: Extrapolate::Nearest },
];

/// A ramp over the points, or the ids of the tetrahedra.
fn field(mesh: &Mesh, on: On) -> Field {
    let values = match on {
        On::Points => mesh.points.iter().map(|p| p[0] + 0.5 * p[1]).collect(),
        On::Cells => (0..mesh.tets.len()).map(|t| t as f32).collect(),
    };
    Field { name: "ramp".into(), on, values }
}

pub(crate) fn check(gpu: &Gpu, case: &SliceCase, twin: &mut Twin, device: &DeviceMesh) -> Verdict {
    let Stack { plane, layers, size, extrapolate, .. } = case.stack;
    let options = BuildOptions { alpha: case.alpha, assign: case.assign, lists: case.lists, slabs: true, ..BuildOptions::default() };
    let tree = Tree::build(gpu, device, &options)?;
    let built = twin.tree(&options)?;
    let (mesh, host) = (&twin.mesh, built.tree());
    let Bounds { lo, hi } = (&host.grid).into();
    let settings = SliceSettings { plane, layers, size, ..SliceSettings::default() };
    let Ok(voxels) = settings.voxels(lo, hi, mesh.origin) else {
        return compare_one("query.slice", "extent, if there is nothing to slice", &lo, &hi);
    };
    if voxels.check_over(&host.grid).is_err() {
        // The coordinates reach the limits of single precision: the device must refuse these voxels, too.
        let refused = slice(&tree, None, &voxels, extrapolate, SILENT, &mut |_| Ok(()));
        return compare_one("query.slice", "refusal", &true, &matches!(refused, Err(Error::Invalid(_))));
    }
    let field = case.stack.field.map(|on| field(mesh, on));
    let slicer = Slicer::new(mesh, &twin.topology, host, field.as_ref(), voxels, extrapolate)?;
    let mut verdict = Ok(());
    let mut hold = |found: Band| {
        if verdict.is_ok() {
            verdict = compare_bands(&slicer.band(found.rows), &found);
        }
        Ok(())
    };
    let values = field.as_ref().map(|f| (&f.values[..], f.on));
    let sliced = slice(&tree, values, &voxels, extrapolate, SILENT, &mut hold)?;
    verdict?;
    let tally = sliced.tally;
    compare_one("query.slice", "voxels", &voxels.voxels(), &(tally.inside + tally.touched + tally.empty))
}

fn compare_bands(expected: &Band, found: &Band) -> Result<(), Stop> {
    let decided = |band: &Band, i: usize| Some((*band.kinds.get(i)?, *band.owners.get(i)?));
    for i in 0..expected.kinds.len() {
        let what =
            || format!("voxels of rows {} to {} of layer {}", found.rows.first, found.rows.first + found.rows.count, found.rows.layer);
        let (a, b) = (decided(expected, i), decided(found, i));
        if a != b {
            return Err(fail("query.slice_touch", &format!("kind and owner, {}", what()), Some(i), &format!("{a:?}"), &format!("{b:?}")));
        }
        // Devices may flush denormal products of a value to 0; nothing else may differ.
        let (a, b) = (expected.values[i], found.values.get(i).copied().unwrap_or_default());
        if !(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-36) {
            return Err(fail("query.slice_values", &format!("value, {}", what()), Some(i), &a.to_string(), &b.to_string()));
        }
    }
    Ok(())
}
