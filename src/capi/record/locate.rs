//! The C interface to point location, to all owners of points, and to values at points.

use super::scene::{OlbvhScene, begun_with};
use super::{OlbvhBuffer, OlbvhField, OlbvhRecording, OlbvhRounds};
use crate::capi::{OlbvhStatus, border, handle, place, tolerance};
use crate::error::{Error, Result};
use crate::gpu::Recorder;
use crate::query::{
    LocateMethod, LocateOptions, LocateOutput, NearestMemory, OwnersMemory, PointInput, PointOrder, Rounds, cmd_count_owners,
    cmd_interpolate, cmd_list_owners, cmd_locate, cmd_nearest, cmd_sort_points,
};

/// Points to locate, and where the results go.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhLocation {
    /// Points, three 32-bit floats each.
    pub points: OlbvhBuffer,
    /// Distance from one point to the next in floats, at least 3.
    pub stride: u32,
    /// Number of points.
    pub count: u32,
    /// Tolerance, as for `olbvh_locate`.
    pub tolerance: f32,
    /// How points are located. 0: each one independently. 1: each one starting at the owner of the point before it, if
    /// each point lies near the one before; this pays on processors, from one point per four tetrahedra on. 2: like 0,
    /// for many points in no order, which are sorted first. 3: sorted first, then like 1, for processors.
    pub path: u32,
    /// For path 0, optional (size 0: none): a word per point, the tetrahedron where its search starts, for example its
    /// owner in the previous frame, or `UINT32_MAX`. It must be a valid tetrahedron of the mesh. The hints may be where
    /// the owners are: each is read before it is replaced.
    pub hints: OlbvhBuffer,
    /// For paths 2 and 3: scratch memory for the sort, of the size that `olbvh_location_parts` reports.
    pub memory: OlbvhBuffer,
    /// A word per point: its owner, or `UINT32_MAX` if there is none.
    pub owners: OlbvhBuffer,
    /// Four floats per point: barycentric coordinates in the order of the tetrahedron's vertices; zeroes if there is no
    /// owner.
    pub barycentrics: OlbvhBuffer,
}

/// Size of the scratch memory for point location.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhLocationParts {
    /// Size of `olbvh_location.memory` in bytes: 0 except for paths 2 and 3.
    pub bytes: u64,
}

/// Memory for all owners of points, and where in it the results are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhOwnerParts {
    /// Size of the memory in bytes.
    pub bytes: u64,
    /// A word per point: the one of its owners that `olbvh_cmd_locate` writes.
    pub owners: OlbvhBuffer,
    /// Four floats per point: barycentric coordinates in that owner.
    pub barycentrics: OlbvhBuffer,
    /// A word per point: where its owners end in the list. They start where those of the point before end; those of the
    /// first point start at 0.
    pub ends: OlbvhBuffer,
    /// A word: the total number of owners of all points, even if there was not room for all of them.
    pub total: OlbvhBuffer,
}

/// Memory for the closest places of the surface, and where in it the results are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhNearestParts {
    /// Size of the memory in bytes.
    pub bytes: u64,
    /// An `olbvh_near_state` per point.
    pub states: OlbvhBuffer,
    /// Four floats per point: barycentric coordinates of the place, in the order of the tetrahedron's vertices; zeroes if
    /// there is none.
    pub barycentrics: OlbvhBuffer,
    /// A word: the number of points that need another round.
    pub unfinished: OlbvhBuffer,
}

/// State of the search for the place of the surface that is closest to a point, which the device writes to
/// `olbvh_nearest_parts_data.states`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[allow(dead_code, reason = "the device writes it, and C programs read it")]
pub struct OlbvhNearState {
    /// Where the search goes on in another round; `UINT32_MAX`: it has ended.
    pub code: u32,
    /// How much of the leaf there is done.
    pub entry: u32,
    /// The tetrahedron with the closest place, or `UINT32_MAX`.
    pub owner: u32,
    /// Squared distance times (s · 2^19)², infinite without a place. s is the power of two that brings the largest extent
    /// of the mesh into [1, 2): `scale` of `olbvh_Grid` in olbvh.glsl, the first of `olbvh_scene_arrays_data.bindings`.
    pub square: f32,
}

impl OlbvhLocation {
    fn options(&self) -> Result<LocateOptions> {
        let method = match self.path {
            0 => LocateMethod::Descent,
            1 => LocateMethod::Runs,
            2 => LocateMethod::Sorted,
            3 => LocateMethod::SortedRuns,
            other => return Err(Error::Invalid(format!("path {other} is not known"))),
        };
        Ok(LocateOptions { tolerance: tolerance(self.tolerance), method })
    }

    fn input(&self) -> PointInput {
        PointInput { points: self.points.part(), stride: self.stride, count: self.count, hints: self.hints.given(), order: None }
    }

    /// The points in the order that paths which sort take them; records the sort and a barrier behind it, unless it has been
    /// done before (`resume`).
    fn in_order(&self, r: &mut Recorder<'_>, OlbvhScene { gpu, scene, .. }: &OlbvhScene, resume: bool) -> Result<PointInput> {
        let input = self.input();
        if !self.options()?.method.is_sorted() {
            return Ok(input);
        }
        let order = self.memory.place(|a| PointOrder::carve(gpu, a, self.count))?;
        if !resume {
            cmd_sort_points(r, scene.tree.grid, &input, &order)?;
            r.barrier("sort_points → points");
        }
        Ok(PointInput { order: Some(order.order), ..input })
    }

    fn output(&self) -> LocateOutput {
        LocateOutput { owners: self.owners.part(), barycentrics: self.barycentrics.part() }
    }
}

/// Reports how much scratch memory the location needs besides the results.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_location_parts(
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
    out: *mut OlbvhLocationParts,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (scene, location, out) = unsafe { (handle(scene, "scene")?, handle(location, "location")?, place(out)?) };
        let sorted = location.options()?.method.is_sorted();
        let bytes = if sorted { location.memory.carve(|a| PointOrder::carve(&scene.gpu, a, location.count))?.0 } else { 0 };
        out.write(OlbvhLocationParts { bytes });
        Ok(())
    })
}

/// Records the location of points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_locate(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, scene), location) = unsafe { (begun_with(recording, scene, "scene")?, handle(location, "location")?) };
        let input = location.in_order(r, scene, false)?;
        cmd_locate(r, &scene.scene, &input, &location.output(), &location.options()?)
    })
}

/// Reports how much memory all owners of the points need, and where in `memory` (size 0 if it does not exist yet) the
/// results are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_owner_parts(
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
    memory: OlbvhBuffer,
    out: *mut OlbvhOwnerParts,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (scene, location, out) = unsafe { (handle(scene, "scene")?, handle(location, "location")?, place(out)?) };
        let (bytes, parts) = memory.carve(|a| OwnersMemory::carve(&scene.gpu, a, location.count))?;
        let OwnersMemory { located, ends, total, .. } = parts;
        let (owners, barycentrics) = (located.owners.into(), located.barycentrics.into());
        out.write(OlbvhOwnerParts { bytes, owners, barycentrics, ends: ends.into(), total: total.into() });
        Ok(())
    })
}

/// Records the search for all owners of points, that is for all tetrahedra that contain each of them: a word each in
/// `found`, point by point, ascending for each point. Only as many as fit `found` are written; `ends` and `total` of
/// `olbvh_owner_parts` are correct in any case, modulo 2^32. Where tetrahedra overlap each other, only a tree with full
/// lists (`lists` of `olbvh_build_options` 0) finds all of them. Of `location`, only points, stride, count and tolerance
/// are used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_owners(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
    memory: OlbvhBuffer,
    found: OlbvhBuffer,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, OlbvhScene { gpu, scene, .. }), location) =
            unsafe { (begun_with(recording, scene, "scene")?, handle(location, "location")?) };
        let input = OlbvhLocation { hints: OlbvhBuffer::default(), ..*location }.input();
        let memory = memory.place(|a| OwnersMemory::carve(gpu, a, location.count))?;
        let options = LocateOptions { tolerance: tolerance(location.tolerance), ..LocateOptions::default() };
        cmd_count_owners(r, scene, &input, &memory, &options)?;
        cmd_list_owners(r, scene, &input, &memory, found.part())
    })
}

/// Reports how much memory the closest places of the surface need for `count` points, and where in `memory` (size 0 if it
/// does not exist yet) the results are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_nearest_parts(count: u32, memory: OlbvhBuffer, out: *mut OlbvhNearestParts) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let out = unsafe { place(out)? };
        let (bytes, parts) = memory.carve(|a| NearestMemory::carve(a, count))?;
        let NearestMemory { states, barycentrics, unfinished } = parts;
        out.write(OlbvhNearestParts { bytes, states: states.into(), barycentrics: barycentrics.into(), unfinished: unfinished.into() });
        Ok(())
    })
}

/// Records the search for the place of the surface that is closest to each point, as `olbvh_nearest` finds it. Of
/// `location`, only points, stride and count are used, and memory, if the path is 2 or 3: points in no order are found
/// faster if they are sorted first. `unfinished` of `olbvh_nearest_parts` says whether more rounds are
/// needed; until then, a point has no coordinates yet, and its tetrahedron need not be the closest. Points deep inside take
/// many rounds: in a grid of 32 x 32 x 32 cubes, 27 for points anywhere, 54 around its middle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_nearest(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
    within: f32,
    memory: OlbvhBuffer,
    rounds: OlbvhRounds,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, scene), location) = unsafe { (begun_with(recording, scene, "scene")?, handle(location, "location")?) };
        let rounds = Rounds::from(rounds);
        let input = OlbvhLocation { hints: OlbvhBuffer::default(), ..*location }.in_order(r, scene, rounds.resume)?;
        let memory = memory.place(|a| NearestMemory::carve(a, location.count))?;
        cmd_nearest(r, &scene.scene, &input, within, &memory, rounds)
    })
}

/// Records the interpolation of a field at points that have been located. `field` has `components` floats for each point or
/// tetrahedron of the mesh, such as 3 of a velocity, and `values` gets as many for each located point, NaN for one without
/// an owner. Of `location`, only count, owners and barycentrics are used; compute shaders read the latter two.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_interpolate(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
    field: *const OlbvhField,
    components: u32,
    values: OlbvhBuffer,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, OlbvhScene { scene, .. }), location) = unsafe { (begun_with(recording, scene, "scene")?, handle(location, "location")?) };
        // SAFETY: the caller keeps the rules of `capi`.
        let field = unsafe { handle(field, "field")? };
        cmd_interpolate(r, scene, field.read(), components, &location.output(), (values.part(), location.count))
    })
}
