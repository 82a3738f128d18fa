//! Point location in blocks.

use super::cut::Placed;
use super::{ANYWHERE, Cost, Cutter, LEAST};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::grid::CellRange;
use crate::layout::NONE;
use crate::mesh::Mesh;
use crate::options::{BuildOptions, POINT_CHUNK};
use crate::query::{self, AllOwners, LocateOptions, Located, Progress, SILENT, numbered};
use crate::reference::locate::place;

/// Bytes of device memory per point during point location, with a reserve.
const PER_POINT: u64 = 128;
/// Locating fewer points at a time is not worth a tree, unless its block is so small that it is not cut.
const FEW: usize = 4096;

/// Points of a mesh that may not fit the device.
#[derive(Clone, Copy, Debug)]
pub struct LocateRequest<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Options of its trees.
    pub options: BuildOptions,
    /// The points, relative to the mesh's origin.
    pub points: &'a [[f32; 3]],
}

/// Finds the owner of each point, as [`query::locate`] without a field does, within the memory limit of `gpu`; for
/// values, see [`crate::reference::locate::Location::value`]. `report` receives the number of points done, and of all.
///
/// # Errors
/// Those of [`query::locate`] and [`crate::build::Tree::build`]; [`Error::TooLarge`] with the sizes if the memory is
/// too small for the smallest blocks, or for 2^32 points and more.
pub fn locate(gpu: &Gpu, asked: &LocateRequest<'_>, how: &LocateOptions, report: Progress<'_>) -> Result<(Located, Cost)> {
    let n = asked.points.len();
    let mut all = Located { owners: vec![NONE; n], barycentrics: vec![[0.0; 4]; n], ..Located::default() };
    let cost = each(gpu, asked, Blocks::OfPoint, report, &mut |ids, points, placed, _| {
        let found = query::locate(&placed.tree, points, None, how, SILENT)?;
        for (k, i) in ids.iter().map(|&i| i as usize).enumerate() {
            (all.owners[i], all.barycentrics[i]) = (placed.tet(found.owners[k]), found.barycentrics[k]);
        }
        all.times.add(found.times);
        Ok(())
    })?;
    Ok((all, cost))
}

/// Finds every tetrahedron that contains each point, as [`query::locate_all`] does, within the memory limit of `gpu`.
/// `report` receives the number of points done, and of all.
///
/// # Errors
/// Those of [`locate`].
pub fn locate_all(gpu: &Gpu, asked: &LocateRequest<'_>, tolerance: f32, report: Progress<'_>) -> Result<(AllOwners, Cost)> {
    let mut all = AllOwners { owners: vec![Vec::new(); asked.points.len()], ..AllOwners::default() };
    let cost = each(gpu, asked, Blocks::OfPoint, report, &mut |ids, points, placed, _| {
        let found = query::locate_all(&placed.tree, points, tolerance, SILENT)?;
        for (&i, owners) in ids.iter().zip(found.owners) {
            all.owners[i as usize] = owners.into_iter().map(|t| placed.tet(t)).collect();
        }
        all.times.add(found.times);
        Ok(())
    })?;
    Ok((all, cost))
}

/// The work on some points (their numbers, then their coordinates) in a block, whose finest cells are given, or the whole
/// mesh. It may be repeated with a part of the points.
pub(super) type Ask<'a> = &'a mut dyn FnMut(&[u32], &[[f32; 3]], &Placed, Option<CellRange>) -> Result<()>;

/// The blocks in which each point is asked about.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Blocks {
    /// The one that it lies in.
    OfPoint,
    /// All of them.
    All,
}

/// Queries the whole mesh, if it fits, or one block after another.
pub(super) fn each(gpu: &Gpu, asked: &LocateRequest<'_>, blocks: Blocks, report: Progress<'_>, ask: Ask<'_>) -> Result<Cost> {
    let all: Vec<u32> = (0..numbered(asked.points.len())?).collect();
    let mut cost = Cost::default();
    let mut job = Job { gpu, asked, done: 0.0, told: 0, ask, report };
    if cost.whole(gpu, asked.mesh, &asked.options, |placed| job.ask(placed, None, &all, 1.0))?.is_none() {
        job.done = 0.0;
        job.in_blocks(all, blocks, &mut cost)?;
    }
    Ok(cost.with_peak(gpu))
}

struct Job<'a> {
    gpu: &'a Gpu,
    asked: &'a LocateRequest<'a>,
    /// Points done so far; of one that several blocks are asked about, their shares.
    done: f64,
    /// The most that was reported: a block that turns out not to fit is done again, and progress waits until then.
    told: u64,
    ask: Ask<'a>,
    report: Progress<'a>,
}

impl Job<'_> {
    /// Queries one block after another about all points.
    fn in_blocks(&mut self, all: Vec<u32>, blocks: Blocks, cost: &mut Cost) -> Result<()> {
        let (gpu, LocateRequest { mesh, ref options, points }) = (self.gpu, *self.asked);
        let source = cost.source(gpu, mesh, options)?;
        // The other points lie so far outside that they have no cell.
        let near: Vec<u32> = all.into_iter().filter(|&i| place(&source.grid, points[i as usize]).is_some()).collect();
        // Of the work on these points, a block has this share; where each point has one block, all of it.
        let mut waiting = vec![(source.whole(), near, 1.0)];
        while let Some((block, ids, share)) = waiting.pop() {
            if ids.is_empty() || block.tets.is_empty() {
                self.advance(ids.len(), share)?;
                continue;
            }
            let before = self.done;
            let cutter = Cutter { gpu, sources: [&source], beside: PER_POINT * FEW.min(ids.len()) as u64, may: ANYWHERE };
            let halves = cutter.work_or_halve(&block, || {
                let placed = cost.build(|| block.place(gpu, &source))?;
                self.ask(&placed, Some(block.cells.finest(source.level)), &ids, share)
            })?;
            let Some([low, high]) = halves else { continue };
            self.done = before;
            let is_low = |&i: &u32| low.cells.contains(source.cell(points[i as usize]));
            let every = blocks == Blocks::All;
            let share = if every { share / 2.0 } else { share };
            let (below, above) = if every { (ids.clone(), ids) } else { ids.into_iter().partition(is_low) };
            waiting.extend([(high, above, share), (low, below, share)]);
        }
        (self.report)(points.len() as u64, points.len() as u64)
    }

    /// Queries the points in chunks that fit the memory that is left.
    fn ask(&mut self, placed: &Placed, cells: Option<CellRange>, ids: &[u32], share: f64) -> Result<()> {
        let input = placed.mesh.input();
        let left = self.gpu.memory_left().saturating_sub(4 * u64::from(input.points.max(input.tets)));
        let most = usize::try_from(left / PER_POINT).unwrap_or(POINT_CHUNK).min(POINT_CHUNK);
        let few = ids.len().min(if input.tets as usize > LEAST { FEW } else { 1 });
        if most < few {
            let (bytes, reason) = (PER_POINT * few as u64, format!("{left} bytes are left"));
            return Err(Error::Memory { name: "olbvh.blocks.points".into(), bytes, reason });
        }
        for chunk in ids.chunks(most.max(1)) {
            let points: Vec<_> = chunk.iter().map(|&i| self.asked.points[i as usize]).collect();
            (self.ask)(chunk, &points, placed, cells)?;
            self.advance(chunk.len(), share)?;
        }
        log::debug!("{} points in {} tetrahedra", ids.len(), input.tets);
        Ok(())
    }

    /// Reports that a share of the work on some points is done.
    fn advance(&mut self, points: usize, share: f64) -> Result<()> {
        self.done += share * points as f64;
        self.told = self.told.max(self.done as u64);
        (self.report)(self.told, self.asked.points.len() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_points_than_can_be_numbered_are_refused() {
        assert_eq!(numbered(0xffff_ffff).unwrap(), u32::MAX);
        let refused = numbered(0x1_0000_0000).unwrap_err();
        assert!(matches!(&refused, Error::TooLarge(why) if why.contains("4294967296 points; ask for 4294967295 at most")), "{refused}");
    }
}
