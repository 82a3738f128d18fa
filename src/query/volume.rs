//! Direct volume rendering on the device (SPEC 3.3): ray intervals over boundary nodes, then marching in dispatches of
//! bounded work.
//!
//! ```text
//! visible     marks the nodes in which something is visible, if the caller wants the others skipped
//! plan        prepares view and transfer function for the kernels, from bounds that only the device knows
//! intervals   finds the first and the last sample of each ray
//! march       takes samples, front to back                                                    a round
//! depths      writes where rays became opaque, if the caller wants to know
//! ```

mod picture;
pub(crate) use picture::{Canvas, Rays, render_in};
pub use picture::{Rendered, prepare_picture, render};

use super::searched::{Searched, dispatch};
use super::{Rounds, Scene, cmd_visible, visible_bytes};
use crate::build::{Capacity, MeshInput, check_field};
use crate::error::{Error, Result};
use crate::gpu::{Arena, BufferRef, Groups, Recorder};
use crate::grid::CellRange;
use crate::kernels::{
    LbvhIntervals, LbvhIntervalsSpec, LbvhMarch, LbvhMarchSpec, VolumeDepths, VolumeDepthsSpec, VolumeIntervals, VolumeIntervalsSpec,
    VolumeMarch, VolumeMarchSpec, VolumePlan, VolumePlanSpec,
};
use crate::layout::constants::frame::TOP_LEVEL;
use crate::layout::{DrawUniforms, RayState, RenderStatus, ViewUniforms};
use crate::mesh::On;
use crate::primitives::Count;
use crate::render::{PicturePlan, TABLE_SIZE};
use std::mem::offset_of;

/// Cells of [`TOP_LEVEL`].
const TOP_CELLS: usize = 1 << (3 * TOP_LEVEL);
/// Side, in pixels, of the square blocks that a picture is drawn in.
const BLOCK: u32 = 8;

/// What is drawn. All buffers belong to the caller, start at multiples of [`crate::gpu::ALIGNMENT`], and are read when
/// the device executes the commands, so new contents need no new recording.
#[derive(Clone, Copy, Debug)]
pub struct RenderInput {
    /// Width and height in pixels, those of the settings that the view was made with; of a part, its own height.
    pub size: [u32; 2],
    /// [`ViewUniforms`]: rays, light, step and range of values, as [`crate::render::PicturePlan::view`] makes it.
    pub view: BufferRef,
    /// Draws iso-surfaces, for the values that the view has, instead of the volume. View and table must have been made for
    /// the same; [`RenderInput::of`] sees to that.
    pub iso: bool,
    /// The transfer function: [`TABLE_SIZE`] times four floats, as in [`crate::render::PicturePlan::table`].
    pub table: BufferRef,
    /// A field, one 32-bit float per point of the mesh or per tetrahedron, and which of the two.
    pub field: (BufferRef, On),
    /// A normal per point of the mesh, three floats of length up to 1, as [`crate::render::shading_normals`] makes them, for
    /// iso-surfaces [`crate::render::gradient_normals`]. Without normals, samples are not lit.
    pub normals: Option<BufferRef>,
    /// A depth buffer, behind which nothing is drawn: a 32-bit float per pixel of this picture or part, row 0 on top, such as
    /// a copy of a depth attachment (`D32_SFLOAT`) has. [`crate::render::RayGrid::depth`] of the view says what its values
    /// mean: with [`crate::render::PicturePlan::with_projected`] what Vulkan wrote there, with a camera the distance from the eye
    /// along the axis of the view.
    pub depth: Option<BufferRef>,
    /// The visible values, so that the march can skip nodes without any; `None`: every sample in the mesh is taken. The
    /// picture is the same either way.
    pub visibility: Option<Visibility>,
    /// The row of the view that is row 0 of this picture: 0, or the first row of a strip that is drawn by itself.
    pub row: u32,
}

impl RenderInput {
    /// The whole picture of a plan, unlit and with nothing in front of it. `view` and `table` have [`PicturePlan::view`] and
    /// [`PicturePlan::table`], or those of a later plan of the same size and kind.
    pub fn of(plan: &PicturePlan, view: BufferRef, table: BufferRef, field: (BufferRef, On)) -> Self {
        let (size, iso) = (plan.size, !plan.iso.is_empty());
        Self { size, view, iso, table, field, normals: None, depth: None, visibility: None, row: 0 }
    }

    /// Whether there is a depth buffer, and that buffer or an empty one.
    fn depths(&self, r: &Recorder<'_>) -> (u32, BufferRef) {
        (u32::from(self.depth.is_some()), self.depth.unwrap_or_else(|| r.gpu().nothing()))
    }

    /// Rejects parts that are too small for a picture of this mesh.
    fn check(&self, mesh: &MeshInput) -> Result<()> {
        self.view.check(size_of::<ViewUniforms>() as u64, "a view")?;
        self.table.check(16 * TABLE_SIZE as u64, "a transfer function")?;
        check_field(self.field, mesh)?;
        let pixels = u64::from(self.size[0]) * u64::from(self.size[1]);
        self.depth.map_or(Ok(()), |depth| depth.check(4 * pixels, "a depth buffer"))?;
        self.normals.map_or(Ok(()), |normals| normals.check(12 * u64::from(mesh.points), "normals"))
    }
}

/// The values that are visible; nodes of an octree without any of them are skipped.
#[derive(Clone, Copy, Debug)]
pub struct Visibility {
    /// The range of the field's values in every node, as [`crate::build::cmd_ranges`] records them.
    pub ranges: BufferRef,
    /// Ranges outside of which the transfer function is transparent: two floats each, ascending and disjoint, as in
    /// [`crate::render::PicturePlan::visible_values`].
    pub values: BufferRef,
    /// Number of these ranges. `[∞, ∞]` shows nothing, so a caller whose transfer function changes can pad the ranges
    /// to a fixed number with it.
    pub count: u32,
}

/// The picture and scratch memory: 52 bytes per pixel, and two bits per node of a tree whose nodes are skipped.
#[derive(Clone, Copy, Debug)]
pub struct RenderMemory {
    /// Per pixel four floats: premultiplied colour and opacity. Row 0 is on top.
    pub colors: BufferRef,
    /// [`RenderStatus`]: numbers of samples, and how many rays are unfinished.
    pub status: BufferRef,
    /// [`ViewUniforms`], [`DrawUniforms`], the transfer function, and the top of the octree.
    frame: BufferRef,
    /// A [`RayState`] for each ray that may meet the mesh.
    rays: BufferRef,
    /// Workgroups of a march.
    groups: BufferRef,
    marks: Option<NodeMarks>,
}

/// A copy of the boundary flags of a tree, followed by the marks of its visible nodes.
#[derive(Clone, Copy, Debug)]
struct NodeMarks {
    flags: BufferRef,
    visible: BufferRef,
}

impl NodeMarks {
    fn all(&self) -> BufferRef {
        let Self { flags, visible } = *self;
        BufferRef { size: visible.offset + visible.size - flags.offset, ..flags }
    }
}

impl RenderMemory {
    /// Carves the memory for pictures of up to this width and height. `skipping` is the capacity of the tree whose
    /// nodes may be skipped.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the arena is too small, [`Error::TooLarge`] for 2^31 pixels and more.
    pub fn carve(arena: &mut Arena, size: [u32; 2], skipping: Option<&Capacity>) -> Result<Self> {
        let rays = u64::from(rays(size)?);
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let bits = skipping.map(|capacity| visible_bytes(capacity.nodes));
        Ok(Self {
            colors: arena.take(16 * pixels)?,
            status: arena.take(size_of::<RenderStatus>() as u64)?,
            frame: arena.take((size_of::<ViewUniforms>() + size_of::<DrawUniforms>() + 16 * TABLE_SIZE + 4 * TOP_CELLS) as u64)?,
            rays: arena.take(size_of::<RayState>() as u64 * rays)?,
            groups: arena.words(3)?,
            marks: bits.map(|bits| Ok::<_, Error>(NodeMarks { flags: arena.take(bits)?, visible: arena.take(bits)? })).transpose()?,
        })
    }

    /// Number of rays of a picture of this size, which must fit.
    fn rays_of(&self, size: [u32; 2]) -> Result<u32> {
        let [width, height] = size;
        let rays = rays(size)?;
        if 16 * u64::from(width) * u64::from(height) > self.colors.size || size_of::<RayState>() as u64 * u64::from(rays) > self.rays.size {
            return Err(Error::Invalid(format!("a picture of {width}×{height} pixels in memory of fewer")));
        }
        Ok(rays)
    }
}

/// Number of rays of a picture, in whole blocks.
fn rays([width, height]: [u32; 2]) -> Result<u32> {
    let blocks = u64::from(width.div_ceil(BLOCK)) * u64::from(height.div_ceil(BLOCK));
    let rays = blocks.saturating_mul(u64::from(BLOCK * BLOCK));
    let rays = u32::try_from(rays).ok().filter(|&n| n < 1 << 31);
    rays.ok_or_else(|| Error::TooLarge(format!("a picture of {width}×{height} pixels; draw it in parts")))
}

/// Records the drawing of a picture. This call only records: nothing is submitted, waited for, allocated or read back.
///
/// Each round takes a limited number of samples of each ray (1,024, fewer if the structure is searched for them) and
/// skips rays that are finished. After the recorded rounds [`RenderStatus::unfinished`] says how many rays are left, and
/// the picture holds what has been gathered so far. Recording again with [`Rounds::resume`] (same input, same memory)
/// continues the work. `Rounds::begin(0)` only prepares, and leaves all rays unfinished. A renderer that does not read back
/// records a fixed number of rounds, and reads the status a few frames later.
///
/// A picture in the scene of a renderer; see [`crate::render::PicturePlan::with_projected`] for the plan:
///
/// ```no_run
/// use olbvh::{build::cmd_ranges, gpu::{BufferRef, Recorder}, mesh::On, query::*, render::PicturePlan, Result};
///
/// /// Buffers of yours with plan.view(), plan.table and plan.visible_values; with the field and its ranges in the nodes
/// /// (range_bytes); and with a copy of your depth attachment.
/// struct Yours { view: BufferRef, table: BufferRef, values: BufferRef, field: BufferRef, ranges: BufferRef, depth: BufferRef }
///
/// /// `memory` is that of RenderMemory::carve(arena, plan.size, Some(&scene.tree.capacity)).
/// fn draw(r: &mut Recorder, scene: &Scene, plan: &PicturePlan, yours: &Yours, memory: &RenderMemory) -> Result<()> {
///     let field = (yours.field, On::Points);
///     cmd_ranges(r, &scene.mesh, &scene.tree, field, yours.ranges)?; // for a new tree, or new values; ends with a barrier
///     // A barrier of yours: what you uploaded, and the copy of the depths, to compute shaders.
///     let visibility = Visibility { ranges: yours.ranges, values: yours.values, count: plan.visible_values.len() as u32 };
///     let whole = RenderInput::of(plan, yours.view, yours.table, field);
///     let input = RenderInput { depth: Some(yours.depth), visibility: Some(visibility), ..whole };
///     cmd_render(r, scene, &input, memory, Rounds::begin(2))
/// } // then a barrier of yours from compute shaders to the shader that blends memory.colors
/// ```
///
/// Entry: mesh, tree and input are read by compute shaders; the flags of a tree whose nodes are skipped are also read by
/// transfers. First use of `memory`: transfer and compute writes; when resumed, a transfer write of the
/// status, and compute reads and writes. Last use: compute reads and writes. There is no barrier before or after, so
/// the caller records one from compute shader writes to whatever reads colours and status, and, before resuming, one to
/// transfers and compute shaders.
///
/// # Errors
/// [`Error::Invalid`] for memory of fewer pixels, or without room for the nodes to be skipped, or if a part of the input
/// is too small; [`Error::TooLarge`] as [`RenderMemory::carve`].
pub fn cmd_render(r: &mut Recorder<'_>, scene: &Scene, input: &RenderInput, memory: &RenderMemory, rounds: Rounds) -> Result<()> {
    cmd_render_in(r, &scene.into(), input, None, false, memory, rounds)
}

/// [`cmd_render`], in any structure. With `marked`, the memory has the marks of the visible nodes already.
///
/// `cells` are given if the mesh is a block of another one, and other blocks draw their parts of the same rows. Blocks draw one
/// after the other, in an order in which every ray that meets two of them meets the earlier one first. Each block
/// continues the colours and rays in `memory` instead of starting new ones. Before the first block, colours must be 0,
/// and rays must be 0 except for [`RayState::last`], which must be `u32::MAX`. Only samples in these cells of the finest
/// grid, whole leaves of an octree, are taken.
fn cmd_render_in(
    r: &mut Recorder<'_>,
    searched: &Searched,
    input: &RenderInput,
    cells: Option<CellRange>,
    marked: bool,
    memory: &RenderMemory,
    rounds: Rounds,
) -> Result<()> {
    let [width, height] = input.size;
    let rays = memory.rays_of(input.size)?;
    input.check(&searched.mesh.input)?;
    let marks = node_marks(searched, input, memory)?;
    let unfinished = memory.status.part(offset_of!(RenderStatus, unfinished) as u64, 4);
    let met = memory.status.part(0, 4);
    let march = Count::device(rays, met);
    let workgroup = r.gpu().target().query;
    if !rounds.resume {
        r.fill(met, if cells.is_some() { rays } else { 0 });
        r.fill(memory.status.part(4, offset_of!(RenderStatus, unfinished) as u64 - 4), 0);
        r.fill(unfinished, width * height);
        if !marked {
            cmd_marks(r, searched, input, marks)?;
        }
        cmd_plan(r, searched, input, cells, memory, marks)?;
        r.barrier("render.plan → render.intervals");
        // With iso-surfaces the intervals use the boundary flags, not the marks: where the mesh has a crack, the field
        // may jump across an iso-value between nodes of which none is visible. These places must be sampled whatever
        // the tree.
        cmd_intervals(r, searched, rays, input, cells.is_some(), memory, marks.filter(|_| !input.iso))?;
        r.barrier("render.intervals → render.arguments");
        march.arguments(r, workgroup, memory.groups)?;
    }
    let groups = Groups::Indirect(memory.groups.part(0, 12));
    for round in 0..rounds.count {
        if round > 0 {
            r.barrier("render.march → render.clear");
        }
        r.fill(unfinished, 0);
        r.barrier("render.clear → render.march");
        cmd_march(r, searched, groups, input, memory, marks)?;
    }
    Ok(())
}

/// The flags and marks in `memory` if nodes are to be skipped.
fn node_marks(searched: &Searched, input: &RenderInput, memory: &RenderMemory) -> Result<Option<NodeMarks>> {
    let (Some(_), Some(tree)) = (input.visibility, searched.octree()) else { return Ok(None) };
    let bits = visible_bytes(tree.capacity.nodes);
    match memory.marks {
        Some(marks) if bits <= marks.visible.size => Ok(Some(marks)),
        _ => Err(Error::Invalid(format!("nodes are to be skipped in memory without room for {} of them", tree.capacity.nodes))),
    }
}

/// Records the marks of the visible nodes, if nodes are to be skipped.
fn cmd_marks(r: &mut Recorder<'_>, searched: &Searched, input: &RenderInput, marks: Option<NodeMarks>) -> Result<()> {
    if let (Some(NodeMarks { flags, visible }), Some(shown), Some(tree)) = (marks, input.visibility, searched.octree()) {
        let bits = visible_bytes(tree.capacity.nodes);
        r.copy(tree.flags.part(0, bits), flags);
        cmd_visible(r, tree, shown.ranges, (shown.values, shown.count), visible)?;
    }
    Ok(())
}

/// Records the preparation of the view for the kernels.
fn cmd_plan(
    r: &mut Recorder<'_>,
    searched: &Searched,
    input: &RenderInput,
    cells: Option<CellRange>,
    memory: &RenderMemory,
    marks: Option<NodeMarks>,
) -> Result<()> {
    let [first_cell, last_cell] = cells.unwrap_or(CellRange::WHOLE).words();
    let nothing = r.gpu().nothing();
    let (octree, grid, masks, co) = match searched.octree() {
        Some(tree) => (1, tree.grid, tree.masks, tree.co),
        None => (0, searched.mesh.arrays.grid, nothing, nothing),
    };
    let arguments = VolumePlan {
        grid,
        views: input.view,
        table: input.table,
        frames: memory.frame,
        masks,
        co,
        octree,
        width: input.size[0],
        height: input.size[1],
        visible_at: marks.map_or(0, |marks| ((marks.visible.offset - marks.flags.offset) / 4) as u32),
        row: input.row,
        first_cell,
        last_cell,
    };
    let workgroup = r.gpu().target().each;
    let groups = Groups::Count((TABLE_SIZE.max(TOP_CELLS) as u32).div_ceil(workgroup));
    r.stage("query.render_plan", |r| r.dispatch(&arguments, VolumePlanSpec { workgroup, ..Default::default() }, groups))
}

fn cmd_intervals(
    r: &mut Recorder<'_>,
    searched: &Searched,
    rays: u32,
    input: &RenderInput,
    part: bool,
    memory: &RenderMemory,
    marks: Option<NodeMarks>,
) -> Result<()> {
    let searched = &marks.map_or(*searched, |marks| searched.with_flags(marks.visible));
    let (mesh, arrays) = (&searched.mesh.input, &searched.mesh.arrays);
    let (part, iso) = (u32::from(part), u32::from(input.iso));
    let (depth, depths) = input.depths(r);
    let groups = Groups::Count(rays.div_ceil(r.gpu().target().query));
    r.stage("query.intervals", |r| {
        dispatch!(r, groups, searched, VolumeIntervals VolumeIntervalsSpec {} {}, LbvhIntervals LbvhIntervalsSpec, {
            cells: mesh.cells,
            vertices: arrays.vertices,
            frames: memory.frame,
            states: memory.rays,
            colors: memory.colors,
            depths: depths,
            status: memory.status,
            items: rays,
        }, { part, iso, depth })
    })
}

fn cmd_march(
    r: &mut Recorder<'_>,
    searched: &Searched,
    groups: Groups,
    input: &RenderInput,
    memory: &RenderMemory,
    marks: Option<NodeMarks>,
) -> Result<()> {
    let searched = &marks.map_or(*searched, |marks| searched.with_flags(marks.all()));
    let (mesh, arrays, (field, on)) = (&searched.mesh.input, &searched.mesh.arrays, input.field);
    let (shading, on_cells, lists) = (u32::from(input.normals.is_some()), u32::from(on == On::Cells), searched.lists());
    let (iso, skip, normals) = (u32::from(input.iso), u32::from(marks.is_some()), input.normals.unwrap_or_else(|| r.gpu().nothing()));
    let (depth, depths) = input.depths(r);
    r.stage("query.march", |r| {
        dispatch!(r, groups, searched, VolumeMarch VolumeMarchSpec {} { lists, skip }, LbvhMarch LbvhMarchSpec, {
            cells: mesh.cells,
            vertices: arrays.vertices,
            neighbours: arrays.neighbours,
            field: field,
            normals: normals,
            frames: memory.frame,
            states: memory.rays,
            colors: memory.colors,
            status: memory.status,
            depths: depths,
        }, { shading, on_cells, iso, depth })
    })
}

/// Records what a depth buffer has where the rays of a picture became opaque: at an opaque iso-surface, or where a volume
/// reached the opacity at which rays end ([`crate::render::RenderSettings::termination`]). Other pixels of `depths` keep
/// their values, so it may be [`RenderInput::depth`] itself, a 32-bit float per pixel; copied to a depth attachment, it
/// hides what a renderer draws behind. `input` and `memory` are those of [`cmd_render`], after its last round.
///
/// Entry: the memory is read by compute shaders, `depths` is written by them. There is no barrier before or after, so the
/// caller records one after [`cmd_render`], from compute shaders to compute shaders, and one to whatever reads `depths`.
///
/// # Errors
/// [`Error::Invalid`] if `depths` or the memory has room for fewer pixels; [`Error::TooLarge`] as [`RenderMemory::carve`].
pub fn cmd_depths(r: &mut Recorder<'_>, input: &RenderInput, memory: &RenderMemory, depths: BufferRef) -> Result<()> {
    let rays = memory.rays_of(input.size)?;
    depths.check(4 * u64::from(input.size[0]) * u64::from(input.size[1]), "a depth buffer")?;
    let arguments = VolumeDepths { frames: memory.frame, states: memory.rays, colors: memory.colors, depths, status: memory.status };
    let workgroup = r.gpu().target().each;
    let (spec, groups) = (VolumeDepthsSpec { workgroup, ..Default::default() }, Groups::Count(rays.div_ceil(workgroup)));
    r.stage("query.depths", |r| r.dispatch(&arguments, spec, groups))
}
