//! Marks the nodes in which something is visible; rays skip all others.

use crate::build::{TreeMemory, range_bytes};
use crate::error::Result;
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{Visible, VisibleSpec};

/// Bytes of the marks of this many nodes: one bit each, as for the boundary flags.
pub fn visible_bytes(nodes: u32) -> u64 {
    4 * u64::from(nodes.div_ceil(32))
}

/// Records into `marks` which nodes of a tree have a value within one of the ranges `values` (two floats each,
/// ascending and disjoint, as in [`crate::render::PicturePlan::visible_values`]). `values` consists of the ranges and their
/// number. `marks` has [`visible_bytes`] for the nodes of the tree's capacity. `ranges` are the nodes' ranges as
/// [`crate::build::cmd_ranges`] records them. Compute shaders read and write everything; there is no barrier before or
/// after.
///
/// # Errors
/// [`crate::Error::Invalid`] if a part is too small, [`crate::Error::Vulkan`] if the pipeline cannot be made.
pub fn cmd_visible(r: &mut Recorder<'_>, tree: &TreeMemory, ranges: BufferRef, values: (BufferRef, u32), marks: BufferRef) -> Result<()> {
    let workgroup = r.gpu().target().each;
    let nodes = tree.capacity.nodes;
    ranges.check(range_bytes(nodes), "ranges")?;
    values.0.check(8 * u64::from(values.1), "visible values")?;
    marks.check(visible_bytes(nodes), "marks")?;
    let words = nodes.div_ceil(32);
    let arguments = Visible { status: tree.status, ranges, drawn: values.0, marks, drawn_ranges: values.1 };
    let spec = VisibleSpec { workgroup, ..Default::default() };
    r.stage("query.visible", |r| r.dispatch(&arguments, spec, Groups::Count(words.div_ceil(workgroup))))
}
