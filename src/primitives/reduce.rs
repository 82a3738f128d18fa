//! Sum, smallest and largest of u32 values.

use super::Count;
use crate::error::Result;
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{Reduce, ReduceSpec};

/// What a reduction computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduction {
    /// Sum modulo 2^32; 0 of nothing.
    Add,
    /// Smallest; all ones of nothing.
    Min,
    /// Largest; 0 of nothing.
    Max,
}

/// Partials of the first pass.
const PARTIALS: u32 = 4096;
/// Bytes of scratch memory.
pub const REDUCE_SCRATCH: u64 = 4 * PARTIALS as u64;

/// Reduces `values` into the word `result`. `scratch`: [`REDUCE_SCRATCH`] bytes.
///
/// # Errors
/// [`crate::Error::Vulkan`] if a pipeline cannot be made.
pub fn cmd_reduce(
    r: &mut Recorder<'_>,
    operation: Reduction,
    values: BufferRef,
    result: BufferRef,
    count: Count,
    scratch: BufferRef,
) -> Result<()> {
    let gpu = r.gpu();
    // Every invocation takes every n-th value: wide enough that 2^32 values are no long loop.
    let workgroup = 64u32.next_multiple_of(gpu.subgroup_size().max(1));
    let spec = ReduceSpec { workgroup, rows: 1, operation: operation as u32 };
    let groups = count.max.div_ceil(gpu.target().scan.tile()).clamp(1, PARTIALS);
    // 1 — partials: one per workgroup; 2 — result: one workgroup over the partials.
    r.dispatch(&Reduce { live: count.word(gpu), values, partial: scratch, count: count.max, groups }, spec, Groups::Count(groups))?;
    r.barrier("reduce.partials → reduce.result");
    let partials = Reduce { live: gpu.unbounded(), values: scratch, partial: result, count: groups, groups: 1 };
    r.dispatch(&partials, spec, Groups::Count(1))
}
