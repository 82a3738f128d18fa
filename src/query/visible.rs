//! Nodes that have something to see: those that rays need not be followed in are skipped.

use crate::build::TreeMemory;
use crate::error::Result;
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{Visible, VisibleSpec};

/// Bytes of the marks of so many nodes: one bit each, as the boundary flags.
pub fn visible_bytes(nodes: u32) -> u64 {
    4 * u64::from(nodes.div_ceil(32))
}

/// Records which nodes of a tree have a value within one of the ranges `drawn` (two floats each, ascending and apart, as [`crate::render::Plan::drawn`]
/// has them), into `marks`: [`visible_bytes`] for the nodes of the tree's capacity. `ranges` are those that [`crate::build::cmd_ranges`] records. All is
/// read and written by compute shaders; no barrier stands before or behind.
///
/// # Errors
/// [`crate::Error::Vulkan`] if the pipeline cannot be made.
pub fn cmd_visible(r: &mut Recorder<'_>, tree: &TreeMemory, ranges: BufferRef, drawn: (BufferRef, u32), marks: BufferRef) -> Result<()> {
    let workgroup = r.gpu().target().each;
    let words = tree.capacity.nodes.div_ceil(32);
    let arguments = Visible { status: tree.status, ranges, drawn: drawn.0, marks, drawn_ranges: drawn.1 };
    let spec = VisibleSpec { workgroup, ..Default::default() };
    r.stage("query.visible", |r| r.dispatch(&arguments, spec, Groups::Count(words.div_ceil(workgroup))))
}
