//! A fill by a kernel. Drivers for processors perform a transfer's fill on one core, which is slow where memory is
//! touched for the first time.

use crate::error::Result;
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{Fill, FillSpec};

/// Words per invocation: enough stores in flight, and few enough for a short last tile.
const ROWS: u32 = 16;

/// Sets every word of `range`, below 2^32 words, to `value`. For large ranges; [`Recorder::fill`] is for others. No
/// barrier before or after.
///
/// # Errors
/// [`crate::Error::Vulkan`] if a pipeline cannot be made.
pub(crate) fn cmd_fill(r: &mut Recorder<'_>, range: BufferRef, value: u32) -> Result<()> {
    let (workgroup, rows) = (r.gpu().target().each, ROWS);
    let count = (range.size / 4) as u32;
    r.dispatch(&Fill { to: range, count, value }, FillSpec { workgroup, rows }, Groups::Count(count.div_ceil(workgroup * rows)))
}
