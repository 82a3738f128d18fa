//! Slicing in blocks. The centre of a voxel is located in the block that has its cell. If it lies in no tetrahedron,
//! every block that the voxel's box reaches into reports the closest tetrahedron that touches the box in the block's
//! own cells, and the closest of all is taken. The trees are shared by as many layers as host memory is provided for,
//! since a tree takes longer than a layer.

use super::cut::{Block, Placed, Source};
use super::{ANYWHERE, Cost, Cutter};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::mesh::{Field, Mesh};
use crate::options::BuildOptions;
use crate::query::searched::Searched;
use crate::query::{self, Progress, Sliced, Slicing};
use crate::reference::separate::closest;
use crate::reference::tet::sub;
use crate::slicing::{Band, EMPTY, Extrapolate, INSIDE, Rows, TOUCHED, Tally, VoxelGrid, bands};
use crate::times::StageTimes;
use rayon::prelude::*;
use std::cell::Cell;

/// Voxels that share the trees of a mesh in blocks; each takes 9 bytes of host memory.
const BATCH: u64 = 1 << 24;
/// Bytes of device memory that slicing takes beside a block, at the least: for each voxel of a row, and in addition.
const PER_ROW_VOXEL: u64 = 128;
const RESERVE: u64 = 1 << 16;

/// A stack of layers through a mesh that may not fit the device.
#[derive(Clone, Copy, Debug)]
pub struct SliceRequest<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Options of its trees.
    pub options: BuildOptions,
    /// The field to interpolate.
    pub field: Option<&'a Field>,
    /// The voxels.
    pub voxels: &'a VoxelGrid,
    /// The value that a touched voxel gets.
    pub extrapolate: Extrapolate,
}

/// Slices a mesh as [`query::slice`] does, within the memory limit of `gpu`. Passes the voxels to `sink` band by
/// band, in order. `report` receives the number of voxels done, and of all.
///
/// # Errors
/// Those of [`query::slice`] and [`crate::build::Tree::build`]; [`crate::Error::TooLarge`] with the sizes if the memory
/// is too small for the smallest blocks.
pub fn slice(
    gpu: &Gpu,
    asked: &SliceRequest<'_>,
    report: Progress<'_>,
    sink: &mut dyn FnMut(Band) -> Result<()>,
) -> Result<(Sliced, Cost)> {
    let SliceRequest { mesh, ref options, field, voxels, extrapolate } = *asked;
    let values = field.map(|f| (f.values.as_slice(), f.on));
    field.map_or(Ok(()), |f| f.on.check(&f.values, [mesh.points.len(), mesh.tets.len()]))?;
    let mut cost = Cost::default();
    let tally = Cell::new(Tally::default());
    let mut sink = |band: Band| {
        let mut sum = tally.get();
        sum.add(&band.kinds);
        tally.set(sum);
        sink(band)
    };
    let whole = cost.whole(gpu, mesh, options, |placed| {
        let sliced = query::slice(&placed.tree, values, voxels, extrapolate, report, &mut sink);
        // Once the sink has voxels, it is too late to begin again.
        if tally.get() == Tally::default() { sliced.map(Ok) } else { Ok(sliced) }
    })?;
    if let Some(sliced) = whole {
        return Ok((sliced?, cost.with_peak(gpu)));
    }
    let source = cost.source(gpu, mesh, options)?;
    voxels.check_over(&source.grid)?;
    let (blocks, times) = (vec![source.whole()], StageTimes::default());
    let mut job = Job { gpu, asked, source: &source, blocks, placed: None, cost, times, done: 0.0, report };
    for rows in bands(voxels, BATCH) {
        sink(job.batch(rows)?)?;
    }
    Ok((Sliced { tally: tally.get(), times: job.times }, job.cost.with_peak(gpu)))
}

/// The state of slicing a stack in blocks.
struct Job<'a> {
    gpu: &'a Gpu,
    asked: &'a SliceRequest<'a>,
    source: &'a Source<'a>,
    /// The blocks that the mesh is cut into so far; the last one may be in device memory.
    blocks: Vec<Block>,
    placed: Option<Placed>,
    cost: Cost,
    times: StageTimes,
    /// Voxels done, counted in part while only some of the blocks have been queried.
    done: f64,
    report: Progress<'a>,
}

impl Job<'_> {
    /// Slices these rows with all blocks that they meet. If a block does not fit after all, it is cut and its parts are
    /// queried, which may repeat work but does not change the result.
    fn batch(&mut self, rows: Rows) -> Result<Band> {
        let voxels = self.asked.voxels;
        let n = rows.count as usize * voxels.size[0] as usize;
        let mut all = Band { rows, values: vec![f32::NAN; n], kinds: vec![EMPTY; n], owners: vec![u32::MAX; n] };
        let (begun, end) = (self.done, self.done + n as f64);
        // Starts from the last block, which may already be in device memory.
        let blocks = std::mem::take(&mut self.blocks);
        let share = n as f64 / blocks.len() as f64;
        let mut waiting: Vec<(Block, f64)> = blocks.into_iter().map(|block| (block, share)).collect();
        let [row, layer] = rows.row(0, voxels.size[1]);
        log::debug!("slice: {} rows from row {row} of layer {layer} on, after {begun} voxels", rows.count);
        let beside = RESERVE + PER_ROW_VOXEL * u64::from(voxels.size[0]);
        let cutter = Cutter { gpu: self.gpu, sources: [self.source], beside, may: ANYWHERE };
        while let Some((block, share)) = waiting.pop() {
            let met = block.bounds(self.source).is_some_and(|bounds| voxels.meets(rows, bounds, &self.source.grid));
            match if met { cutter.work_or_halve(&block, || self.visit(&block, &mut all))? } else { None } {
                None => {
                    self.done += share;
                    (self.report)(self.done as u64, voxels.voxels())?;
                    self.blocks.push(block);
                }
                Some([low, high]) => waiting.extend([(high, share / 2.0), (low, share / 2.0)]),
            }
        }
        self.done = end;
        Ok(all)
    }

    /// Queries a block.
    fn visit(&mut self, block: &Block, all: &mut Band) -> Result<()> {
        let SliceRequest { field, voxels, extrapolate, .. } = *self.asked;
        let (grid, level) = (&self.source.grid, self.source.level);
        self.placed.take_if(|there| !there.is(block));
        let placed = match &mut self.placed {
            Some(placed) => placed,
            none => none.insert(self.cost.build(|| block.place(self.gpu, self.source))?),
        };
        let Some(bounds) = block.bounds(self.source) else { return Ok(()) };
        let here = field.map(|f| (placed.values(&f.values, f.on), f.on));
        let here = here.as_ref().map(|(values, on)| (&values[..], *on));
        let tree = &placed.tree;
        let mut slicing =
            Slicing::new(self.gpu, (&Searched::from(tree), tree.grid()), here, (voxels, extrapolate), Some(block.cells.finest(level)))?;
        let width = voxels.size[0] as usize;
        let mut at = 0;
        for rows in all.rows.parts(slicing.rows, voxels.size[1]) {
            let n = rows.count as usize * width;
            if voxels.meets(rows, bounds, grid) {
                let mut band = slicing.band(rows)?;
                band.owners.iter_mut().for_each(|t| *t = placed.tet(*t));
                merge(self.source, voxels, all, at, &band);
            }
            at += n;
        }
        self.times.add(slicing.sliced.times);
        log::debug!("slice: a block of {} tetrahedra", block.tets.len());
        Ok(())
    }
}

/// Merges a block's result for some voxels, starting at number `at`, into that of all blocks.
fn merge(source: &Source<'_>, voxels: &VoxelGrid, all: &mut Band, at: usize, band: &Band) {
    let (width, height) = (voxels.size[0] as usize, voxels.size[1]);
    let to = at..at + band.kinds.len();
    let rows = all.kinds[to.clone()].par_chunks_mut(width).zip(all.owners[to.clone()].par_chunks_mut(width));
    rows.zip(all.values[to].par_chunks_mut(width)).enumerate().for_each(|(row, ((kinds, owners), values))| {
        let [y, layer] = band.rows.row(row as u32, height);
        for x in 0..width {
            let i = row * width + x;
            let wins = match (kinds[x], band.kinds[i]) {
                (INSIDE, _) | (_, EMPTY) => false,
                (TOUCHED, TOUCHED) => is_closer(source, voxels.centre([x as u32, y, layer]), band.owners[i], owners[x]),
                _ => true,
            };
            if wins {
                (kinds[x], owners[x], values[x]) = (band.kinds[i], band.owners[i], band.values[i]);
            }
        }
    });
}

/// Whether tetrahedron `t` is closer to a voxel's centre than `other`, compared as the kernel does.
fn is_closer(source: &Source<'_>, centre: [f32; 3], t: u32, other: u32) -> bool {
    let Source { mesh, grid, .. } = source;
    let centre = grid.normalise(centre);
    let square = |t: u32| {
        let mut ids = mesh.tets[t as usize];
        ids.sort_unstable();
        closest(&ids.map(|v| sub(grid.normalise(mesh.points[v as usize]), centre))).square
    };
    t != other && (square(t), t) < (square(other), other)
}
