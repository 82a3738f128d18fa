//! Direct volume rendering (SPEC 3.3, the paper's §4.2). Twin of `glsl/query/volume_intervals` and `volume_march`.
//!
//! The ray intervals are computed first, from the boundary nodes of the tree alone; then samples are taken within them.
//! [`crate::render`] defines what a sample is and how samples add up. If the transfer function is transparent for some
//! values, nodes without any other values ([`super::ranges`]) are left out of the intervals and skipped within them.
//! The tree only decides which samples need not be taken, so the picture does not depend on it.

mod brute;
mod interval;
mod march;
mod skip;

pub use brute::brute_force;
pub use interval::Intervals;
pub use march::Marcher;
pub use skip::Skips;

use super::boundary::Topology;
use super::locate::Locator;
use super::ranges::{ranges, visible};
use crate::error::{Error, Result};
use crate::grid::CellRange;
use crate::mesh::{Field, Mesh, On};
use crate::render::{MAX_SAMPLES, PicturePlan, Prepared, RenderSettings, RenderStats, ValidTets};
use crate::times::{StageTime, StageTimes};
use crate::tree::TreeArrays;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// What rays gather.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Premultiplied colour and opacity per ray, row 0 on top.
    pub colors: Vec<[f32; 4]>,
    /// Per ray what a depth buffer has where it became opaque; `None` if it did not.
    pub depths: Vec<Option<f32>>,
    /// Numbers of samples.
    pub stats: RenderStats,
    /// Times of the stages, named as on the device.
    pub times: StageTimes,
}

/// What is drawn: a mesh, its tree, a field.
pub struct Drawing<'a> {
    pub(crate) mesh: &'a Mesh,
    pub(crate) topology: &'a Topology,
    pub(crate) tree: &'a TreeArrays,
    pub(crate) field: &'a Field,
    prepared: Prepared,
    /// One bit per node, set if something is visible there; `None` if no value of the field is transparent.
    pub(crate) visible: Option<Vec<u32>>,
    ranges_ms: f64,
    part: CellRange,
    depths: Option<&'a [f32]>,
    /// It has tolerance 0, because with another one it would depend on the leaf whether a point just outside the mesh
    /// counts.
    pub(crate) locator: Locator<'a>,
}

impl<'a> Drawing<'a> {
    /// Prepares to draw `field` as `settings` say. `topology` and `tree` must be those of `mesh`.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the number of the field's values is not that of the mesh's points or tetrahedra, or the
    /// topology is that of another mesh; errors of [`Prepared::new`].
    pub fn new(mesh: &'a Mesh, topology: &'a Topology, tree: &'a TreeArrays, field: &'a Field, settings: &RenderSettings) -> Result<Self> {
        let expected = if field.on == On::Points { mesh.points.len() } else { mesh.tets.len() };
        if field.values.len() != expected || topology.neighbours.len() != mesh.tets.len() {
            let (name, n) = (&field.name, field.values.len());
            return Err(Error::Invalid(format!(
                "field `{name}` has {n} values where the mesh needs {expected}, or the topology is not the mesh's"
            )));
        }
        let is_valid = |tet| topology.is_valid(tet);
        let valid = ValidTets { bounds: (&tree.grid).into(), neighbours: &topology.neighbours, is_valid: &is_valid };
        let prepared = Prepared::new(settings, mesh, &valid, field)?;
        let start = Instant::now();
        let visible =
            prepared.plan.hides(&field.values).then(|| visible(&ranges(mesh, topology, tree, field), &prepared.plan.visible_values));
        let ranges_ms = Duration::as_secs_f64(&start.elapsed()) * 1e3;
        let locator = Locator::new(mesh, topology, tree).with_tolerance(0.0);
        Ok(Self { mesh, topology, tree, field, prepared, visible, ranges_ms, part: CellRange::WHOLE, depths: None, locator })
    }

    /// Turns off skipping: every sample in the mesh is taken, transparent or not.
    #[must_use]
    pub fn without_skipping(mut self) -> Self {
        self.visible = None;
        self
    }

    /// Restricts samples to these cells of the finest grid, as a block draws them if no other block is in front of it.
    #[must_use]
    pub fn within(self, part: CellRange) -> Self {
        Self { part, ..self }
    }

    /// Draws another plan of the same field and settings: from a view that no camera describes.
    #[must_use]
    pub fn seen_in(mut self, plan: PicturePlan) -> Self {
        self.prepared.plan = plan;
        self
    }

    /// Leaves out what lies behind these values of a depth buffer, one per ray, row 0 on top.
    #[must_use]
    pub fn before(self, depths: &'a [f32]) -> Self {
        Self { depths: Some(depths), ..self }
    }

    /// How many steps from its origin the ray of pixel (x, y) is hidden.
    fn limit(&self, x: u32, y: u32) -> f32 {
        let plan = self.plan();
        let depth = self.depths.and_then(|depths| depths.get((y * plan.size[0] + x) as usize));
        depth.map_or(MAX_SAMPLES as f32, |&depth| plan.rays.steps_to(x, y, depth, plan.inverse_step()))
    }

    /// The plan of the picture.
    pub fn plan(&self) -> &PicturePlan {
        &self.prepared.plan
    }

    /// What the plan and the light were made of.
    pub fn prepared(&self) -> &Prepared {
        &self.prepared
    }

    /// [`Drawing::prepared`], to keep.
    pub fn into_prepared(self) -> Prepared {
        self.prepared
    }
}

/// The colours and depths of a row.
type Row<'a> = (&'a mut [[f32; 4]], &'a mut [Option<f32>]);

/// Draws the scene. `report` receives the number of rows done and the number of rows.
///
/// # Errors
/// Those of `report`, which end the call.
pub fn render(scene: &Drawing<'_>, report: &(dyn Fn(u64, u64) -> Result<()> + Sync)) -> Result<Picture> {
    let plan = scene.plan();
    let [width, height] = plan.size;
    let intervals = Intervals::new(scene.tree, scene.visible.as_deref().filter(|_| plan.iso.is_empty()), plan).within(scene.part);
    let [done, samples, skipped, found] = [const { AtomicU64::new(0) }; 4];
    let (interval_ns, march_ns) = (AtomicU64::new(0), AtomicU64::new(0));
    let start = Instant::now();
    let row = |(y, (colors, depths)): (usize, Row<'_>)| -> Result<()> {
        let y = y as u32;
        let begin = Instant::now();
        let spans: Vec<[u32; 2]> = (0..width).map(|x| intervals.of(plan.rays.ray(x, y), scene.limit(x, y))).collect();
        let middle = Instant::now();
        let mut marcher = Marcher::new(scene);
        for (x, ((span, color), depth)) in (0..).zip(spans.into_iter().zip(colors).zip(depths)) {
            let opaque_at;
            (*color, opaque_at) = marcher.march(plan.rays.ray(x, y), scene.limit(x, y), span);
            *depth = opaque_at.and_then(|steps| plan.rays.depth_at(x, y, steps, plan.step));
        }
        interval_ns.fetch_add((middle - begin).as_nanos() as u64, Ordering::Relaxed);
        march_ns.fetch_add(middle.elapsed().as_nanos() as u64, Ordering::Relaxed);
        samples.fetch_add(marcher.samples, Ordering::Relaxed);
        skipped.fetch_add(marcher.skipped_samples, Ordering::Relaxed);
        found.fetch_add(marcher.found_samples, Ordering::Relaxed);
        report(done.fetch_add(1, Ordering::Relaxed) + 1, u64::from(height))
    };
    let (width, pixels) = (width as usize, width as usize * height as usize);
    let (mut colors, mut depths) = (vec![[0.0; 4]; pixels], vec![None; pixels]);
    colors.par_chunks_exact_mut(width).zip(depths.par_chunks_exact_mut(width)).enumerate().try_for_each(row)?;
    // Both stages run side by side on all threads, so the elapsed time is divided in proportion to the time that the
    // threads spent in each.
    let share = |part: &AtomicU64| {
        let all = interval_ns.load(Ordering::Relaxed) + march_ns.load(Ordering::Relaxed);
        part.load(Ordering::Relaxed) as f64 / (all.max(1)) as f64
    };
    let ms = Duration::as_secs_f64(&start.elapsed()) * 1e3;
    let mut times = StageTimes::default();
    let stages =
        [("query.visible", scene.ranges_ms), ("query.intervals", ms * share(&interval_ns)), ("query.march", ms * share(&march_ns))];
    stages.into_iter().for_each(|(name, milliseconds)| times.add_stage(StageTime { name: name.into(), milliseconds }));
    let [samples, skipped_samples, found_samples] = [samples, skipped, found].map(AtomicU64::into_inner);
    Ok(Picture { colors, depths, stats: RenderStats { samples, skipped_samples, found_samples }, times })
}
