//! An LBVH over tetrahedra: Morton codes of box centres, agglomerative bottom-up construction (Apetrei 2014).

use crate::build::{DeviceMesh, KeptMesh, MeshArrays, MeshInput, MeshView};
use crate::error::Result;
use crate::gpu::{Arena, Buffer, BufferRef, DeviceClass, Gpu, Groups, Recorder};
use crate::kernels::{LbvhCodes, LbvhCodesSpec, LbvhLocate, LbvhLocateSpec, LbvhMerge, LbvhMergeSpec};
use crate::layout::{Grid, LbvhNode};
use crate::mesh::On;
use crate::primitives::{Count, SortScratch, cmd_fill, cmd_sort_pairs};
use crate::query::searched::{BinaryTree, Searched, Structure};
use crate::query::{
    LocateOutput, Located, PointInput, Progress, Rendered, Rounds, Sliced, check_tolerance, numbered, render_in, slice_in, until_done,
};
use crate::render::PicturePlan;
use crate::slicing::{Band, Extrapolate, VoxelGrid};
use crate::times::StageTimes;

/// Bits of a code: ten per axis, and one that sorts bad tetrahedra last.
const CODE_BITS: u32 = 31;
/// Most nodes and tetrahedra that a point visits in one dispatch.
const BUDGET: u32 = 16_384;

/// A binary tree over the tetrahedra of a mesh.
#[derive(Debug)]
pub struct Lbvh {
    pub(super) gpu: Gpu,
    pub(super) mesh: KeptMesh,
    /// The grid of the mesh, at the finest level.
    pub(super) grid: Grid,
    pub(super) tree: BinaryTree,
    pub(super) valid: u32,
    times: StageTimes,
    memory: Buffer,
}

/// The arrays of the tree in host memory; see [`LbvhNode`] for references.
#[derive(Clone, Debug, PartialEq)]
pub struct LbvhArrays {
    /// Reference to the root; `u32::MAX` if there are no valid tetrahedra.
    pub root: u32,
    /// Internal nodes, one fewer than valid tetrahedra.
    pub nodes: Vec<LbvhNode>,
    /// The tetrahedron at each place.
    pub ids: Vec<u32>,
}

impl BinaryTree {
    /// Takes the arrays of a tree over this many tetrahedra from an arena.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(arena: &mut Arena, tets: u32) -> Result<Self> {
        let nodes = arena.take(size_of::<LbvhNode>() as u64 * u64::from(tets.saturating_sub(1)))?;
        Ok(Self { nodes, ids: arena.words(u64::from(tets))?, root: arena.words(1)? })
    }
}

/// Scratch memory of the construction.
#[derive(Clone, Copy, Debug)]
pub struct LbvhScratch {
    codes: BufferRef,
    arrivals: BufferRef,
    sort: SortScratch,
}

impl LbvhScratch {
    /// Takes the scratch memory for a mesh of this many tetrahedra.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, tets: u32) -> Result<Self> {
        let sort = SortScratch::carve(gpu, arena, tets, CODE_BITS)?;
        Ok(Self { codes: arena.words(u64::from(tets))?, arrivals: arena.words(u64::from(tets))?, sort })
    }
}

/// Records the construction of a binary tree over the valid tetrahedra of a mesh: nothing is submitted, waited for,
/// allocated or read back.
///
/// The first use of `tree` and `scratch` is a transfer or compute write. `mesh` is read by compute shaders. The last
/// use is a compute write, without a barrier after it.
///
/// # Errors
/// [`crate::Error::Vulkan`] if a pipeline cannot be made.
pub fn cmd_build_lbvh(r: &mut Recorder<'_>, mesh: &MeshView, tree: &BinaryTree, scratch: &LbvhScratch) -> Result<()> {
    let MeshInput { positions, stride, cells, tets, .. } = mesh.input;
    let MeshArrays { grid, bad, boundary, vertices, status, .. } = mesh.arrays;
    let (BinaryTree { nodes, root, ids }, LbvhScratch { codes, arrivals, sort }) = (*tree, *scratch);
    r.stage("lbvh.codes", |r| {
        cmd_fill(r, arrivals, u32::MAX)?;
        r.fill(root, u32::MAX);
        let workgroup = r.gpu().target().each;
        let spec = LbvhCodesSpec { workgroup, ..Default::default() };
        let arguments = LbvhCodes { grid, positions, cells, bad, codes, ids, tets, stride };
        r.dispatch(&arguments, spec, Groups::Count(tets.div_ceil(workgroup)))
    })?;
    r.stage("lbvh.sort", |r| cmd_sort_pairs(r, codes, ids, CODE_BITS, Count::host(tets), &sort))?;
    r.barrier("lbvh.sort → lbvh.merge");
    r.stage("lbvh.merge", |r| {
        // One subgroup (of the size that kernels of baselines have) per workgroup where a memory barrier may act as a
        // control barrier of the workgroup; see the kernel.
        let alone = matches!(DeviceClass::of(r.gpu().report()), DeviceClass::Cpu | DeviceClass::Apple);
        let workgroup = if alone { r.gpu().report().query_subgroup } else { r.gpu().target().each };
        let spec = LbvhMergeSpec { workgroup, ..Default::default() };
        let arguments = LbvhMerge { vertices, cells, boundary, codes, ids, nodes, arrivals, root, status, tets };
        r.dispatch(&arguments, spec, Groups::Count(tets.div_ceil(workgroup)))
    })
}

/// Records point location in a binary tree, for points of three floats each; `rounds` may continue earlier rounds.
/// Reads mesh, tree and points in compute shaders. Writes `output` and `unfinished`, a word that is not 0 if more
/// rounds are needed, in compute shaders and transfers. The fill of `unfinished` comes first, and a barrier follows it;
/// there is none at the end.
///
/// # Errors
/// [`crate::Error::Invalid`] for no rounds, parts of fewer points or a tolerance out of its range, [`crate::Error::TooLarge`]
/// for points of more than 2^31 floats, [`crate::Error::Vulkan`] if the pipeline cannot be made.
pub fn cmd_locate_lbvh(
    r: &mut Recorder<'_>,
    (mesh, tree): (&MeshView, &BinaryTree),
    (points, count): (BufferRef, u32),
    output: &LocateOutput,
    unfinished: BufferRef,
    tolerance: f32,
    rounds: Rounds,
) -> Result<()> {
    rounds.check()?;
    check_tolerance(tolerance)?;
    PointInput { points, stride: 3, count, hints: None, order: None }.check()?;
    output.check(count)?;
    unfinished.check(4, "the word of unfinished points")?;
    let (MeshArrays { grid, boundary, vertices, .. }, cells) = (mesh.arrays, mesh.input.cells);
    let (BinaryTree { nodes, root, ids }, LocateOutput { owners, barycentrics }) = (*tree, *output);
    let workgroup = r.gpu().target().query;
    for round in 0..rounds.count {
        if round > 0 {
            r.barrier("lbvh.locate → lbvh.clear");
        }
        r.fill(unfinished, 0);
        r.barrier("lbvh.clear → lbvh.locate");
        let fresh = u32::from(round == 0 && !rounds.resume);
        let arguments = LbvhLocate {
            grid,
            nodes,
            root,
            ids,
            boundary,
            cells,
            vertices,
            points,
            owners,
            barycentrics,
            unfinished,
            count,
            fresh,
            budget: BUDGET,
            tolerance,
        };
        let spec = LbvhLocateSpec { workgroup, ..Default::default() };
        r.stage("lbvh.locate", |r| r.dispatch(&arguments, spec, Groups::Count(count.div_ceil(workgroup))))?;
    }
    Ok(())
}

impl Lbvh {
    /// Builds the tree in one submission.
    ///
    /// # Errors
    /// [`crate::Error::Memory`], or a failed Vulkan call.
    pub fn build(gpu: &Gpu, mesh: &DeviceMesh) -> Result<Self> {
        mesh.check_device(gpu)?;
        let view = mesh.view();
        let tets = view.input.tets;
        let carve = |a: &mut Arena| BinaryTree::carve(a, tets);
        let (memory, tree) = Arena::reserve(gpu, "olbvh.lbvh.tree", carve)?;
        let carve = |a: &mut Arena| LbvhScratch::carve(gpu, a, tets);
        let (_buffer, scratch) = Arena::reserve(gpu, "olbvh.lbvh.scratch", carve)?;
        let ((), times) = gpu.submit("olbvh.lbvh.build", |r| cmd_build_lbvh(r, &view, &tree, &scratch))?;
        let valid = tets - mesh.status().bad;
        Ok(Self { gpu: gpu.clone(), mesh: mesh.kept(), grid: *mesh.grid(), tree, valid, times, memory })
    }

    /// Bytes of the tree: a node of 32 bytes per split, a word per valid tetrahedron.
    pub fn bytes(&self) -> u64 {
        u64::from(self.valid.saturating_sub(1)) * size_of::<LbvhNode>() as u64 + 4 * u64::from(self.valid)
    }

    /// What the build took.
    pub fn times(&self) -> &StageTimes {
        &self.times
    }

    /// Reads the tree back to host memory.
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

    /// Locates points (relative to the mesh's origin); the owners are those that the octree finds.
    ///
    /// # Errors
    /// [`crate::Error::Memory`], or a failed Vulkan call.
    pub fn locate(&self, points: &[[f32; 3]], tolerance: f32) -> Result<Located> {
        let gpu = &self.gpu;
        let (n, count) = (points.len() as u64, numbered(points.len())?);
        let uploaded = gpu.upload("olbvh.lbvh.points", points)?;
        let carve = |a: &mut Arena| Ok((a.words(n)?, a.take(16 * n)?, a.words(1)?));
        let (memory, (owners, barycentrics, unfinished)) = Arena::reserve(gpu, "olbvh.lbvh.located", carve)?;
        let view = self.mesh.view;
        let (asked, output) = ((uploaded.all(), count), LocateOutput { owners, barycentrics });
        let mut located = Located::default();
        let record = |r: &mut Recorder<'_>, rounds| cmd_locate_lbvh(r, (&view, &self.tree), asked, &output, unfinished, tolerance, rounds);
        until_done(gpu, "olbvh.lbvh.locate", 1, &mut located.times, record, || {
            Ok((gpu.download_one::<u32>(&memory, unfinished)? == 0).then_some(()))
        })?;
        located.owners = gpu.download(&memory, owners.part(0, 4 * n))?;
        located.barycentrics = gpu.download(&memory, barycentrics.part(0, 16 * n))?;
        Ok(located)
    }

    /// Draws a picture as [`crate::query::render`] does; no nodes are skipped.
    ///
    /// # Errors
    /// Those of [`crate::query::render`].
    pub fn render(&self, plan: &PicturePlan, field: (&[f32], On), normals: Option<&[[f32; 3]]>, report: Progress<'_>) -> Result<Rendered> {
        render_in(&self.gpu, &self.searched(), plan, field, normals, report)
    }

    /// Slices the mesh as [`crate::query::slice`] does.
    ///
    /// # Errors
    /// Those of [`crate::query::slice`].
    pub fn slice(
        &self,
        field: Option<(&[f32], On)>,
        voxels: &VoxelGrid,
        extrapolate: Extrapolate,
        report: Progress<'_>,
        sink: &mut dyn FnMut(Band) -> Result<()>,
    ) -> Result<Sliced> {
        slice_in(&self.gpu, (&self.searched(), &self.grid), field, (voxels, extrapolate), report, sink)
    }

    fn searched(&self) -> Searched {
        Searched { mesh: self.mesh.view, structure: Structure::Binary(self.tree) }
    }
}
