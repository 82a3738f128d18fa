//! The range of a field's values in every node of a tree (a min–max octree). New values need new ranges, but no new
//! tree.

use super::{DeviceMesh, MeshInput, MeshView, Tree, TreeMemory};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferRef, Gpu, Groups, Recorder, StageTime};
use crate::kernels::{MergeRanges, MergeRangesSpec, PushRanges, PushRangesSpec, ScatterRanges, ScatterRangesSpec};
use crate::mesh::On;

/// Bytes of the ranges of `nodes` nodes: the smallest and the largest value of each, as floats.
pub fn range_bytes(nodes: u32) -> u64 {
    8 * u64::from(nodes)
}

/// Rejects a field with fewer values than the mesh has points, or tetrahedra.
pub(crate) fn check_field((values, on): (BufferRef, On), mesh: &MeshInput) -> Result<()> {
    values.check(4 * u64::from(if on == On::Points { mesh.points } else { mesh.tets }), "a field")
}

/// Records the computation of a field's ranges (one float per point or per tetrahedron of the mesh) into `ranges`,
/// which has [`range_bytes`] for the nodes of the tree's capacity. Their definition is in
/// [`mod@crate::reference::ranges`]. Needs no scratch memory.
///
/// The first use of `ranges` is a transfer write. Mesh, tree and field are read by compute shaders. The last use is a
/// compute write, followed by a barrier to compute, transfer and indirect reads.
///
/// # Errors
/// [`Error::Invalid`] if the parts are too small for the field or its ranges, [`Error::TooLarge`] for more nodes than
/// shaders can number, [`Error::Vulkan`] if a pipeline cannot be made.
pub fn cmd_ranges(r: &mut Recorder<'_>, mesh: &MeshView, tree: &TreeMemory, (field, on): (BufferRef, On), ranges: BufferRef) -> Result<()> {
    let (input, bad, workgroup) = (mesh.input, mesh.arrays.bad, r.gpu().target().each);
    let TreeMemory { capacity, status, grid, co, masks, .. } = *tree;
    if capacity.nodes > i32::MAX.cast_unsigned() / 2 {
        return Err(Error::TooLarge(format!("ranges of {} nodes; shaders number {} at most", capacity.nodes, i32::MAX / 2)));
    }
    check_field((field, on), &input)?;
    ranges.check(range_bytes(capacity.nodes), "ranges")?;
    let of_level = |level: u32| Groups::Count(8u64.pow(level).min(u64::from(capacity.nodes)).div_ceil(u64::from(workgroup)) as u32);
    r.stage("build.ranges", |r| {
        r.fill(ranges.part(0, range_bytes(capacity.nodes)), 0);
        r.barrier("ranges.clear → ranges.scatter");
        let scatter = ScatterRanges {
            grid,
            vertices: mesh.arrays.vertices,
            cells: input.cells,
            bad,
            field,
            masks,
            co,
            status,
            ranges,
            tets: input.tets,
        };
        let spec = ScatterRangesSpec { workgroup, on_cells: u32::from(on == On::Cells), ..Default::default() };
        r.dispatch(&scatter, spec, Groups::Count(input.tets.div_ceil(workgroup)))?;
        r.barrier("ranges.scatter → ranges.push");
        for level in 0..capacity.level {
            let spec = PushRangesSpec { workgroup, ..Default::default() };
            r.dispatch(&PushRanges { status, co, ranges, level }, spec, of_level(level))?;
            r.barrier("ranges.upper → ranges.lower");
        }
        for level in (0..=capacity.level).rev() {
            let spec = MergeRangesSpec { workgroup, ..Default::default() };
            r.dispatch(&MergeRanges { status, co, ranges, level }, spec, of_level(level))?;
            r.barrier("ranges.lower → ranges.upper");
        }
        Ok(())
    })
}

/// The ranges of a field in device memory owned by this crate.
#[derive(Debug)]
pub struct FieldRanges {
    gpu: Gpu,
    /// The tree that they are of.
    tree: TreeMemory,
    buffer: Buffer,
    stages: Vec<StageTime>,
}

impl FieldRanges {
    /// Computes the ranges of a field (one value per point or per tetrahedron) over a tree.
    ///
    /// # Errors
    /// [`Error::Memory`], a failed Vulkan call, or [`Error::Invalid`] if the field has the wrong length.
    pub fn new(mesh: &DeviceMesh, tree: &Tree, field: (&[f32], On)) -> Result<Self> {
        let gpu = tree.gpu();
        let buffer = gpu.buffer("olbvh.ranges.values", range_bytes(tree.status().nodes))?;
        let mut made = Self { gpu: gpu.clone(), tree: *tree.memory(), buffer, stages: Vec::new() };
        made.update(mesh, tree, field)?;
        Ok(made)
    }

    /// Recomputes the ranges for new values, in the same memory. The tree must be the one that the ranges were made
    /// for. Work submitted to the queue before may still read the old ranges; work on other queues must have ended.
    ///
    /// # Errors
    /// Those of [`FieldRanges::new`].
    pub fn update(&mut self, mesh: &DeviceMesh, tree: &Tree, (values, on): (&[f32], On)) -> Result<()> {
        mesh.check(tree.mesh())?;
        mesh.check_device(&self.gpu)?;
        on.check(values, mesh.sizes())?;
        if self.tree.status != tree.memory().status {
            return Err(Error::Invalid("the ranges of another tree; make new ones".into()));
        }
        let field = self.gpu.upload("olbvh.ranges.field", values)?;
        let ranges = self.memory();
        let record = |r: &mut Recorder<'_>| {
            r.barrier("ranges.used → ranges.clear");
            cmd_ranges(r, &mesh.view(), tree.memory(), (field.all(), on), ranges)
        };
        self.stages = self.gpu.submit("olbvh.ranges", record)?.1.stages;
        Ok(())
    }

    /// The ranges in device memory: two floats per node.
    pub fn memory(&self) -> BufferRef {
        self.buffer.all()
    }

    /// `[smallest, largest]` of every node, `[∞, −∞]` for a node without a value.
    ///
    /// # Errors
    /// A failed transfer.
    pub fn download(&self) -> Result<Vec<[f32; 2]>> {
        self.gpu.download(&self.buffer, self.memory())
    }

    /// Device time of the last update.
    pub fn stages(&self) -> &[StageTime] {
        &self.stages
    }
}
