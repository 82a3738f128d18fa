//! Location of points, all their owners, and values there.

use super::scene::OlbvhScene;
use super::{OlbvhBuffer, OlbvhField, OlbvhRecording, recorded};
use crate::capi::{OlbvhStatus, border, handle, put, tolerance};
use crate::error::{Error, Result};
use crate::query::{
    LocateOptions, LocateOutput, OwnersMemory, Path, PointInput, PointOrder, cmd_count_owners, cmd_interpolate, cmd_list_owners,
    cmd_locate, cmd_sort_points,
};

/// Points to locate, and where the answers go.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhLocation {
    /// 32-bit floats, three of each point.
    pub points: OlbvhBuffer,
    /// Floats from one point to the next, at least 3.
    pub stride: u32,
    /// Points.
    pub count: u32,
    /// As `olbvh_locate` takes it.
    pub tolerance: f32,
    /// 0: each point by itself. 1: each around the owner of the one before, for more points than half the tetrahedra, of which each lies near the one
    /// before. 2: so too, for points in no order, which are sorted first.
    pub path: u32,
    /// For path 0, if not of no bytes: a word per point, a valid tetrahedron to begin with, such as the owner of the frame before, or 0xffffffff.
    pub hints: OlbvhBuffer,
    /// For path 2: memory to sort in, of `olbvh_location_parts`.
    pub memory: OlbvhBuffer,
    /// A word per point: its owner, or 0xffffffff.
    pub owners: OlbvhBuffer,
    /// Four floats per point, in the order of the cell's vertices; zeroes without an owner.
    pub barycentrics: OlbvhBuffer,
}

/// What memory location takes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhLocationParts {
    /// Bytes of `olbvh_location.memory`: 0 but for path 2.
    pub bytes: u64,
}

/// Memory of all owners of points, and where in it the answers are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhOwnerParts {
    /// Bytes of the memory.
    pub bytes: u64,
    /// A word per point: the lowest of its owners, as location gives it.
    pub owners: OlbvhBuffer,
    /// Four floats per point: coordinates in that one.
    pub barycentrics: OlbvhBuffer,
    /// A word per point: where its owners end in the list; they begin where those of the point before end, the first at 0.
    pub ends: OlbvhBuffer,
    /// A word: how many owners all points have together, whether or not there was room for them.
    pub total: OlbvhBuffer,
}

impl OlbvhLocation {
    fn options(&self) -> Result<LocateOptions> {
        let path = match self.path {
            0 => Path::Descent,
            1 => Path::Runs,
            2 => Path::Sorted,
            other => return Err(Error::Invalid(format!("path {other} is not known"))),
        };
        Ok(LocateOptions { tolerance: tolerance(self.tolerance), path })
    }

    fn input(&self) -> Result<PointInput> {
        let n = u64::from(self.count);
        let points = self.points.holds(if n == 0 { 0 } else { 4 * (u64::from(self.stride) * (n - 1) + 3) }, "points")?;
        Ok(PointInput { points, stride: self.stride, count: self.count, hints: self.hints.optional(4 * n, "hints")?, order: None })
    }

    fn output(&self) -> Result<LocateOutput> {
        let n = u64::from(self.count);
        Ok(LocateOutput { owners: self.owners.holds(4 * n, "owners")?, barycentrics: self.barycentrics.holds(16 * n, "barycentrics")? })
    }
}

/// Tells what memory the location takes besides the answers.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_location_parts(
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
    out: *mut OlbvhLocationParts,
) -> OlbvhStatus {
    border(|| {
        let (scene, location) = (handle(scene, "scene")?, handle(location, "location")?);
        let sorted = location.options()?.path == Path::Sorted;
        let bytes = if sorted { location.memory.carve(|a| PointOrder::carve(&scene.gpu, a, location.count))?.0 } else { 0 };
        put(out, OlbvhLocationParts { bytes })
    })
}

/// Records the location of points.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_locate(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
) -> OlbvhStatus {
    recorded(recording, |r| {
        let (OlbvhScene { gpu, scene, .. }, location) = (handle(scene, "scene")?, handle(location, "location")?);
        let (options, mut input) = (location.options()?, location.input()?);
        if options.path == Path::Sorted {
            let order = location.memory.place(|a| PointOrder::carve(gpu, a, location.count))?;
            cmd_sort_points(r, scene.tree.grid, &input, &order)?;
            r.barrier("sort_points → locate");
            input.order = Some(order.order);
        }
        cmd_locate(r, scene, &input, &location.output()?, &options)
    })
}

/// Tells what memory all owners of the points take, and where in `memory` (of no bytes, as long as there is none) the answers are.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_owner_parts(
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
    memory: OlbvhBuffer,
    out: *mut OlbvhOwnerParts,
) -> OlbvhStatus {
    border(|| {
        let (scene, location) = (handle(scene, "scene")?, handle(location, "location")?);
        let (bytes, parts) = memory.carve(|a| OwnersMemory::carve(&scene.gpu, a, location.count))?;
        let OwnersMemory { located, ends, total, .. } = parts;
        let (owners, barycentrics) = (located.owners.into(), located.barycentrics.into());
        put(out, OlbvhOwnerParts { bytes, owners, barycentrics, ends: ends.into(), total: total.into() })
    })
}

/// Records all owners of points: the tetrahedra that contain each, ascending, point by point, a word each in `found`. As many are written as that
/// holds; `ends` and `total` of `olbvh_owner_parts` are right in any case. Of the location, points, stride, count and tolerance are read.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_owners(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
    memory: OlbvhBuffer,
    found: OlbvhBuffer,
) -> OlbvhStatus {
    recorded(recording, |r| {
        let (OlbvhScene { gpu, scene, .. }, location) = (handle(scene, "scene")?, handle(location, "location")?);
        let input = PointInput { hints: None, ..location.input()? };
        let memory = memory.place(|a| OwnersMemory::carve(gpu, a, location.count))?;
        let options = LocateOptions { tolerance: tolerance(location.tolerance), ..LocateOptions::default() };
        cmd_count_owners(r, scene, &input, &memory, &options)?;
        cmd_list_owners(r, scene, &input, &memory, found.part())
    })
}

/// Records the values of a field at points that have been located: a float each in `values`, NaN without an owner. Of the location, count, owners and
/// barycentrics are read, by compute shaders.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_interpolate(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
    field: *const OlbvhField,
    values: OlbvhBuffer,
) -> OlbvhStatus {
    recorded(recording, |r| {
        let (scene, location) = (&handle(scene, "scene")?.scene, handle(location, "location")?);
        let (field, on) = handle(field, "field")?.read(scene)?;
        let values = values.holds(4 * u64::from(location.count), "values")?;
        cmd_interpolate(r, scene, field, on, &location.output()?, values, location.count)
    })
}
