//! What sets and pairs share: counters, and both trees in one frame.

use crate::error::Result;
use crate::gpu::{ALIGNMENT, Arena, Buffer, BufferRef, Gpu, Groups, Recorder};
use crate::kernels::{OverlapFrames, OverlapFramesSpec};
use crate::layout::{NodeFrame, OverlapStatus};
use crate::options::Assign;
use crate::query::Scene;
use std::mem::offset_of;

/// Words from the counters of one direction to those of the other.
const STRIDE: usize = size_of::<OverlapStatus>().next_multiple_of(ALIGNMENT as usize) / 4;

/// Counters of both directions, and the [`NodeFrame`] of each tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frames {
    pub(super) status: [BufferRef; 2],
    /// The range that contains both of them.
    both: BufferRef,
    pub(super) of: [BufferRef; 2],
}

impl Frames {
    pub(super) fn carve(arena: &mut Arena) -> Result<Self> {
        let (size, stride) = (size_of::<OverlapStatus>() as u64, 4 * STRIDE as u64);
        let both = arena.take(stride + size)?;
        let status = [both.part(0, size), both.part(stride, size)];
        let mut frame = || arena.take(size_of::<NodeFrame>() as u64);
        Ok(Self { status, both, of: [frame()?, frame()?] })
    }

    /// Reads back the counters of both directions.
    pub(super) fn statuses(&self, gpu: &Gpu, memory: &Buffer) -> Result<[OverlapStatus; 2]> {
        let words: Vec<u32> = gpu.download(memory, self.both)?;
        let status = |i: usize| bytemuck::pod_read_unaligned(bytemuck::cast_slice(&words[i * STRIDE..][..size_of::<OverlapStatus>() / 4]));
        Ok([status(0), status(1)])
    }

    /// Records the computation of both frames. Counters must be zeroed; there is no barrier.
    pub(super) fn cmd(&self, r: &mut Recorder<'_>, a: &Scene, b: &Scene) -> Result<()> {
        let arguments = OverlapFrames {
            grid_a: a.tree.grid,
            grid_b: b.tree.grid,
            mesh_a: a.mesh.arrays.status,
            mesh_b: b.mesh.arrays.status,
            tree_a: a.tree.status,
            tree_b: b.tree.status,
            frame_a: self.of[0],
            frame_b: self.of[1],
            status_a: self.status[0],
            status_b: self.status[1],
            tets_a: a.mesh.input.tets,
            tets_b: b.mesh.input.tets,
        };
        r.dispatch(&arguments, OverlapFramesSpec { workgroup: r.gpu().subgroup_size(), ..Default::default() }, Groups::Count(1))
    }
}

/// The counter that is 0 at the start of every round.
pub(super) fn unfinished(status: BufferRef) -> BufferRef {
    status.part(offset_of!(OverlapStatus, unfinished) as u64, 4)
}

/// 1 if the kernels compare two tetrahedra in one leaf only, that of the lower corner of the intersection of their
/// boxes; else 0, because filtered lists may lack one of the two there.
pub(super) fn each_once(scene: &Scene) -> u32 {
    u32::from(scene.tree.assign == Assign::Aabb)
}
