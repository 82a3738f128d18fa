//! Trees in the shaders of other programs: the GLSL source to include, and the addresses and bindings that the host
//! provides.
//!
//! # Guide
//! 1. Make [`OLBVH`] available to your shader compiler as `olbvh.glsl` (it is also checked in as `include/olbvh.glsl`),
//!    and include it in any stage immediately after `#version` and the macros that are named below. All its names start with
//!    `olbvh_` or `OLBVH_`. Compile for Vulkan 1.2; glslang wants `#extension GL_GOOGLE_include_directive : require`.
//! 2. Fill a buffer with [`SceneBuffers::addresses`] once; they stay valid as long as the arrays stay where they are.
//!    The buffer's usage flags are those of [`crate::gpu::Gpu::usage`]. Its device address, a `uvec2` with the low word
//!    first, whose value is a multiple of 8, identifies the tree: pass it to the shader in any way, call
//!    `olbvh_open(tree)` once per invocation, and then use:
//!
//!    - `uint olbvh_locate(vec3 place, float tolerance, out vec4 weights)`: owner of a point or `OLBVH_NONE`, and its
//!      barycentric coordinates; the usual tolerance is 1e-5
//!    - `uint olbvh_walk(uint from, vec3 start, vec3 end, out vec4 weights, out uvec2 left)`: owner of `end`, reached on a
//!      straight way from `start` in the tetrahedron `from`, as particles move; or `OLBVH_NONE` if the way leads out of
//!      the mesh, by the face of `left.x` that is opposite to its vertex number `left.y`
//!    - `uint olbvh_owners(vec3 place, out uint owners[OLBVH_OWNERS])`: the number of tetrahedra that contain a point,
//!      and the first of them; `OLBVH_OWNERS` is 32 unless you define it
//!    - `float olbvh_value(uint owner, vec4 weights)`: value of the field, which has one float per point; NaN without a
//!      field
//!    - `uvec4 olbvh_corners(uint owner)`: the numbers of its vertices, for further fields in buffers of your own, such as
//!      velocities; `float olbvh_weighed(vec4 weights, vec4 values)` interpolates a component between them
//!    - `vec3 olbvh_gradient(uint owner)`: gradient of the field
//!    - `bool olbvh_traverse()`: the paper's traversal; define `OLBVH_TRAVERSE`, and after the inclusion
//!      `bool olbvh_visit_node(olbvh_Node)` (descend?) and `bool olbvh_visit_leaf(olbvh_Node)` (done?)
//!
//! 3. Without buffer addresses define `OLBVH_DESCRIPTORS`, and bind [`SceneBuffers::list`] as storage buffers of set
//!    `OLBVH_SET`, starting at binding `OLBVH_BINDING`; the argument of `olbvh_open` is then ignored. Check that the device has
//!    `maxPerStageDescriptorStorageBuffers` for [`SceneBuffers::COUNT`] and your own.
//! 4. Mesh and tree must be visible to your stage: after [`crate::build::cmd_build`] record a barrier from compute and
//!    transfer writes to shader reads, and one from your stage to compute shaders and transfers before the tree is built
//!    again in the same memory. A queue of another family also needs a semaphore and, with exclusive sharing, a
//!    transfer of ownership.
//!
//! From C, `olbvh_scene_arrays` returns addresses and bindings, and `olbvh_tree_info` describes a tree in memory owned
//! by the library.
//!
//! To use several trees by address, call `olbvh_open` again. Every function that you call is compiled into your shader
//! as often as you call it, and they are long: call each at one place, in a loop. Answers are the same bytes as those of
//! [`crate::query::locate`]. A leaf's list is searched in one go, so on drivers that limit the time of a draw prefer a
//! small α, or `Lists::Boundary`.

use crate::build::{MeshView, TreeMemory};
use crate::error::Result;
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
    /// Number of storage buffers, including the one with the addresses.
    pub const COUNT: usize = 11;

    /// The arrays of a mesh and its tree, and optionally a field with one float per point.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] for a field with fewer floats.
    pub fn new(mesh: &MeshView, tree: &TreeMemory, field: Option<BufferRef>) -> Result<Self> {
        field.map_or(Ok(()), |field| field.check(4 * u64::from(mesh.input.points), "a field"))?;
        let TreeMemory { grid, masks, co, po, p, flags, lists, .. } = *tree;
        let (cells, vertices, neighbours) = (mesh.input.cells, mesh.arrays.vertices, mesh.arrays.neighbours);
        Ok(Self {
            arrays: [grid, masks, co, po, p, flags, cells, vertices, neighbours, field.unwrap_or(grid)],
            lists,
            has_field: field.is_some(),
        })
    }

    /// The content of the buffer whose address identifies the tree.
    pub fn addresses(&self) -> SceneAddresses {
        let [grid, masks, co, po, p, flags, cells, vertices, neighbours, field] =
            self.arrays.map(|b| [b.address as u32, (b.address >> 32) as u32]);
        let (lists, has_field) = (u32::from(self.lists == Lists::Boundary), u32::from(self.has_field));
        SceneAddresses { grid, masks, co, po, p, flags, cells, vertices, neighbours, field, lists, has_field }
    }

    /// The storage buffers in the order of their bindings; the buffer `addresses` holds [`Self::addresses`].
    pub fn list(&self, addresses: BufferRef) -> [BufferRef; Self::COUNT] {
        let mut all = [addresses; Self::COUNT];
        all[1..].copy_from_slice(&self.arrays);
        all
    }
}
