//! Rendering in blocks, front to back: of the two sides of a cut, the one that rays come from is rendered first, so
//! each ray meets its blocks in order and continues in each from its state after the previous one. A sample is taken by
//! the block that has its cell. Between blocks, rays are in host memory.

use super::cut::{Block, Placed, Source};
use super::size::least_bytes;
use super::{InBlocks, Refused, Tried, check_field, pieces, smaller, try_block, unless_too_large};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::layout::Grid;
use crate::mesh::{Field, Mesh, On};
use crate::options::BuildOptions;
use crate::query::{self, Canvas, Progress, Rays, Rendered};
use crate::reference::ranges::visible;
use crate::render::{Plan, Prepared, RenderSettings, RenderStats, ValidTets};
use rayon::prelude::*;
use std::slice::from_ref;

/// Bytes of device memory that rendering takes beside a block, at the least: for each column of the picture (of which
/// it draws a strip at a time), and in addition.
const PER_COLUMN: u64 = 1024;
const RESERVE: u64 = 1 << 17;

/// The field of a mesh that may not fit the device, and how to render it.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Options of its trees.
    pub options: BuildOptions,
    /// The field that is rendered.
    pub field: &'a Field,
    /// Settings of the picture.
    pub settings: &'a RenderSettings,
}

/// A picture, and how it was made.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The colours, and what they cost.
    pub rendered: Rendered,
    /// The plan that it was rendered with.
    pub plan: Plan,
    /// The field's values at the ends of the transfer function.
    pub range: [f32; 2],
}

/// Renders a picture as [`query::render`] does, within `memory` bytes of device memory. `report` receives the amount of
/// work done, and of all.
///
/// # Errors
/// Those of [`query::render`], [`Prepared::new`] and [`crate::build::Tree::build`]; [`crate::Error::TooLarge`] with the
/// sizes if the memory is too small for the smallest blocks.
pub fn render(gpu: &Gpu, memory: u64, asked: &View<'_>, report: Progress<'_>) -> Result<InBlocks<Picture>> {
    let View { mesh, ref options, field, settings } = *asked;
    check_field(mesh, Some((&field.values, field.on)))?;
    let gpu = &gpu.with_memory(memory);
    let mut took = InBlocks::default();
    if least_bytes(gpu, mesh, options)? <= memory {
        let placed = took.build(|| Placed::whole(gpu, mesh, options));
        if let Some(picture) = unless_too_large(placed.and_then(|placed| render_whole(&placed, asked, report)))? {
            return Ok(InBlocks { peak: gpu.memory_peak(), ..took }.with(picture));
        }
    }
    let source = Source::new(mesh, options)?.within(gpu, memory)?;
    // Light and opacity of a volume depend on which points are on the mesh surface; those of iso-surfaces do not.
    let neighbours = if settings.iso.is_empty() { source.neighbours() } else { Vec::new() };
    let valid = ValidTets { bounds: (&source.grid).into(), neighbours: &neighbours, is_valid: &|t| source.is_valid(t) };
    let prepared = Prepared::new(settings, mesh, &valid, field)?;
    drop(neighbours);
    let mut rays = Rays::new(prepared.plan.size)?;
    let mut job = Job { gpu, memory, source: &source, field, prepared: &prepared, stats: RenderStats::default(), took };
    let mut waiting = vec![(source.whole(), 1.0)];
    let mut done = 0.0;
    while let Some((block, share)) = waiting.pop() {
        match job.visit(&block, &mut rays)? {
            None => {
                done += share;
                report((done * 1e6) as u64, 1_000_000);
            }
            Some([near, far]) => waiting.extend([(far, share / 2.0), (near, share / 2.0)]),
        }
    }
    let Job { stats, took, .. } = job;
    let rendered = Rendered { colors: rays.colors, stats };
    let Prepared { plan, range, .. } = prepared;
    Ok(InBlocks { peak: gpu.memory_peak(), ..took }.with(Picture { rendered, plan, range }))
}

fn render_whole(placed: &Placed, asked: &View<'_>, report: Progress<'_>) -> Result<Picture> {
    let (Placed { mesh, tree, .. }, View { field, settings, .. }) = (placed, asked);
    let bad = if mesh.status().bad == 0 { Vec::new() } else { mesh.bad_cells()? };
    let neighbours = if settings.iso.is_empty() { mesh.neighbours()? } else { Vec::new() };
    let is_valid = |t| bad.binary_search(&t).is_err();
    let valid = ValidTets { bounds: tree.grid().into(), neighbours: &neighbours, is_valid: &is_valid };
    let Prepared { plan, normals, range, .. } = Prepared::new(settings, asked.mesh, &valid, field)?;
    drop(neighbours);
    let normals = (!normals.is_empty()).then_some(normals.as_slice());
    let rendered = query::render(mesh, tree, &plan, (&field.values, field.on), normals, report)?;
    Ok(Picture { rendered, plan, range })
}

/// The state of rendering a picture in blocks.
struct Job<'a> {
    gpu: &'a Gpu,
    memory: u64,
    source: &'a Source<'a>,
    field: &'a Field,
    prepared: &'a Prepared,
    stats: RenderStats,
    took: InBlocks,
}

impl Job<'_> {
    /// Renders a block, or cuts it and returns the nearer part and the farther one. A block with nothing to see is
    /// skipped.
    fn visit(&mut self, block: &Block, rays: &mut Rays) -> Result<Option<[Block; 2]>> {
        let met = if self.shows(block) { self.rows_met(block, rays) } else { Vec::new() };
        if !met.contains(&true) {
            return Ok(None);
        }
        let need = block.bytes(self.gpu, &self.source.options)?;
        let Tried::TooLarge(why) = try_block(need, self.memory, || self.draw(block, &met, rays))? else { return Ok(None) };
        let order = |axis: usize, last: u32| low_first(&self.prepared.plan, &self.source.grid, axis, last);
        let may = |axis: usize, last: u32| order(axis, last).is_some();
        let Some([low, high]) = smaller(self.source, block, pieces(need, self.memory), &may) else {
            let beside = RESERVE + PER_COLUMN * u64::from(self.prepared.plan.size[0]);
            let refused = Refused { gpu: self.gpu, sources: from_ref(self.source), beside, may: &may };
            return Err(refused.error(block.tets.len(), need, why));
        };
        let finest = low.cells.finest(self.source.level).hi;
        let axis = (0..3).find(|&c| low.cells.hi[c] < high.cells.lo[c]).unwrap_or(0);
        Ok(Some(if order(axis, finest[axis]) == Some(false) { [high, low] } else { [low, high] }))
    }

    /// Renders a block's part of the picture. Work that was done before a failure is not repeated by the block's parts.
    fn draw(&mut self, block: &Block, met: &[bool], rays: &mut Rays) -> Result<()> {
        let (Field { values, on, .. }, Prepared { plan, normals, .. }) = (self.field, self.prepared);
        let placed = self.took.build(|| block.place(self.gpu, self.source))?;
        let (values, normals) = (placed.values(values, *on), (!normals.is_empty()).then(|| placed.values(normals, On::Points)));
        let canvas = Canvas::new(&placed.mesh, &placed.tree, plan, (&values, *on), normals.as_deref(), true)?;
        let part = canvas.draw_part(block.cells.finest(self.source.level), met, rays)?;
        self.stats += part;
        log::debug!("a block of {} tetrahedra, {} samples", block.tets.len(), part.samples);
        Ok(())
    }

    /// Whether a block contains values that are visible. An iso-surface may lie between the samples of two blocks, so
    /// with iso-surfaces no block can be left out.
    fn shows(&self, block: &Block) -> bool {
        let Plan { iso, visible_values, .. } = &self.prepared.plan;
        let Field { values, on, .. } = self.field;
        let range = |&t: &u32| {
            let ids = self.source.mesh.tets[t as usize];
            let values = if *on == On::Points { ids.map(|i| values[i as usize]) } else { [values[t as usize]; 4] };
            let finite = values.iter().all(|v| v.is_finite());
            if finite { values.map(|v| [v; 2]).into_iter().fold(NO_RANGE, union) } else { NO_RANGE }
        };
        !iso.is_empty() || visible(&[block.tets.par_iter().map(range).reduce(|| NO_RANGE, union)], visible_values) != [0]
    }

    /// For each row of the picture, whether it has rays that may meet the block and are not yet opaque.
    fn rows_met(&self, block: &Block, rays: &Rays) -> Vec<bool> {
        let plan = &self.prepared.plan;
        let [width, height] = plan.size;
        let Some([lo, hi]) = block.bounds(self.source) else { return vec![false; height as usize] };
        // More than the distance by which rounding can move samples out of their cells.
        let more = self.source.extent() / 1024.0;
        let meets = |x: u32, y: u32| {
            let (origin, direction) = plan.rays.ray(x, y);
            let mut reach = [0.0, f64::MAX];
            for c in 0..3 {
                let (from, direction) = (f64::from(origin[c]), f64::from(direction[c]));
                let [a, b] = [lo[c] - more - from, hi[c] + more - from];
                if direction == 0.0 {
                    reach[1] = if a <= 0.0 && 0.0 <= b { reach[1] } else { -1.0 };
                } else {
                    reach = [reach[0].max((a / direction).min(b / direction)), reach[1].min((a / direction).max(b / direction))];
                }
            }
            reach[0] <= reach[1]
        };
        let seen = |x: u32, y: u32| rays.colors[(y as usize) * width as usize + x as usize][3] < plan.termination;
        (0..height).into_par_iter().map(|y| (0..width).any(|x| seen(x, y) && meets(x, y))).collect()
    }
}

/// The range of no values.
const NO_RANGE: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

fn union(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Whether the cells up to `last` on an axis come before the cells after it on all rays that meet both; `None` if the
/// order differs between rays.
fn low_first(plan: &Plan, grid: &Grid, axis: usize, last: u32) -> Option<bool> {
    let [width, height] = plan.size;
    // Cells are monotone along a ray, so its origin and direction determine which side it can meet first.
    let goes = |x: u32, y: u32| {
        let (origin, direction) = plan.rays.ray(x, y);
        let low = grid.quantize(origin)[axis] <= last;
        [direction[axis] > 0.0 && low, direction[axis] < 0.0 && !low]
    };
    let either = |a: [bool; 2], b: [bool; 2]| [a[0] || b[0], a[1] || b[1]];
    let row = |y: u32| (0..width).fold([false; 2], |all, x| either(all, goes(x, y)));
    match (0..height).into_par_iter().map(row).reduce(|| [false; 2], either) {
        [true, true] => None,
        [_, down] => Some(!down),
    }
}
