//! A copy by a kernel, to measure the device's memory bandwidth.

use crate::error::Result;
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{CopyVectors, CopyVectorsSpec};

/// Vectors per invocation: enough loads in flight, and few enough for a short last tile.
const ROWS: u32 = 8;

/// Copies `from` to `to`. Both lie at multiples of 16 bytes and have the same size, a multiple of 16 and below 2^32
/// vectors. No barrier before or after.
///
/// # Errors
/// [`crate::Error::Vulkan`] if a pipeline cannot be made.
pub(crate) fn cmd_copy(r: &mut Recorder<'_>, from: BufferRef, to: BufferRef) -> Result<()> {
    let (workgroup, rows) = (r.gpu().target().each, ROWS);
    let count = (from.size.min(to.size) / 16) as u32;
    r.dispatch(&CopyVectors { from, to, count }, CopyVectorsSpec { workgroup, rows }, Groups::Count(count.div_ceil(workgroup * rows)))
}
