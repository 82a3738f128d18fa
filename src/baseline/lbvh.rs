//! LBVH over tetrahedra: Morton codes of box centres, agglomerative bottom-up construction (Apetrei 2014). On lavapipe 22.3.6 it finds nothing.

use crate::build::{DeviceMesh, MeshInput};
use crate::error::Result;
use crate::gpu::{Buffer, BufferRef, Gpu, Groups, Recorder, StageTime};
use crate::kernels::{LbvhCodes, LbvhCodesSpec, LbvhLocate, LbvhLocateSpec, LbvhMerge, LbvhMergeSpec};
use crate::layout::LbvhNode;
use crate::primitives::{Arena, Count, SortScratch, cmd_sort_pairs};
use crate::query::{LocateOutput, PointInput};

/// Bits of a code: ten per axis, and one that puts bad cells last.
const CODE_BITS: u32 = 31;

/// A binary tree over the tetrahedra of a mesh.
#[derive(Debug)]
pub struct Lbvh {
    nodes: BufferRef,
    ids: BufferRef,
    root: BufferRef,
    bytes: u64,
    stages: Vec<StageTime>,
    _memory: Buffer,
}

impl Lbvh {
    /// Builds the tree in one submission.
    ///
    /// # Errors
    /// [`crate::Error::Memory`], or a failed Vulkan call.
    pub fn build(gpu: &Gpu, mesh: &DeviceMesh) -> Result<Self> {
        let MeshInput { positions, stride, cells, tets, .. } = *mesh.input();
        let (grid, bad) = (mesh.arrays().grid, mesh.arrays().bad);
        let valid = tets - mesh.status().bad;
        let carve = |a: &mut Arena| Ok((a.take(32 * u64::from(tets))?, a.words(u64::from(tets))?, a.words(1)?));
        let memory = gpu.buffer("olbvh.lbvh.tree", Arena::measure(carve)?)?;
        let (nodes, ids, root) = carve(&mut Arena::new(memory.all()))?;
        let carve =
            |a: &mut Arena| Ok((a.words(u64::from(tets))?, a.words(u64::from(tets))?, SortScratch::carve(gpu, a, tets, CODE_BITS)?));
        let scratch = gpu.buffer("olbvh.lbvh.scratch", Arena::measure(carve)?)?;
        let (codes, arrivals, sort) = carve(&mut Arena::new(scratch.all()))?;
        let workgroup = gpu.target().each;
        let ((), time) = gpu.run("olbvh.lbvh.build", |r| {
            r.stage("lbvh.codes", |r| {
                r.fill(arrivals, u32::MAX);
                r.fill(root, u32::MAX);
                let spec = LbvhCodesSpec { workgroup, ..Default::default() };
                let groups = Groups::Count(tets.div_ceil(workgroup));
                r.dispatch(&LbvhCodes { grid, positions, cells, bad, codes, ids, tets, stride }, spec, groups)
            })?;
            r.stage("lbvh.sort", |r| cmd_sort_pairs(r, codes, ids, CODE_BITS, Count::host(tets), &sort))?;
            r.barrier("lbvh.sort → lbvh.merge");
            r.stage("lbvh.merge", |r| {
                let spec = LbvhMergeSpec { workgroup, ..Default::default() };
                let groups = Groups::Count(valid.div_ceil(workgroup));
                r.dispatch(&LbvhMerge { positions, cells, codes, ids, nodes, arrivals, root, tets: valid, stride }, spec, groups)
            })
        })?;
        let bytes = u64::from(valid.saturating_sub(1)) * size_of::<LbvhNode>() as u64 + 4 * u64::from(valid);
        Ok(Self { nodes, ids, root, bytes, stages: time.stages, _memory: memory })
    }

    /// Bytes of the tree: a node of 32 bytes per split, a word per primitive.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Device time of every stage, in order.
    pub fn stages(&self) -> &[StageTime] {
        &self.stages
    }

    /// Records point location: the owners that the octree finds, without hints.
    ///
    /// # Errors
    /// [`crate::Error::Vulkan`] if the pipeline cannot be made.
    pub fn cmd_locate(
        &self,
        r: &mut Recorder<'_>,
        mesh: &DeviceMesh,
        input: &PointInput,
        output: &LocateOutput,
        tolerance: f32,
    ) -> Result<()> {
        let workgroup = r.gpu().target().each;
        let arguments = LbvhLocate {
            grid: mesh.arrays().grid,
            nodes: self.nodes,
            ids: self.ids,
            root: self.root,
            cells: mesh.input().cells,
            vertices: mesh.arrays().vertices,
            points: input.points,
            owners: output.owners,
            barycentrics: output.barycentrics,
            count: input.count,
            stride: input.stride,
            tolerance,
        };
        let spec = LbvhLocateSpec { workgroup, ..Default::default() };
        r.stage("lbvh.locate", |r| r.dispatch(&arguments, spec, Groups::Count(input.count.div_ceil(workgroup))))
    }
}
