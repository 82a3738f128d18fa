//! Pictures, and the ranges of values by which their nodes are skipped.

use super::scene::OlbvhScene;
use super::{OlbvhBuffer, OlbvhField, OlbvhRecording, OlbvhRounds, recorded};
use crate::build::{cmd_ranges, range_bytes};
use crate::capi::query::OlbvhPictureSettings;
use crate::capi::{OlbvhStatus, border, handle, put};
use crate::error::Result;
use crate::primitives::Arena;
use crate::query::{RenderInput, RenderMemory, Scene, Shown, StructureView, cmd_render};
use crate::render::{Bounds, Plan};
use std::mem::offset_of;

/// What a picture shows, for the device: `olbvh_view_make` fills it, and the host copies it as it is to where `olbvh_picture.view` lies.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhView {
    /// Rays, light, step, range of values, iso-surfaces.
    pub frame: [u32; 64],
    /// The transfer function over the range of values: colour, and opacity of one step or of one surface.
    pub table: [[f32; 4]; 1024],
    /// Ranges of values outside of which nothing is to be seen, ascending and apart; behind the last stand such as no value lies in.
    pub drawn: [[f32; 2]; 512],
    /// How many of them there are.
    pub drawn_count: u32,
}

/// What is drawn, and where. Contents are read when the commands are executed, so a new view or new values need no new recording.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhPicture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Not 0: the iso-surfaces that the view has, instead of the volume.
    pub iso: u32,
    /// With ranges: ranges of the view that are looked at, its `drawn_count` or more, up to 512.
    pub drawn_count: u32,
    /// An `olbvh_view`.
    pub view: OlbvhBuffer,
    /// What is shown.
    pub field: OlbvhField,
    /// Three floats per point of the mesh, normals of length up to 1 by which the volume is lit. Of no bytes: it is not lit.
    pub normals: OlbvhBuffer,
    /// The ranges of the field that `olbvh_cmd_ranges` records: nodes without a value to be seen are skipped. Of no bytes: nothing is. The picture is the same.
    pub ranges: OlbvhBuffer,
    /// Memory of `olbvh_picture_parts`.
    pub memory: OlbvhBuffer,
    /// A round takes up to 1,024 samples of every ray. No round, from the beginning, prepares the picture and leaves it empty.
    pub rounds: OlbvhRounds,
}

/// Memory of a picture, and where in it the answers are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhPictureParts {
    /// Bytes of the memory.
    pub bytes: u64,
    /// Per pixel, the upper row first, four floats: colour, multiplied by its opacity, and opacity.
    pub colors: OlbvhBuffer,
    /// Words: samples taken, those in the mesh, those skipped, two words each, the lower first; then rays that need another round.
    pub status: OlbvhBuffer,
}

impl OlbvhPicture {
    fn carve(&self, scene: &Scene) -> impl Fn(&mut Arena) -> Result<RenderMemory> {
        let (size, skipping) = ([self.width, self.height], (self.ranges.size > 0).then_some(scene.tree.capacity));
        move |arena| RenderMemory::carve(arena, size, skipping.as_ref())
    }
}

/// Works out what a picture shows of a mesh whose points lie within the box from `lo` to `hi`, three floats each: the camera is placed by it, and lengths are
/// measured by its diagonal. Without a range in the settings, values reach from 0 to 1.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_view_make(
    settings: *const OlbvhPictureSettings,
    lo: *const f32,
    hi: *const f32,
    out: *mut OlbvhView,
) -> OlbvhStatus {
    border(|| {
        let bounds = Bounds { lo: *handle(lo.cast::<[f32; 3]>(), "lo")?, hi: *handle(hi.cast::<[f32; 3]>(), "hi")? };
        let plan = Plan::new(&handle(settings, "settings")?.read()?, &bounds, [0.0; 3], None)?;
        let mut view = OlbvhView { frame: [0; 64], table: [[0.0; 4]; 1024], drawn: [[f32::INFINITY; 2]; 512], drawn_count: 0 };
        let frame = plan.view();
        view.frame.iter_mut().zip(bytemuck::cast_slice(std::slice::from_ref(&frame))).for_each(|(to, word)| *to = *word);
        view.table.iter_mut().zip(&plan.table).for_each(|(to, entry)| *to = *entry);
        // Ranges apart have three entries of the table each, so there is room for all.
        view.drawn.iter_mut().zip(&plan.drawn).for_each(|(to, range)| *to = *range);
        view.drawn_count = plan.drawn.len() as u32;
        put(out, view)
    })
}

/// Tells how many bytes the ranges of a field take.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_range_bytes(scene: *const OlbvhScene, out: *mut u64) -> OlbvhStatus {
    border(|| put(out, range_bytes(handle(scene, "scene")?.scene.tree.capacity.nodes)))
}

/// Records the smallest and the largest value of a field in every node of the tree into `ranges`; new values need this alone, not a new tree. Begins with a
/// transfer write, ends with a barrier as `olbvh_cmd_barrier` records it.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_ranges(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    field: *const OlbvhField,
    ranges: OlbvhBuffer,
) -> OlbvhStatus {
    recorded(recording, |r| {
        let scene = &handle(scene, "scene")?.scene;
        let ranges = ranges.holds(range_bytes(scene.tree.capacity.nodes), "ranges")?;
        cmd_ranges(r, &scene.mesh, &scene.tree, handle(field, "field")?.read(scene)?, ranges)
    })
}

/// Tells what memory a picture takes, and where in its `memory` (of no bytes, as long as there is none) the answers are.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_picture_parts(scene: *const OlbvhScene, picture: *const OlbvhPicture, out: *mut OlbvhPictureParts) -> OlbvhStatus {
    border(|| {
        let (scene, picture) = (&handle(scene, "scene")?.scene, handle(picture, "picture")?);
        let (bytes, RenderMemory { colors, status, .. }) = picture.memory.carve(picture.carve(scene))?;
        put(out, OlbvhPictureParts { bytes, colors: colors.into(), status: status.into() })
    })
}

/// Records the drawing of a picture. Where nodes are skipped, the tree is read by transfers as well.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_render(recording: *mut OlbvhRecording, scene: *const OlbvhScene, picture: *const OlbvhPicture) -> OlbvhStatus {
    recorded(recording, |r| {
        let (scene, picture) = (&handle(scene, "scene")?.scene, handle(picture, "picture")?);
        let view = picture.view.holds(offset_of!(OlbvhView, drawn_count) as u64, "a view")?;
        let drawn = view.part(offset_of!(OlbvhView, drawn) as u64, (512 * size_of::<[f32; 2]>()) as u64);
        let ranges = picture.ranges.optional(range_bytes(scene.tree.capacity.nodes), "ranges")?;
        let input = RenderInput {
            size: [picture.width, picture.height],
            view: view.part(0, offset_of!(OlbvhView, table) as u64),
            iso: picture.iso != 0,
            table: view.part(offset_of!(OlbvhView, table) as u64, (offset_of!(OlbvhView, drawn) - offset_of!(OlbvhView, table)) as u64),
            field: picture.field.read(scene)?,
            normals: picture.normals.optional(12 * u64::from(scene.mesh.input.points), "normals")?,
            shown: ranges.map(|ranges| Shown { ranges, drawn, count: picture.drawn_count.min(512) }),
            part: None,
        };
        let memory = picture.memory.place(picture.carve(scene))?;
        let searched = StructureView::from(scene);
        cmd_render(r, &searched, &input, &memory, picture.rounds.into())
    })
}
