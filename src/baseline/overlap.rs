//! Overlap with LBVHs: every tetrahedron of either mesh descends the other mesh's tree, and leaves lead to the narrow
//! phase.

use super::Lbvh;
use crate::build::DeviceMesh;
use crate::error::Result;
use crate::gpu::{Arena, Buffer, BufferRef, Groups, Recorder};
use crate::kernels::{LbvhOverlap, LbvhOverlapSpec};
use crate::layout::{NodeFrame, OverlapStatus, set_bits, wide};
use crate::query::{Overlapped, Progress};
use crate::reference::overlap::{joint_grid, node_frame};
use std::mem::offset_of;

/// Most nodes and tetrahedra that a search visits in one dispatch.
const BUDGET: u32 = 4096;

/// The search for the tetrahedra of one mesh in the tree of the other.
struct Direction<'a> {
    own: &'a DeviceMesh,
    other: &'a DeviceMesh,
    lbvh: &'a Lbvh,
    frame: Buffer,
    places: BufferRef,
    hits: BufferRef,
    status: BufferRef,
}

impl Direction<'_> {
    fn cmd_search(&self, r: &mut Recorder<'_>) -> Result<()> {
        let (own, other, tree) = (self.own.input(), self.other.input(), &self.lbvh.tree);
        let arguments = LbvhOverlap {
            grid: self.other.arrays().grid,
            nodes: tree.nodes,
            root: tree.root,
            ids: tree.ids,
            cells: other.cells,
            vertices: self.other.arrays().vertices,
            positions: other.positions,
            own_cells: own.cells,
            own_positions: own.positions,
            bad: self.own.arrays().bad,
            frame: self.frame.all(),
            places: self.places,
            hits: self.hits,
            status: self.status,
            tets: own.tets,
            budget: BUDGET,
        };
        let workgroup = r.gpu().target().query;
        let spec = LbvhOverlapSpec { workgroup, own_stride: own.stride, stride: other.stride, ..Default::default() };
        r.dispatch(&arguments, spec, Groups::Count(own.tets.div_ceil(workgroup)))
    }
}

impl Lbvh {
    /// Finds the tetrahedra of this tree's mesh and of another's that intersect the other mesh; the points of both are
    /// in one coordinate system. `report` receives the number of tetrahedra done, and of all.
    ///
    /// # Errors
    /// [`crate::Error::Memory`], or a failed Vulkan call.
    pub fn overlap(&self, mesh: &DeviceMesh, other: &Self, other_mesh: &DeviceMesh, report: Progress<'_>) -> Result<Overlapped> {
        mesh.check(&self.mesh)?;
        other_mesh.check(&other.mesh)?;
        other_mesh.check_device(mesh.gpu())?;
        let gpu = &self.gpu;
        let mut done = Overlapped::default();
        let valid = [self.valid > 0, other.valid > 0];
        if valid.contains(&false) {
            return Ok(done);
        }
        let joint = joint_grid(mesh.grid(), other_mesh.grid(), valid);
        let carve = |a: &mut Arena| {
            let mut direction = |m: &DeviceMesh| {
                let tets = u64::from(m.input().tets);
                Ok((a.words(tets)?, a.words(tets.div_ceil(32))?, a.take(size_of::<OverlapStatus>() as u64)?))
            };
            Ok([direction(mesh)?, direction(other_mesh)?])
        };
        let memory = gpu.buffer("olbvh.lbvh.overlap", Arena::measure(carve)?)?;
        let [forth, back] = carve(&mut Arena::new(memory.all()))?;
        let direction = |own, other: (_, _), (places, hits, status)| {
            let (other, lbvh): (&DeviceMesh, _) = other;
            let frame = gpu.upload::<NodeFrame>("olbvh.lbvh.overlap_frame", &[node_frame(other.grid(), &joint)])?;
            Ok::<_, crate::Error>(Direction { own, other, lbvh, frame, places, hits, status })
        };
        let directions = [direction(mesh, (other_mesh, other), forth)?, direction(other_mesh, (mesh, self), back)?];
        let all = u64::from(mesh.input().tets) + u64::from(other_mesh.input().tets);
        let statuses = loop {
            let ((), time) = gpu.submit("olbvh.lbvh.overlap", |r| {
                for direction in &directions {
                    if done.submissions == 0 {
                        for part in [direction.places, direction.hits, direction.status] {
                            r.fill(part, 0);
                        }
                    } else {
                        r.fill(direction.status.part(offset_of!(OverlapStatus, unfinished) as u64, 4), 0);
                    }
                }
                r.barrier("lbvh.clear → lbvh.overlap");
                r.stage("lbvh.overlap", |r| directions.iter().try_for_each(|w| w.cmd_search(r)))
            })?;
            done.submissions += 1;
            done.stages.extend(time.stages);
            let mut statuses = [OverlapStatus::default(); 2];
            for (status, direction) in statuses.iter_mut().zip(&directions) {
                *status = gpu.download_one(&memory, direction.status)?;
            }
            let unfinished = statuses.iter().map(|s| u64::from(s.unfinished)).sum::<u64>();
            report(all - unfinished, all);
            if unfinished == 0 {
                break statuses;
            }
        };
        let hits = |direction: &Direction<'_>| Ok::<_, crate::Error>(set_bits(gpu.download(&memory, direction.hits)?));
        (done.overlap.a, done.overlap.b) = (hits(&directions[0])?, hits(&directions[1])?);
        for (effort, status) in done.overlap.effort.iter_mut().zip(statuses) {
            effort.narrow = wide(status.narrow);
        }
        Ok(done)
    }
}
