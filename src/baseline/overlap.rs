//! Overlap with LBVHs: every tetrahedron of either mesh descends the other mesh's tree, and leaves lead to the narrow
//! phase.

use super::Lbvh;
use crate::error::{Error, Result};
use crate::gpu::{Arena, Buffer, BufferRef, Groups, Recorder};
use crate::kernels::{LbvhOverlap, LbvhOverlapSpec};
use crate::layout::{NodeFrame, OverlapStatus, set_bits, wide};
use crate::query::{Overlapped, Progress, Rounds, until_done};
use crate::reference::overlap::{joint_grid, node_frame};
use std::mem::offset_of;

/// Most nodes and tetrahedra that a search visits in one dispatch.
const BUDGET: u32 = 4096;

/// The search for the tetrahedra of one mesh in the tree of the other.
struct Direction<'a> {
    own: &'a Lbvh,
    other: &'a Lbvh,
    frame: Buffer,
    places: BufferRef,
    hits: BufferRef,
    status: BufferRef,
}

impl Direction<'_> {
    fn cmd_search(&self, r: &mut Recorder<'_>) -> Result<()> {
        let ([own, other], tree) = ([self.own, self.other].map(|lbvh| lbvh.mesh.view), &self.other.tree);
        let arguments = LbvhOverlap {
            grid: other.arrays.grid,
            nodes: tree.nodes,
            root: tree.root,
            ids: tree.ids,
            cells: other.input.cells,
            vertices: other.arrays.vertices,
            positions: other.input.positions,
            own_cells: own.input.cells,
            own_positions: own.input.positions,
            bad: own.arrays.bad,
            frame: self.frame.all(),
            places: self.places,
            hits: self.hits,
            status: self.status,
            tets: own.input.tets,
            budget: BUDGET,
        };
        let workgroup = r.gpu().target().query;
        let spec = LbvhOverlapSpec { workgroup, own_stride: own.input.stride, stride: other.input.stride, ..Default::default() };
        r.dispatch(&arguments, spec, Groups::Count(own.input.tets.div_ceil(workgroup)))
    }
}

impl Lbvh {
    /// Finds the tetrahedra of this tree's mesh and of another's that intersect the other mesh; the points of both are
    /// in one coordinate system. `report` receives the number of tetrahedra done, and of all.
    ///
    /// # Errors
    /// [`Error::Memory`], a failed Vulkan call, or [`Error::Invalid`] for trees on different devices.
    pub fn overlap(&self, other: &Self, report: Progress<'_>) -> Result<Overlapped> {
        let gpu = &self.gpu;
        if !gpu.is_same_device(&other.gpu) {
            return Err(Error::Invalid("the two trees lie on different devices".into()));
        }
        let mut done = Overlapped::default();
        let valid = [self.valid > 0, other.valid > 0];
        if valid.contains(&false) {
            return Ok(done);
        }
        let joint = joint_grid(&self.grid, &other.grid, valid);
        let carve = |a: &mut Arena| {
            let mut direction = |own: &Self| {
                let tets = u64::from(own.mesh.view.input.tets);
                Ok((a.words(tets)?, a.words(tets.div_ceil(32))?, a.take(size_of::<OverlapStatus>() as u64)?))
            };
            Ok([direction(self)?, direction(other)?])
        };
        let memory = gpu.buffer("olbvh.lbvh.overlap", Arena::measure(carve)?)?;
        let [forth, back] = carve(&mut Arena::new(memory.all()))?;
        let direction = |[own, other]: [_; 2], (places, hits, status)| {
            let other: &Self = other;
            let frame = gpu.upload::<NodeFrame>("olbvh.lbvh.overlap_frame", &[node_frame(&other.grid, &joint)])?;
            Ok::<_, Error>(Direction { own, other, frame, places, hits, status })
        };
        let directions = [direction([self, other], forth)?, direction([other, self], back)?];
        let all = [self, other].map(|lbvh| u64::from(lbvh.mesh.view.input.tets)).iter().sum::<u64>();
        let record = |r: &mut Recorder<'_>, rounds: Rounds| {
            for direction in &directions {
                if rounds.resume {
                    r.fill(direction.status.part(offset_of!(OverlapStatus, unfinished) as u64, 4), 0);
                } else {
                    [direction.places, direction.hits, direction.status].into_iter().for_each(|part| r.fill(part, 0));
                }
            }
            r.barrier("lbvh.clear → lbvh.overlap");
            r.stage("lbvh.overlap", |r| directions.iter().try_for_each(|w| w.cmd_search(r)))
        };
        let statuses = until_done(gpu, "olbvh.lbvh.overlap", 1, &mut done.times, record, || {
            let mut statuses = [OverlapStatus::default(); 2];
            for (status, direction) in statuses.iter_mut().zip(&directions) {
                *status = gpu.download_one(&memory, direction.status)?;
            }
            let unfinished = statuses.iter().map(|s| u64::from(s.unfinished)).sum::<u64>();
            report(all.saturating_sub(unfinished), all)?;
            Ok((unfinished == 0).then_some(statuses))
        })?;
        let hits = |direction: &Direction<'_>| Ok::<_, Error>(set_bits(gpu.download(&memory, direction.hits)?));
        (done.overlap.a, done.overlap.b) = (hits(&directions[0])?, hits(&directions[1])?);
        for (effort, status) in done.overlap.effort.iter_mut().zip(statuses) {
            effort.narrow = wide(status.narrow);
        }
        Ok(done)
    }
}
