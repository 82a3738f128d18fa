//! LBVH over tetrahedra: Morton codes of box centres, agglomerative bottom-up construction (Apetrei 2014).

use crate::build::{DeviceMesh, MeshArrays, MeshInput};
use crate::error::Result;
use crate::gpu::{Buffer, Gpu, Groups, StageTime};
use crate::kernels::{LbvhCodes, LbvhCodesSpec, LbvhLocate, LbvhLocateSpec, LbvhMerge, LbvhMergeSpec};
use crate::layout::LbvhNode;
use crate::primitives::{Arena, Count, SortScratch, cmd_sort_pairs};
use crate::query::{BinaryTree, Located, Structure};

/// Bits of a code: ten per axis, and one that puts bad cells last.
const CODE_BITS: u32 = 31;
/// Nodes and candidates that a point may look at in one dispatch.
const BUDGET: u32 = 16_384;

/// A binary tree over the tetrahedra of a mesh.
#[derive(Debug)]
pub struct Lbvh {
    pub(super) gpu: Gpu,
    pub(super) tree: BinaryTree,
    pub(super) valid: u32,
    stages: Vec<StageTime>,
    memory: Buffer,
}

/// The arrays of the tree in host memory; see [`LbvhNode`] for references.
#[derive(Clone, Debug, PartialEq)]
pub struct LbvhArrays {
    /// Reference to the root; all ones: no valid tetrahedra.
    pub root: u32,
    /// Internal nodes, one less than primitives.
    pub nodes: Vec<LbvhNode>,
    /// Tetrahedron at each place.
    pub ids: Vec<u32>,
}

impl Lbvh {
    /// Builds the tree in one submission.
    ///
    /// # Errors
    /// [`crate::Error::Memory`], or a failed Vulkan call.
    pub fn build(gpu: &Gpu, mesh: &DeviceMesh) -> Result<Self> {
        let MeshInput { positions, stride, cells, tets, .. } = *mesh.input();
        let MeshArrays { grid, bad, boundary, vertices, .. } = *mesh.arrays();
        let valid = tets - mesh.status().bad;
        let carve = |a: &mut Arena| {
            let nodes = a.take(size_of::<LbvhNode>() as u64 * u64::from(valid.saturating_sub(1)))?;
            Ok((nodes, a.words(u64::from(tets))?, a.words(1)?))
        };
        let memory = gpu.buffer("olbvh.lbvh.tree", Arena::measure(carve)?)?;
        let (nodes, ids, root) = carve(&mut Arena::new(memory.all()))?;
        let carve =
            |a: &mut Arena| Ok((a.words(u64::from(tets))?, a.words(u64::from(tets))?, SortScratch::carve(gpu, a, tets, CODE_BITS)?));
        let scratch = gpu.buffer("olbvh.lbvh.scratch", Arena::measure(carve)?)?;
        let (codes, arrivals, sort) = carve(&mut Arena::new(scratch.all()))?;
        let ((), time) = gpu.run("olbvh.lbvh.build", |r| {
            r.stage("lbvh.codes", |r| {
                r.fill(arrivals, u32::MAX);
                r.fill(root, u32::MAX);
                let workgroup = gpu.target().each;
                let spec = LbvhCodesSpec { workgroup, ..Default::default() };
                let groups = Groups::Count(tets.div_ceil(workgroup));
                r.dispatch(&LbvhCodes { grid, positions, cells, bad, codes, ids, tets, stride }, spec, groups)
            })?;
            r.stage("lbvh.sort", |r| cmd_sort_pairs(r, codes, ids, CODE_BITS, Count::host(tets), &sort))?;
            r.barrier("lbvh.sort → lbvh.merge");
            r.stage("lbvh.merge", |r| {
                // One subgroup on processors: see the kernel.
                let workgroup = if gpu.report().kind == "cpu" { gpu.subgroup_size() } else { gpu.target().each };
                let spec = LbvhMergeSpec { workgroup, ..Default::default() };
                let arguments = LbvhMerge { vertices, cells, boundary, codes, ids, nodes, arrivals, root, tets: valid };
                r.dispatch(&arguments, spec, Groups::Count(valid.div_ceil(workgroup)))
            })
        })?;
        Ok(Self { gpu: gpu.clone(), tree: BinaryTree { nodes, root, ids }, valid, stages: time.stages, memory })
    }

    /// Bytes of the tree: a node of 32 bytes per split, a word per primitive.
    pub fn bytes(&self) -> u64 {
        u64::from(self.valid.saturating_sub(1)) * size_of::<LbvhNode>() as u64 + 4 * u64::from(self.valid)
    }

    /// Device time of every stage, in order.
    pub fn stages(&self) -> &[StageTime] {
        &self.stages
    }

    /// The tree in host memory.
    ///
    /// # Errors
    /// A failed transfer.
    pub fn download(&self) -> Result<LbvhArrays> {
        let valid = u64::from(self.valid);
        let node_bytes = size_of::<LbvhNode>() as u64 * valid.saturating_sub(1);
        Ok(LbvhArrays {
            root: self.gpu.download(&self.memory, self.tree.root.part(0, 4))?.first().copied().unwrap_or(u32::MAX),
            nodes: self.gpu.download(&self.memory, self.tree.nodes.part(0, node_bytes))?,
            ids: self.gpu.download(&self.memory, self.tree.ids.part(0, 4 * valid))?,
        })
    }

    /// Locates points (relative to the mesh's origin): the owners that the octree finds.
    ///
    /// # Errors
    /// [`crate::Error::Memory`], or a failed Vulkan call.
    pub fn locate(&self, mesh: &DeviceMesh, points: &[[f32; 3]], tolerance: f32) -> Result<Located> {
        let gpu = &self.gpu;
        let n = points.len() as u64;
        let uploaded = gpu.upload("olbvh.lbvh.points", points)?;
        let carve = |a: &mut Arena| Ok((a.words(n)?, a.take(16 * n)?, a.words(1)?));
        let memory = gpu.buffer("olbvh.lbvh.located", Arena::measure(carve)?)?;
        let (owners, barycentrics, unfinished) = carve(&mut Arena::new(memory.all()))?;
        let workgroup = gpu.target().query;
        let count = points.len() as u32;
        let mut located = Located::default();
        let mut fresh = 1;
        loop {
            let arguments = LbvhLocate {
                grid: mesh.arrays().grid,
                nodes: self.tree.nodes,
                root: self.tree.root,
                ids: self.tree.ids,
                boundary: mesh.arrays().boundary,
                cells: mesh.input().cells,
                vertices: mesh.arrays().vertices,
                points: uploaded.all(),
                owners,
                barycentrics,
                unfinished,
                count,
                fresh,
                budget: BUDGET,
                tolerance,
            };
            let ((), time) = gpu.run("olbvh.lbvh.locate", |r| {
                r.fill(unfinished, 0);
                r.barrier("lbvh.clear → lbvh.locate");
                let spec = LbvhLocateSpec { workgroup, ..Default::default() };
                r.stage("lbvh.locate", |r| r.dispatch(&arguments, spec, Groups::Count(count.div_ceil(workgroup))))
            })?;
            located.stages.extend(time.stages);
            fresh = 0;
            if gpu.download::<u32>(&memory, unfinished.part(0, 4))?.first() == Some(&0) {
                break;
            }
        }
        located.owners = gpu.download(&memory, owners.part(0, 4 * n))?;
        located.barycentrics = gpu.download(&memory, barycentrics.part(0, 16 * n))?;
        Ok(located)
    }
}

impl From<&Lbvh> for Structure {
    fn from(lbvh: &Lbvh) -> Self {
        Self::Binary(lbvh.tree)
    }
}
