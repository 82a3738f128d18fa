//! Direct volume rendering (SPEC 3.3): ray intervals over boundary nodes, then marching in dispatches of bounded work.

use super::{Searched, Structure, cmd_visible, dispatch, visible_bytes};
use crate::build::{DeviceMesh, cmd_ranges, range_bytes};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferRef, Gpu, Recorder};
use crate::kernels::{
    LbvhIntervals, LbvhIntervalsSpec, LbvhMarch, LbvhMarchSpec, VolumeIntervals, VolumeIntervalsSpec, VolumeMarch, VolumeMarchSpec,
};
use crate::layout::{Grid, RayState, RenderPlan, RenderStatus};
use crate::mesh::On;
use crate::primitives::Arena;
use crate::render::Plan;

/// Candidates that a ray may test in one dispatch.
const BUDGET: u32 = 1024;
/// Nodes on the short stack of the traversal.
const STACK: u32 = 8;

/// Memory of one picture on the device.
#[derive(Clone, Copy, Debug)]
struct Canvas {
    plan: BufferRef,
    table: BufferRef,
    states: BufferRef,
    status: BufferRef,
    items: u32,
    /// Nodes without anything to see are skipped.
    skip: bool,
}

impl Canvas {
    /// Rays of a picture in whole blocks of 8 × 8.
    fn items(size: [u32; 2]) -> Result<u32> {
        let items = u64::from(size[0].div_ceil(8)) * u64::from(size[1].div_ceil(8)) * 64;
        let items = u32::try_from(items).ok().filter(|&n| n < 1 << 31);
        items.ok_or_else(|| Error::TooLarge(format!("a picture of {}×{} pixels; draw it in parts", size[0], size[1])))
    }
}

/// What the kernels need of a plan.
fn kernel_plan(plan: &Plan, grid: &Grid, visible_at: u32) -> RenderPlan {
    let pad = |v: [f32; 3]| [v[0], v[1], v[2], 0.0];
    let lighting = plan.lighting.unwrap_or(crate::render::Lighting { to_light: [0.0, 0.0, 1.0], strength: [1.0, 0.0, 0.0], rim: 0.0 });
    let (slack, inverse_step) = crate::render::interval_slack(grid, plan);
    RenderPlan {
        origin: pad(plan.rays.origin),
        origin_x: pad(plan.rays.origin_x),
        origin_y: pad(plan.rays.origin_y),
        way: pad(plan.rays.way),
        way_x: pad(plan.rays.way_x),
        way_y: pad(plan.rays.way_y),
        slack: pad(slack),
        to_light: pad(lighting.to_light),
        strength: [lighting.strength[0], lighting.strength[1], lighting.strength[2], lighting.rim],
        size: plan.size,
        step_size: plan.step,
        inverse_step,
        value_lo: plan.value_lo,
        value_scale: plan.value_scale,
        termination: plan.termination,
        visible_at,
    }
}

/// What a drawn picture holds.
#[derive(Clone, Debug, Default)]
pub struct Drawn {
    /// Premultiplied colour and opacity, row 0 on top.
    pub colors: Vec<[f32; 4]>,
    /// Samples taken.
    pub samples: u64,
    /// Samples within the intervals that were not taken: their nodes have nothing to see.
    pub skipped_samples: u64,
    /// Samples taken that lie in the mesh.
    pub found_samples: u64,
    /// Device time of the field's ranges and of the marks of visible nodes, where values are transparent.
    pub ranges_ms: f64,
    /// Device time of the ray intervals.
    pub interval_ms: f64,
    /// Device time of the march.
    pub march_ms: f64,
    /// Submissions that the march took.
    pub submissions: u32,
}

fn cmd_intervals(r: &mut Recorder<'_>, searched: &Searched, canvas: &Canvas) -> Result<()> {
    let (input, arrays, stack) = (&searched.mesh.input, &searched.mesh.arrays, STACK);
    r.stage("query.intervals", |r| {
        dispatch!(r, canvas.items, searched, VolumeIntervals VolumeIntervalsSpec {} {}, LbvhIntervals LbvhIntervalsSpec, {
            cells: input.cells,
            vertices: arrays.vertices,
            plans: canvas.plan,
            states: canvas.states,
            items: canvas.items,
        }, { stack })
    })
}

fn cmd_march(
    r: &mut Recorder<'_>,
    searched: &Searched,
    canvas: &Canvas,
    field: BufferRef,
    on: On,
    normals: Option<BufferRef>,
) -> Result<()> {
    let (input, arrays) = (&searched.mesh.input, &searched.mesh.arrays);
    let (shading, on_cells, lists) = (u32::from(normals.is_some()), u32::from(on == On::Cells), searched.lists());
    let (skip, normals) = (u32::from(canvas.skip), normals.unwrap_or_else(|| r.gpu().nothing()));
    r.stage("query.march", |r| {
        dispatch!(r, canvas.items, searched, VolumeMarch VolumeMarchSpec {} { lists, skip }, LbvhMarch LbvhMarchSpec, {
            cells: input.cells,
            vertices: arrays.vertices,
            neighbours: arrays.neighbours,
            field: field,
            normals: normals,
            plans: canvas.plan,
            table: canvas.table,
            states: canvas.states,
            status: canvas.status,
            items: canvas.items,
            budget: BUDGET,
        }, { shading, on_cells })
    })
}

/// Which nodes of an octree have something to see, where the plan hides some values.
struct Visible {
    /// The boundary flags, and behind them the marks of the visible nodes.
    flags: BufferRef,
    marks: BufferRef,
    milliseconds: f64,
    _memory: Buffer,
}

impl Visible {
    fn new(gpu: &Gpu, searched: &Searched, plan: &Plan, field: (BufferRef, On)) -> Result<Option<Self>> {
        let Structure::Octree(tree) = searched.structure else { return Ok(None) };
        let nodes = tree.capacity.nodes;
        let bits = visible_bytes(nodes);
        let drawn = gpu.upload("olbvh.query.drawn", &plan.drawn)?;
        let carve = |a: &mut Arena| Ok((a.take(bits)?, a.take(bits)?, a.take(range_bytes(nodes))?));
        let memory = gpu.buffer("olbvh.query.visible", Arena::measure(carve)?)?;
        let (flags, marks, ranges) = carve(&mut Arena::new(memory.all()))?;
        let ((), time) = gpu.run("olbvh.query.visible", |r| {
            r.copy(tree.flags.part(0, bits), flags.part(0, bits));
            cmd_ranges(r, &searched.mesh, &tree, field, ranges)?;
            cmd_visible(r, &tree, ranges, (drawn.all(), plan.drawn.len() as u32), marks)
        })?;
        let milliseconds = time.milliseconds("build.ranges") + time.milliseconds("query.visible");
        let flags = memory.all().part(flags.offset, marks.offset + bits - flags.offset);
        Ok(Some(Self { flags, marks, milliseconds, _memory: memory }))
    }

    /// Where the marks begin, in words of the flags.
    fn at(&self) -> u32 {
        ((self.marks.offset - self.flags.offset) / 4) as u32
    }
}

/// Draws a plan of a field (values per point or per tetrahedron); `normals`: one per point, for shading. `report` is told how many rays
/// are done.
///
/// # Errors
/// [`Error::Memory`], [`Error::TooLarge`], a failed Vulkan call, or [`Error::Invalid`] if field or normals have the wrong length.
pub fn render(
    mesh: &DeviceMesh,
    structure: impl Into<Structure>,
    plan: &Plan,
    (values, on): (&[f32], On),
    normals: Option<&[[f32; 3]]>,
    report: &dyn Fn(u64, u64),
) -> Result<Drawn> {
    let gpu = mesh.gpu();
    let searched = Searched::new(mesh, structure);
    let expected = if on == On::Points { mesh.input().points } else { mesh.input().tets };
    if values.len() != expected as usize || normals.is_some_and(|n| n.len() != mesh.input().points as usize) {
        return Err(Error::Invalid(format!(
            "a field of {} values where the mesh has {expected}, or normals for another mesh",
            values.len()
        )));
    }
    let field = gpu.upload("olbvh.query.field", values)?;
    let normals = normals.map(|n| gpu.upload("olbvh.query.normals", n)).transpose()?;
    let table = gpu.upload("olbvh.query.table", &plan.table)?;
    let visible = if plan.hides(values) { Visible::new(gpu, &searched, plan, (field.all(), on))? } else { None };
    let (for_intervals, for_march) = match &visible {
        Some(visible) => (searched.with_flags(visible.marks), searched.with_flags(visible.flags)),
        None => (searched, searched),
    };
    let visible_at = visible.as_ref().map_or(0, Visible::at);
    let kernel_plan = gpu.upload("olbvh.query.plan", &[kernel_plan(plan, mesh.grid(), visible_at)])?;
    let items = Canvas::items(plan.size)?;
    let carve = |a: &mut Arena| Ok((a.take(size_of::<RayState>() as u64 * u64::from(items))?, a.take(size_of::<RenderStatus>() as u64)?));
    let memory = gpu.buffer("olbvh.query.canvas", Arena::measure(carve)?)?;
    let (states, status) = carve(&mut Arena::new(memory.all()))?;
    let canvas = Canvas { plan: kernel_plan.all(), table: table.all(), states, status, items, skip: visible.is_some() };
    let ((), time) = gpu.run("olbvh.query.intervals", |r| {
        r.fill(canvas.status, 0);
        cmd_intervals(r, &for_intervals, &canvas)
    })?;
    let ranges_ms = visible.as_ref().map_or(0.0, |visible| visible.milliseconds);
    let mut drawn = Drawn { ranges_ms, interval_ms: time.milliseconds("query.intervals"), ..Drawn::default() };
    let rays = u64::from(plan.size[0]) * u64::from(plan.size[1]);
    loop {
        let ((), time) = gpu.run("olbvh.query.march", |r| {
            r.fill(canvas.status.part(16, 4), 0);
            r.barrier("march.clear → march");
            cmd_march(r, &for_march, &canvas, field.all(), on, normals.as_ref().map(Buffer::all))
        })?;
        drawn.march_ms += time.milliseconds("query.march");
        drawn.submissions += 1;
        let status = gpu.download::<RenderStatus>(&memory, canvas.status.part(0, size_of::<RenderStatus>() as u64))?;
        let status = status.first().copied().unwrap_or_default();
        report(rays.saturating_sub(u64::from(status.unfinished)), rays);
        if status.unfinished == 0 {
            let wide = |w: [u32; 2]| u64::from(w[0]) | u64::from(w[1]) << 32;
            (drawn.samples, drawn.skipped_samples, drawn.found_samples) = (wide(status.samples), wide(status.skipped), wide(status.found));
            break;
        }
    }
    let states: Vec<RayState> = gpu.download(&memory, canvas.states)?;
    let across = plan.size[0].div_ceil(8);
    let state_of = |x: u32, y: u32| {
        let (dx, dy) = (x % 8, y % 8);
        let spread = |v: u32| (v & 1) | (v & 2) << 1 | (v & 4) << 2;
        &states[((y / 8 * across + x / 8) * 64 + (spread(dx) | spread(dy) << 1)) as usize]
    };
    drawn.colors = (0..plan.size[1]).flat_map(|y| (0..plan.size[0]).map(move |x| (x, y))).map(|(x, y)| state_of(x, y).color).collect();
    Ok(drawn)
}
