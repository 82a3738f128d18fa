//! Rendering in blocks, front to back: of the two sides of a cut, the one that rays come from is rendered first, so
//! each ray meets its blocks in order and continues in each from its state after the previous one. A sample is taken by
//! the block that has its cell. Between blocks, rays are in host memory.

use super::cut::{Block, Placed, Source};
use super::{Cost, Cutter};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::layout::Grid;
use crate::mesh::{Field, Mesh, On};
use crate::options::BuildOptions;
use crate::query::{self, Canvas, Progress, Rays, Rendered};
use crate::reference::ranges::visible;
use crate::render::{PicturePlan, Prepared, RayGrid, RenderSettings, RenderStats, ValidTets};
use crate::times::StageTimes;
use rayon::prelude::*;
use std::ops::Range;

/// Bytes of device memory that rendering takes beside a block, at the least: for each column of the picture (of which
/// it draws a strip at a time), and in addition.
const PER_COLUMN: u64 = 1024;
const RESERVE: u64 = 1 << 17;

/// The field of a mesh that may not fit the device, and how to render it.
#[derive(Clone, Copy, Debug)]
pub struct RenderRequest<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Options of its trees.
    pub options: BuildOptions,
    /// The field that is rendered.
    pub field: &'a Field,
    /// Settings of the picture.
    pub settings: &'a RenderSettings,
}

/// A picture, and what it was drawn by.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The colours, and what they took.
    pub rendered: Rendered,
    /// What they were drawn by.
    pub prepared: Prepared,
}

/// Renders a picture as [`query::render`] does, within the memory limit of `gpu`. `report` receives the number of rays
/// done and of all; for a mesh in blocks, how many millionths of the work are done, and a million.
///
/// # Errors
/// Those of [`query::render`], [`Prepared::new`] and [`crate::build::Tree::build`]; [`crate::Error::TooLarge`] with the
/// sizes if the memory is too small for the smallest blocks.
pub fn render(gpu: &Gpu, asked: &RenderRequest<'_>, report: Progress<'_>) -> Result<(Picture, Cost)> {
    let RenderRequest { mesh, ref options, field, .. } = *asked;
    field.on.check(&field.values, [mesh.points.len(), mesh.tets.len()])?;
    let mut cost = Cost::default();
    let whole = cost.whole(gpu, mesh, options, |placed| render_whole(placed, asked, report))?;
    let picture = if let Some(picture) = whole { picture } else { render_in_blocks(gpu, asked, report, &mut cost)? };
    Ok((picture, cost.with_peak(gpu)))
}

fn render_whole(placed: &Placed, asked: &RenderRequest<'_>, report: Progress<'_>) -> Result<Picture> {
    let (Placed { mesh, tree, .. }, RenderRequest { field, settings, .. }) = (placed, asked);
    let prepared = query::prepare_picture(mesh, asked.mesh, field, settings)?;
    let rendered = query::render(tree, &prepared.plan, (&field.values, field.on), Some(&prepared.normals), report)?;
    Ok(Picture { rendered, prepared })
}

fn render_in_blocks(gpu: &Gpu, asked: &RenderRequest<'_>, report: Progress<'_>, cost: &mut Cost) -> Result<Picture> {
    let RenderRequest { mesh, ref options, field, settings } = *asked;
    let source = cost.source(gpu, mesh, options)?;
    // Light and opacity of a volume depend on which points are on the mesh surface; those of iso-surfaces do not.
    let neighbours = if settings.iso.is_empty() { source.neighbours() } else { Vec::new() };
    let valid = ValidTets { bounds: (&source.grid).into(), neighbours: &neighbours, is_valid: &|t| source.topology.is_valid(t) };
    let prepared = Prepared::new(settings, mesh, &valid, field)?;
    drop(neighbours);
    let mut rays = Rays::new(prepared.plan.size)?;
    let order = &Order::new(&prepared.plan, &source.grid);
    let (stats, times) = (RenderStats::default(), StageTimes::default());
    let mut job = Job { gpu, source: &source, field, prepared: &prepared, order, stats, times, cost };
    let mut waiting = vec![(source.whole(), 1.0)];
    let mut done = 0.0;
    while let Some((block, share)) = waiting.pop() {
        match job.visit(&block, &mut rays)? {
            None => {
                done += share;
                report((done * 1e6) as u64, 1_000_000)?;
            }
            Some([near, far]) => waiting.extend([(far, share / 2.0), (near, share / 2.0)]),
        }
    }
    let rendered = Rendered { colors: rays.colors, stats: job.stats, times: job.times };
    Ok(Picture { rendered, prepared })
}

/// The state of rendering a picture in blocks.
struct Job<'a> {
    gpu: &'a Gpu,
    source: &'a Source<'a>,
    field: &'a Field,
    prepared: &'a Prepared,
    order: &'a Order,
    stats: RenderStats,
    times: StageTimes,
    cost: &'a mut Cost,
}

impl Job<'_> {
    /// Renders a block, or cuts it and returns the nearer part and the farther one. A block with nothing to see is
    /// skipped.
    fn visit(&mut self, block: &Block, rays: &mut Rays) -> Result<Option<[Block; 2]>> {
        let met = if self.shows(block) { self.rows_met(block, rays) } else { Vec::new() };
        if !met.contains(&true) {
            return Ok(None);
        }
        let order = self.order;
        let may = |axis: usize, last: u32| order.low_first(axis, last).is_some();
        let beside = RESERVE + PER_COLUMN * u64::from(self.prepared.plan.size[0]);
        let cutter = Cutter { gpu: self.gpu, sources: [self.source], beside, may: &may };
        let Some([low, high]) = cutter.work_or_halve(block, || self.draw(block, &met, rays))? else { return Ok(None) };
        let finest = low.cells.finest(self.source.level).hi;
        let axis = (0..3).find(|&c| low.cells.hi[c] < high.cells.lo[c]).unwrap_or(0);
        Ok(Some(if order.low_first(axis, finest[axis]) == Some(false) { [high, low] } else { [low, high] }))
    }

    /// Renders a block's part of the picture. Work that was done before a failure is not repeated by the block's parts.
    fn draw(&mut self, block: &Block, met: &[bool], rays: &mut Rays) -> Result<()> {
        let (Field { values, on, .. }, Prepared { plan, normals, .. }) = (self.field, self.prepared);
        let placed = self.cost.build(|| block.place(self.gpu, self.source))?;
        let (values, normals) = (placed.values(values, *on), (!normals.is_empty()).then(|| placed.values(normals, On::Points)));
        let canvas = Canvas::new(self.gpu, &(&placed.tree).into(), plan, (&values, *on), normals.as_deref(), true)?;
        let (stats, times) = canvas.draw_part(block.cells.finest(self.source.level), met, rays)?;
        self.stats += stats;
        self.times.add(times);
        log::debug!("a block of {} tetrahedra, {} samples", block.tets.len(), stats.samples);
        Ok(())
    }

    /// Whether a block contains values that are visible. An iso-surface may lie between the samples of two blocks, so
    /// with iso-surfaces no block can be left out.
    fn shows(&self, block: &Block) -> bool {
        let PicturePlan { iso, visible_values, .. } = &self.prepared.plan;
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
        let box_around = [lo.map(|x| x - more), hi.map(|x| x + more)];
        // Iso-surfaces on this side of a clip may need a sample beyond it.
        if plan.iso.is_empty() && plan.clips.iter().any(|&clip| is_beyond(clip, box_around)) {
            return vec![false; height as usize];
        }
        let seen = |x: u32, y: u32| rays.colors[(y as usize) * width as usize + x as usize][3] < plan.termination;
        (0..height).into_par_iter().map(|y| any_meets(&plan.rays, box_around, 0..width, y, &|x| seen(x, y))).collect()
    }
}

/// The range of no values.
const NO_RANGE: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

fn union(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Whether a box lies beyond a clip as a whole.
fn is_beyond([x, y, z, d]: [f32; 4], [lo, hi]: [[f64; 3]; 2]) -> bool {
    let nearest: f64 = [x, y, z].into_iter().map(f64::from).zip(lo.into_iter().zip(hi)).map(|(n, (lo, hi))| (n * lo).min(n * hi)).sum();
    nearest > f64::from(d)
}

/// Whether any of these pixels of a row is `seen` and has a ray that may meet a box. Spans of pixels are halved as long
/// as one of their rays may meet it.
fn any_meets(rays: &RayGrid, box_around: [[f64; 3]; 2], pixels: Range<u32>, y: u32, seen: &dyn Fn(u32) -> bool) -> bool {
    let (first, end) = (pixels.start, pixels.end);
    if end - first <= 16 {
        return pixels.into_iter().any(|x| seen(x) && may_meet(rays, box_around, [x, x], y));
    }
    let middle = first.midpoint(end);
    may_meet(rays, box_around, [first, end - 1], y)
        && [first..middle, middle..end].into_iter().any(|half| any_meets(rays, box_around, half, y, seen))
}

/// Whether the ray of any of the pixels from the first to the last of these may meet a box. Between the two, origins and
/// directions lie between theirs on each axis, if a direction may have any length, but for rounding.
fn may_meet(rays: &RayGrid, [lo, hi]: [[f64; 3]; 2], ends: [u32; 2], y: u32) -> bool {
    const ROUNDING: f64 = 1e-6;
    let ends = ends.map(|x| rays.ray(x, y));
    let mut reach = [0.0, f64::MAX];
    // Keeps the distances t at which t·speed ≥ way.
    let mut keep = |speed: f64, way: f64| {
        if speed > 0.0 {
            reach[0] = reach[0].max(way / speed);
        } else if speed < 0.0 {
            reach[1] = reach[1].min(way / speed);
        } else if way > 0.0 {
            reach[1] = -1.0;
        }
    };
    for c in 0..3 {
        let [from, speed] = [ends.map(|(origin, _)| f64::from(origin[c])), ends.map(|(_, direction)| f64::from(direction[c]))];
        keep(speed[0].max(speed[1]) + ROUNDING, lo[c] - from[0].max(from[1]));
        keep(ROUNDING - speed[0].min(speed[1]), from[0].min(from[1]) - hi[c]);
    }
    reach[0] <= reach[1]
}

/// On each axis, the least cell of the origins of rays that go up, and the greatest cell of those of rays that go down.
struct Order {
    least_up: [u32; 3],
    greatest_down: [Option<u32>; 3],
}

impl Order {
    fn new(plan: &PicturePlan, grid: &Grid) -> Self {
        let [width, height] = plan.size;
        let none = || Self { least_up: [u32::MAX; 3], greatest_down: [None; 3] };
        let with = |mut all: Self, (x, y): (u32, u32)| {
            let (origin, direction) = plan.rays.ray(x, y);
            let cell = grid.quantize(origin);
            for c in 0..3 {
                if direction[c] > 0.0 {
                    all.least_up[c] = all.least_up[c].min(cell[c]);
                } else if direction[c] < 0.0 {
                    all.greatest_down[c] = all.greatest_down[c].max(Some(cell[c]));
                }
            }
            all
        };
        let both = |a: Self, b: Self| Self {
            least_up: [0, 1, 2].map(|c| a.least_up[c].min(b.least_up[c])),
            greatest_down: [0, 1, 2].map(|c| a.greatest_down[c].max(b.greatest_down[c])),
        };
        (0..height).into_par_iter().map(|y| (0..width).fold(none(), |all, x| with(all, (x, y)))).reduce(none, both)
    }

    /// Whether the cells up to `last` on an axis come before the cells after it on all rays that meet both; `None` if
    /// the order differs between rays. Cells are monotone along a ray, so its origin and direction determine which side
    /// it can meet first.
    fn low_first(&self, axis: usize, last: u32) -> Option<bool> {
        let (up, down) = (self.least_up[axis] <= last, self.greatest_down[axis].is_some_and(|cell| cell > last));
        if up && down { None } else { Some(!down) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Bounds;
    use crate::render::CameraSpec;

    const BOUNDS: Bounds = Bounds { lo: [0.0; 3], hi: [10.0, 8.0, 6.0] };
    const SIZE: [u32; 2] = [61, 43];

    /// The rays of pictures from outside, from within, and with a wide angle.
    fn cameras() -> impl Iterator<Item = RayGrid> {
        let specs = [
            "iso",
            "front,ortho",
            "azimuth=200,elevation=-35,zoom=3",
            "azimuth=70,elevation=40,ortho,zoom=0.5",
            "eye=5,4,3,target=1,2,6,fov=100",
            "eye=9,1,1,target=0,8,6,fov=170",
        ];
        specs
            .map(|spec| spec.parse::<CameraSpec>().unwrap().resolve(&BOUNDS, [0.0; 3], 61.0 / 43.0).unwrap().rays(SIZE, &BOUNDS))
            .into_iter()
    }

    #[test]
    fn spans_of_pixels_miss_no_ray() {
        let (mut met, mut clear) = (0, 0);
        for rays in cameras() {
            let meets = |[lo, hi]: [[f64; 3]; 2], x: u32, y: u32| {
                let (from, way) = rays.ray(x, y);
                let t = |c: usize| [lo[c], hi[c]].map(|side| (side - f64::from(from[c])) / f64::from(way[c]));
                let [enter, leave] =
                    [0, 1, 2].map(t).into_iter().fold([0.0, f64::MAX], |[a, b], [s, t]| [s.min(t).max(a), s.max(t).min(b)]);
                enter <= leave
            };
            for i in 0..60 {
                let lo = [0, 1, 2].map(|c| f64::from((i * 7 + c * 5 + i * c) % 11) * 0.8);
                let around = [lo, lo.map(|x| x + 0.3 * f64::from(i % 5))];
                for y in (0..SIZE[1]).step_by(3) {
                    let is = (0..SIZE[0]).any(|x| meets(around, x, y));
                    let found = any_meets(&rays, around, 0..SIZE[0], y, &|_| true);
                    assert!(found || !is, "{around:?}, row {y}");
                    assert!(!any_meets(&rays, around, 0..SIZE[0], y, &|_| false));
                    (met, clear) = (met + u32::from(is), clear + u32::from(!found));
                }
            }
        }
        assert!(met > 200 && clear > 500, "{met} rows met, {clear} found clear");
    }

    #[test]
    fn cuts_are_in_the_order_of_all_rays() {
        let grid = Grid::new([0.0; 3], [10.0, 8.0, 6.0]);
        // From a single eye, or in a single direction, all rays agree.
        let mut answers = [0; 2];
        for rays in cameras() {
            let settings = RenderSettings { size: SIZE, ..RenderSettings::default() };
            let plan = PicturePlan { rays, ..PicturePlan::new(&settings, &BOUNDS, [0.0; 3], Some([0.0, 1.0])).unwrap() };
            let order = Order::new(&plan, &grid);
            let all: Vec<_> = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| rays.ray(x, y))).collect();
            for (axis, last) in [0, 1, 2].into_iter().flat_map(|axis| (0..1023).step_by(31).map(move |last| (axis, last))) {
                let starts = |low: bool| move |origin: [f32; 3]| (grid.quantize(origin)[axis] <= last) == low;
                let up = all.iter().any(|&(origin, direction)| direction[axis] > 0.0 && starts(true)(origin));
                let down = all.iter().any(|&(origin, direction)| direction[axis] < 0.0 && starts(false)(origin));
                let expected = if up && down { None } else { Some(!down) };
                assert_eq!(order.low_first(axis, last), expected);
                answers[usize::from(expected.unwrap())] += 1;
            }
        }
        assert!(answers.iter().all(|&n| n > 20), "{answers:?}");
    }
}
