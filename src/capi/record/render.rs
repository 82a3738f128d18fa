//! The C interface to pictures, and to the ranges of values by which nodes are skipped.

use super::scene::{OlbvhScene, begun_with};
use super::{OlbvhBuffer, OlbvhField, OlbvhRecording, OlbvhRounds};
use crate::build::{cmd_ranges, range_bytes};
use crate::capi::query::OlbvhPictureSettings;
use crate::capi::{OlbvhStatus, border, handle, place};
use crate::error::{Error, Result};
use crate::gpu::Arena;
use crate::layout::ViewUniforms;
use crate::mesh::Bounds;
use crate::query::{RenderInput, RenderMemory, Scene, Visibility, cmd_depths, cmd_render};
use crate::render::{PicturePlan, ProjectedView};
use glam::DMat4;
use std::mem::offset_of;

/// What a picture shows, in the form that the device reads. `olbvh_view_make` fills it; the host copies it unchanged to
/// `olbvh_picture.view`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhView {
    /// Rays, clips, light, step, range of values, and values of iso-surfaces.
    pub frame: [u32; 64],
    /// The transfer function over the range of values: colour, and opacity of one step or of one surface.
    pub table: [[f32; 4]; 1024],
    /// Ranges of values outside of which nothing is visible, ascending and disjoint. Unused ranges at the end contain
    /// no value.
    pub drawn: [[f32; 2]; 512],
    /// Number of ranges in `drawn` that are used.
    pub drawn_count: u32,
}

// The view of a picture must fit, since it is copied as far as there is room.
const _: () = assert!(size_of::<ViewUniforms>() <= size_of::<[u32; 64]>());

/// What is drawn, and where. The contents of the buffers are read when the commands are executed, so a new view or new
/// values need no new recording.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhPicture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Not 0: the iso-surfaces of the view are drawn instead of the volume.
    pub iso: u32,
    /// Used if `ranges` is given: how many ranges of the view are considered, at least its own `drawn_count`, up to
    /// 512.
    pub drawn_count: u32,
    /// Buffer with an `olbvh_view`.
    pub view: OlbvhBuffer,
    /// The field that is drawn.
    pub field: OlbvhField,
    /// Optional (size 0: no lighting): three floats per point of the mesh, normals of length up to 1 by which the
    /// volume is lit.
    pub normals: OlbvhBuffer,
    /// Optional (size 0: nothing is skipped): the ranges that `olbvh_cmd_ranges` records for the field, by which nodes
    /// without visible values are skipped. The picture is the same either way.
    pub ranges: OlbvhBuffer,
    /// Optional (size 0: everything is drawn): a depth buffer, behind which nothing is drawn. One float per pixel, upper row
    /// first, such as a copy of a depth attachment (`D32_SFLOAT`) has; with a view of `olbvh_view_make` the distance from
    /// the eye along the axis of the view, with one of `olbvh_view_make_projected` what Vulkan wrote there.
    pub depth: OlbvhBuffer,
    /// Memory of the size that `olbvh_picture_parts` reports.
    pub memory: OlbvhBuffer,
    /// A round takes up to 1,024 samples of every ray. A `count` of 0 without `resume` prepares the picture and leaves
    /// it empty.
    pub rounds: OlbvhRounds,
}

/// Memory for a picture, and where in it the results are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhPictureParts {
    /// Size of the memory in bytes.
    pub bytes: u64,
    /// Four floats per pixel, upper row first: colour multiplied by its opacity, and opacity.
    pub colors: OlbvhBuffer,
    /// An `olbvh_picture_status`.
    pub status: OlbvhBuffer,
}

/// Progress of a picture, which the device writes to `olbvh_picture_parts_data.status`. Numbers of two words have the
/// lower one first.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[allow(dead_code, reason = "the device writes it, and C programs read it")]
pub struct OlbvhPictureStatus {
    /// Number of rays that may meet the mesh, and of some beside them.
    pub met: u32,
    /// Number of samples taken.
    pub samples: [u32; 2],
    /// Number of samples in the mesh.
    pub found: [u32; 2],
    /// Number of samples skipped, in nodes without visible values.
    pub skipped: [u32; 2],
    /// Number of rays that need another round.
    pub unfinished: u32,
}

impl OlbvhPicture {
    fn carve(&self, scene: &Scene) -> impl Fn(&mut Arena) -> Result<RenderMemory> {
        let (size, skipping) = ([self.width, self.height], (self.ranges.size > 0).then_some(scene.tree.capacity));
        move |arena| RenderMemory::carve(arena, size, skipping.as_ref())
    }

    fn input(&self) -> Result<RenderInput> {
        let view = self.view.part();
        view.check(offset_of!(OlbvhView, drawn_count) as u64, "a view")?;
        let values = view.part(offset_of!(OlbvhView, drawn) as u64, (512 * size_of::<[f32; 2]>()) as u64);
        Ok(RenderInput {
            size: [self.width, self.height],
            view: view.part(0, offset_of!(OlbvhView, table) as u64),
            iso: self.iso != 0,
            table: view.part(offset_of!(OlbvhView, table) as u64, (offset_of!(OlbvhView, drawn) - offset_of!(OlbvhView, table)) as u64),
            field: self.field.read(),
            normals: self.normals.given(),
            depth: self.depth.given(),
            visibility: self.ranges.given().map(|ranges| Visibility { ranges, values, count: self.drawn_count.min(512) }),
            row: 0,
        })
    }
}

/// Computes what a picture shows of a mesh whose points lie in the box from `lo` to `hi`, three floats each. The camera
/// is placed relative to this box, and default lengths are fractions of its diagonal. If the settings give no range of
/// values, it is 0 to 1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_view_make(
    settings: *const OlbvhPictureSettings,
    lo: *const f32,
    hi: *const f32,
    out: *mut OlbvhView,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (settings, bounds, out) = unsafe { (handle(settings, "settings")?.read()?, bounds(lo, hi)?, place(out)?) };
        out.write(view_of(&PicturePlan::new(&settings, &bounds, [0.0; 3], None)?));
        Ok(())
    })
}

/// As `olbvh_view_make`, but the mesh appears where a renderer sees it, and not in the view of the settings' camera.
/// `to_clip` has 16 numbers, column by column: the matrix (projection · view · model) that takes points of the mesh to
/// Vulkan's clip space, whose y points down; negate the second row of a matrix that is used with a viewport of negative
/// height. If `reversed` is not 0, the near plane has depth 1 and what is far depth 0, otherwise it is the other way round.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_view_make_projected(
    settings: *const OlbvhPictureSettings,
    lo: *const f32,
    hi: *const f32,
    to_clip: *const f64,
    reversed: u32,
    out: *mut OlbvhView,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (settings, bounds, out) = unsafe { (handle(settings, "settings")?.read()?, bounds(lo, hi)?, place(out)?) };
        // SAFETY: the caller keeps the rules of `capi`.
        let to_clip = DMat4::from_cols_array(unsafe { handle(to_clip.cast(), "to_clip")? });
        let view = ProjectedView { to_clip, reversed: reversed != 0 };
        out.write(view_of(&PicturePlan::with_projected(&settings, &view, &bounds, [0.0; 3], None)?));
        Ok(())
    })
}

/// The box between two corners of three floats each.
///
/// # Safety
/// See [`crate::capi`].
unsafe fn bounds(lo: *const f32, hi: *const f32) -> Result<Bounds> {
    // SAFETY: the caller keeps the rules of `capi`.
    let Bounds { lo, hi } = unsafe { Bounds { lo: *handle(lo.cast(), "lo")?, hi: *handle(hi.cast(), "hi")? } };
    if lo.iter().zip(&hi).all(|(lo, hi)| lo.is_finite() && hi.is_finite() && lo <= hi) {
        return Ok(Bounds { lo, hi });
    }
    Err(Error::Invalid(format!("a box from {lo:?} to {hi:?}; coordinates are finite, and those of lo at most those of hi")))
}

fn view_of(plan: &PicturePlan) -> OlbvhView {
    let mut view = OlbvhView { frame: [0; 64], table: [[0.0; 4]; 1024], drawn: [[f32::INFINITY; 2]; 512], drawn_count: 0 };
    let frame = plan.view();
    view.frame.iter_mut().zip(bytemuck::cast_slice(std::slice::from_ref(&frame))).for_each(|(to, word)| *to = *word);
    view.table.iter_mut().zip(&plan.table).for_each(|(to, entry)| *to = *entry);
    // Disjoint ranges take at least three entries of the table each, so there is room for all.
    view.drawn.iter_mut().zip(&plan.visible_values).for_each(|(to, range)| *to = *range);
    view.drawn_count = plan.visible_values.len() as u32;
    view
}

/// Reports how many bytes the ranges of a field take.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_range_bytes(scene: *const OlbvhScene, out: *mut u64) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (scene, out) = unsafe { (handle(scene, "scene")?, place(out)?) };
        out.write(range_bytes(scene.scene.tree.capacity.nodes));
        Ok(())
    })
}

/// Records the computation of the smallest and the largest value of a field in every node of the tree, into `ranges`.
/// New values of the field need only this, not a new tree. Starts with a transfer write and ends with a barrier like
/// that of `olbvh_cmd_barrier`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_ranges(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    field: *const OlbvhField,
    ranges: OlbvhBuffer,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, OlbvhScene { scene, .. }), field) = unsafe { (begun_with(recording, scene, "scene")?, handle(field, "field")?) };
        cmd_ranges(r, &scene.mesh, &scene.tree, field.read(), ranges.part())
    })
}

/// Reports how much memory a picture needs, and where in its `memory` (size 0 if it does not exist yet) the results
/// are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_picture_parts(
    scene: *const OlbvhScene,
    picture: *const OlbvhPicture,
    out: *mut OlbvhPictureParts,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (scene, picture, out) = unsafe { (&handle(scene, "scene")?.scene, handle(picture, "picture")?, place(out)?) };
        let (bytes, RenderMemory { colors, status, .. }) = picture.memory.carve(picture.carve(scene))?;
        out.write(OlbvhPictureParts { bytes, colors: colors.into(), status: status.into() });
        Ok(())
    })
}

/// Records the drawing of a picture. If nodes are skipped, transfers read the tree as well.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_render(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    picture: *const OlbvhPicture,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, OlbvhScene { scene, .. }), picture) = unsafe { (begun_with(recording, scene, "scene")?, handle(picture, "picture")?) };
        let memory = picture.memory.place(picture.carve(scene))?;
        cmd_render(r, scene, &picture.input()?, &memory, picture.rounds.into())
    })
}

/// Records what a depth buffer has where the rays of a picture became opaque: at an opaque iso-surface, or where the volume
/// reached the opacity at which rays end. `depths` has a float per pixel, upper row first; other pixels keep their values,
/// so that it may be the `depth` of the picture itself. Copied to a depth attachment, it hides what is drawn behind. To be
/// recorded after the last round of `olbvh_cmd_render` and an `olbvh_cmd_barrier`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_depths(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    picture: *const OlbvhPicture,
    depths: OlbvhBuffer,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let ((r, OlbvhScene { scene, .. }), picture) = unsafe { (begun_with(recording, scene, "scene")?, handle(picture, "picture")?) };
        let memory = picture.memory.place(picture.carve(scene))?;
        cmd_depths(r, &picture.input()?, &memory, depths.part())
    })
}
