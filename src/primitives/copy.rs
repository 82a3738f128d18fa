//! A copy by a kernel, to know how fast the device moves bytes.

use crate::error::Result;
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{CopyVectors, CopyVectorsSpec};

/// Vectors per invocation: enough loads in flight, few enough for a short last tile.
const ROWS: u32 = 8;

/// Copies `from` to `to`, both at multiples of 16 and of as many bytes, a multiple of 16 below 2^32 vectors. No barrier before or after.
///
/// # Errors
/// [`crate::Error::Vulkan`] if a pipeline cannot be made.
pub(crate) fn cmd_copy(r: &mut Recorder<'_>, from: BufferRef, to: BufferRef) -> Result<()> {
    let (workgroup, rows) = (r.gpu().target().each, ROWS);
    let count = (from.size.min(to.size) / 16) as u32;
    r.dispatch(&CopyVectors { from, to, count }, CopyVectorsSpec { workgroup, rows }, Groups::Count(count.div_ceil(workgroup * rows)))
}
