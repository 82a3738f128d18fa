//! Trees in the shaders of other programs: the GLSL that they include, and what the host gives it.
//!
//! # A page of guide
//! 1. Make [`OLBVH`] available to your shader compiler as `olbvh.glsl` (it is checked in as `include/olbvh.glsl` as well), and include it in any stage
//!    as the first thing after `#version`. Everything in it is called `olbvh_…` or `OLBVH_…`.
//! 2. Fill a buffer with [`SceneBuffers::addresses`], once: they stay as long as the arrays lie where they are. Its device address, a `uvec2`, is the tree:
//!    hand it to the shader as you like, call `olbvh_open(tree)` once per invocation, and then
//!
//!    | function | gives |
//!    |---|---|
//!    | `uint olbvh_locate(vec3 place, float tolerance, out vec4 weights)` | owner of a point or `OLBVH_NONE`, barycentric coordinates; a tolerance of 1e-5 is usual |
//!    | `uint olbvh_owners(vec3 place, out uint owners[OLBVH_OWNERS])` | how many contain it, and the first of them; `OLBVH_OWNERS` is 32 unless you define it |
//!    | `float olbvh_value(uint owner, vec4 weights)` | value of the field, which has a float per point; NaN without one |
//!    | `vec3 olbvh_gradient(uint owner)` | its gradient |
//!    | `bool olbvh_traverse()` | the paper's traversal, if you define `OLBVH_TRAVERSE`, and below the inclusion `bool olbvh_visit_node(olbvh_Node)` (descend?) and `bool olbvh_visit_leaf(olbvh_Node)` (done?) |
//!
//! 3. Without buffer addresses define `OLBVH_DESCRIPTORS`, and bind [`SceneBuffers::list`] as storage buffers of set `OLBVH_SET` from binding
//!    `OLBVH_BINDING` on; the argument of `olbvh_open` means nothing then.
//! 4. Mesh and tree must be visible to your stage: after [`crate::build::cmd_build`] put a barrier from compute and transfer writes to shader reads.
//!    On a queue of another family besides a semaphore and, with exclusive sharing, a transfer of ownership.
//!
//! From C `olbvh_scene_arrays` gives addresses and bindings, and `olbvh_tree_info` the tree of a mesh in memory of our own.
//!
//! Several trees: call `olbvh_open` again. Answers are the same bytes as those of [`crate::query::locate`]. A leaf's list is searched in one go, so on
//! drivers that watch the time of a draw prefer a small α, or `Lists::Boundary`.

use crate::build::{MeshView, TreeMemory};
use crate::gpu::BufferRef;
pub use crate::layout::SceneAddresses;
use crate::options::Lists;

/// The include file: self-contained GLSL for `#version 460`.
pub const OLBVH: &str = include_str!(concat!(env!("OUT_DIR"), "/olbvh.glsl"));

/// The arrays that `olbvh.glsl` reads.
#[derive(Clone, Copy, Debug)]
pub struct SceneBuffers {
    arrays: [BufferRef; Self::COUNT - 1],
    lists: Lists,
    has_field: bool,
}

impl SceneBuffers {
    /// Storage buffers, the one with the addresses included.
    pub const COUNT: usize = 11;

    /// Of a mesh and its tree, and a field with a float per point.
    pub fn new(mesh: &MeshView, tree: &TreeMemory, field: Option<BufferRef>) -> Self {
        let TreeMemory { grid, masks, co, po, p, flags, lists, .. } = *tree;
        let (cells, vertices, neighbours) = (mesh.input.cells, mesh.arrays.vertices, mesh.arrays.neighbours);
        Self {
            arrays: [grid, masks, co, po, p, flags, cells, vertices, neighbours, field.unwrap_or(grid)],
            lists,
            has_field: field.is_some(),
        }
    }

    /// What the shaders find at the tree's address.
    pub fn addresses(&self) -> SceneAddresses {
        let [grid, masks, co, po, p, flags, cells, vertices, neighbours, field] =
            self.arrays.map(|b| [b.address as u32, (b.address >> 32) as u32]);
        let (lists, has_field) = (u32::from(self.lists == Lists::Boundary), u32::from(self.has_field));
        SceneAddresses { grid, masks, co, po, p, flags, cells, vertices, neighbours, field, lists, has_field }
    }

    /// The storage buffers in the order of their bindings; `addresses` holds what [`Self::addresses`] gives.
    pub fn list(&self, addresses: BufferRef) -> [BufferRef; Self::COUNT] {
        let mut all = [addresses; Self::COUNT];
        all[1..].copy_from_slice(&self.arrays);
        all
    }
}
