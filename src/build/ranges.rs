//! The range of a field's values in every node of a tree (a min–max octree). New values need new ranges, but no new
//! tree.

use super::{MeshInput, MeshView, TreeMemory};
use crate::error::{Error, Result};
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{MergeRanges, MergeRangesSpec, PushRanges, PushRangesSpec, ScatterRanges, ScatterRangesSpec};
use crate::mesh::On;

/// Bytes of the ranges of `nodes` nodes: the smallest and the largest value of each, as floats.
pub fn range_bytes(nodes: u32) -> u64 {
    8 * u64::from(nodes)
}

/// Rejects a field with fewer values than the mesh has points, or tetrahedra.
pub(crate) fn check_field(field: (BufferRef, On), mesh: &MeshInput) -> Result<()> {
    check_components(field, 1, mesh)
}

/// [`check_field`] for a field of several components, next to each other.
pub(crate) fn check_components((values, on): (BufferRef, On), components: u32, mesh: &MeshInput) -> Result<()> {
    let count = u64::from(components) * u64::from(if on == On::Points { mesh.points } else { mesh.tets });
    if count > 1 << 31 {
        return Err(Error::TooLarge(format!("a field of {count} values; shaders number 2^31 floats at most")));
    }
    values.check(4 * count, "a field")
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
    let of_level =
        |level: u32| Groups::Count(8u64.saturating_pow(level).min(u64::from(capacity.nodes)).div_ceil(u64::from(workgroup)) as u32);
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
