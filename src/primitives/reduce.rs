//! Reduction of u32 values: sum, smallest, largest.

use super::Count;
use crate::error::Result;
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{Reduce, ReduceSpec};

/// The operation of a reduction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduction {
    /// Sum modulo 2^32; 0 for no values.
    Add,
    /// Smallest value; `u32::MAX` for no values.
    Min,
    /// Largest value; 0 for no values.
    Max,
}

/// Most partial results of the first pass.
const PARTIALS: u32 = 4096;
/// Bytes of scratch memory.
pub const REDUCE_SCRATCH: u64 = 4 * PARTIALS as u64;

/// Reduces `values` into the word `result`. `scratch` has [`REDUCE_SCRATCH`] bytes.
///
/// Reads `values` and writes `scratch` and `result` in compute shaders, without a barrier before or after. A count in
/// device memory must be visible before.
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
    // Every invocation takes every n-th value; n is large enough to keep the loop short for 2^32 values.
    let workgroup = 64u32.next_multiple_of(gpu.subgroup_size().max(1));
    let spec = ReduceSpec { workgroup, rows: 1, operation: operation as u32 };
    let groups = count.max.div_ceil(gpu.target().scan.tile()).clamp(1, PARTIALS);
    // 1: partial results, one per workgroup. 2: the result, by one workgroup over the partial results.
    r.dispatch(&Reduce { live: count.word(gpu), values, partial: scratch, count: count.max, groups }, spec, Groups::Count(groups))?;
    r.barrier("reduce.partials → reduce.result");
    let partials = Reduce { live: gpu.unbounded(), values: scratch, partial: result, count: groups, groups: 1 };
    r.dispatch(&partials, spec, Groups::Count(1))
}
