//! Queries on the device: point location and closest places (SPEC 3.1, 3.2), volume rendering (3.3), slicing (3.4) and mesh
//! overlap (3.5).

mod all_owners;
mod locate;
mod nearest;
mod order;
mod overlap;
mod slice;
mod visible;
mod volume;

pub use all_owners::{OwnersMemory, cmd_count_owners, cmd_list_owners, locate_all};
pub(crate) use locate::numbered;
pub use locate::{LocateMethod, LocateOptions, LocateOutput, Located, MOST_TRAVERSED, PointInput, cmd_interpolate, cmd_locate, locate};
pub use nearest::{Nearest, NearestMemory, cmd_nearest, nearest};
pub(crate) use order::code_bits;
pub use order::{PointOrder, cmd_sort_points};
pub use overlap::{OverlapInput, OverlapMemory, Overlapped, PairMemory, cmd_count_pairs, cmd_list_pairs, cmd_overlap, overlap};
pub(crate) use slice::Slicing;
pub use slice::{SliceInput, SliceMemory, Sliced, cmd_slice, slice};
pub use visible::{cmd_visible, visible_bytes};
pub(crate) use volume::{Canvas, Rays};
pub use volume::{RenderInput, RenderMemory, RenderPart, Rendered, Visibility, cmd_render, render};

use crate::build::{DeviceMesh, MeshView, Tree, TreeMemory};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferRef};
use crate::mesh::On;
use crate::options::LIST_PART;

/// Receives the progress of an owning call: how much is done, and the total. Each call says what it counts.
pub type Progress<'a> = &'a dyn Fn(u64, u64);

/// Receives progress and ignores it.
pub const SILENT: &(dyn Fn(u64, u64) + Sync) = &|_, _| {};

/// A binary tree in device memory: the structure that queries search for the LBVH baseline.
#[derive(Clone, Copy, Debug)]
pub struct BinaryTree {
    /// [`crate::layout::LbvhNode`] per internal node.
    pub nodes: BufferRef,
    /// One word: the reference to the root, or `u32::MAX` if there are no valid tetrahedra.
    pub root: BufferRef,
    /// The tetrahedron at each place of the sorted order.
    pub ids: BufferRef,
}

/// The structure that a query searches: the octree, or the baseline that it is compared with.
#[derive(Clone, Copy, Debug)]
pub enum Structure {
    /// The octree.
    Octree(TreeMemory),
    /// The binary tree.
    Binary(BinaryTree),
}

/// Dispatches the octree kernel (with its `extra` arguments and the constants of its `kind`) or the corresponding
/// binary-tree kernel, one invocation per item. Both take the buffers of the structure and the arguments and constants
/// that follow.
macro_rules! dispatch {
    ($r:ident, $groups:expr, $searched:expr, $octree:ident $octree_spec:ident { $($extra:ident),* } { $($kind:ident),* }, $binary:ident $binary_spec:ident,
     { $($name:ident: $value:expr),* $(,)? }, { $($constant:ident),* }) => {{
        let $crate::query::StructureView { mesh, structure } = $searched;
        let workgroup = $r.gpu().target().query;
        match *structure {
            $crate::query::Structure::Octree($crate::build::TreeMemory { grid, masks, co, po, p, flags, .. }) => {
                let arguments = $octree { grid, masks, co, po, p, flags, $($extra,)* $($name: $value),* };
                $r.dispatch(&arguments, $octree_spec { workgroup, $($kind,)* $($constant,)* ..Default::default() }, $groups)
            }
            $crate::query::Structure::Binary($crate::query::BinaryTree { nodes, root, ids }) => {
                let $crate::build::MeshArrays { grid, boundary, .. } = mesh.arrays;
                let arguments = $binary { grid, nodes, root, ids, boundary, $($name: $value),* };
                $r.dispatch(&arguments, $binary_spec { workgroup, $($constant,)* ..Default::default() }, $groups)
            }
        }
    }};
}
use dispatch;

/// How many dispatches one recording spends on work of unknown length. Each dispatch tests a limited number of
/// candidates per item, so that no dispatch keeps the device busy for seconds. Later dispatches skip items that are
/// finished. To begin with none is an error, but for [`cmd_render`], which then only prepares the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rounds {
    /// Number of dispatches recorded, one after the other.
    pub count: u32,
    /// Continues where an earlier recording stopped.
    pub resume: bool,
}

impl Rounds {
    /// `count` dispatches, from the beginning of the work.
    pub fn begin(count: u32) -> Self {
        Self { count, resume: false }
    }

    /// `count` more dispatches, after those of an earlier recording.
    pub fn resume(count: u32) -> Self {
        Self { count, resume: true }
    }

    /// Rejects a beginning without a dispatch: what a resumed recording would read, no dispatch would have written.
    pub(crate) fn check(self) -> Result<()> {
        if self.count == 0 && !self.resume {
            return Err(Error::Invalid("a query that begins with no rounds; it takes at least one".into()));
        }
        Ok(())
    }
}

/// A mesh and the structure over it.
#[derive(Clone, Copy, Debug)]
pub struct StructureView {
    /// The mesh.
    pub mesh: MeshView,
    /// The structure over it.
    pub structure: Structure,
}

impl StructureView {
    /// A mesh in memory owned by this crate, and the structure that was built over it.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the structure was built over another mesh.
    pub fn new(mesh: &DeviceMesh, built: &dyn Built) -> Result<Self> {
        built.check(mesh)?;
        Ok(built.searched())
    }

    /// Replaces the flags of the nodes if the structure is an octree.
    fn with_flags(mut self, to: BufferRef) -> Self {
        if let Structure::Octree(TreeMemory { flags, .. }) = &mut self.structure {
            *flags = to;
        }
        self
    }

    /// The octree's [`crate::options::Lists`] as the kernels take it; 0 for the binary tree.
    fn lists(&self) -> u32 {
        if let Structure::Octree(tree) = self.structure { tree.lists as u32 } else { 0 }
    }
}

/// A structure that owning calls can search: a [`Tree`] or an LBVH. The borrow keeps it alive during the call, which a
/// [`StructureView`] or a [`Scene`] alone cannot guarantee.
pub trait Built: sealed::Sealed {
    /// This structure and its mesh, in the form that recording functions take.
    fn searched(&self) -> StructureView;
}

pub(crate) mod sealed {
    /// Limits [`super::Built`] to the structures of this crate, which keep their memory alive.
    pub trait Sealed {
        /// Rejects a mesh that the structure was not built over.
        fn check(&self, mesh: &crate::build::DeviceMesh) -> crate::error::Result<()>;
    }
}

impl sealed::Sealed for Tree {
    fn check(&self, mesh: &DeviceMesh) -> Result<()> {
        mesh.check(self.mesh())
    }
}

impl Built for Tree {
    fn searched(&self) -> StructureView {
        StructureView { mesh: self.mesh().view, structure: Structure::Octree(*self.memory()) }
    }
}

impl From<&Scene> for StructureView {
    fn from(scene: &Scene) -> Self {
        Self { mesh: scene.mesh, structure: Structure::Octree(scene.tree) }
    }
}

/// Uploads the values of a field, one per point or tetrahedron of the mesh.
fn upload_field(mesh: &DeviceMesh, (values, on): (&[f32], On)) -> Result<(Buffer, On)> {
    on.check(values, mesh.sizes())?;
    Ok((mesh.gpu().upload("olbvh.query.field", values)?, on))
}

/// A mesh and its tree, as queries take them.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// The mesh.
    pub mesh: MeshView,
    /// The tree over it.
    pub tree: TreeMemory,
    /// Number of entries of the longest leaf. Lists are searched in parts, up to this length, so too small a number
    /// loses points. A host that does not read back [`crate::layout::BuildStatus::longest_leaf`] gives the number of
    /// tetrahedra, which no list exceeds; that costs up to [`MAX_LIST_PARTS`] dispatches.
    pub longest_leaf: u32,
}

/// Most dispatches for one search of the lists. For long lists the parts get longer than [`LIST_PART`] instead of more
/// numerous.
pub const MAX_LIST_PARTS: u32 = 16;

/// Number of items of `bytes` bytes that `found` holds, as far as shaders number them: an index is a signed word.
fn capacity_of(found: BufferRef, bytes: u64) -> u32 {
    (found.size() / bytes).min(i32::MAX as u64) as u32
}

/// The number of entries of a list that one dispatch searches, and the number of dispatches that the longest list
/// takes.
fn list_parts(longest: u32) -> (u32, u32) {
    let part = LIST_PART.max(longest.div_ceil(MAX_LIST_PARTS).next_power_of_two());
    (part, longest.div_ceil(part).max(1))
}

impl Scene {
    /// A mesh and its tree, both in memory owned by this crate.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the tree was built over another mesh.
    pub fn new(mesh: &DeviceMesh, tree: &Tree) -> Result<Self> {
        mesh.check(tree.mesh())?;
        Ok(Self { mesh: mesh.view(), tree: *tree.memory(), longest_leaf: tree.status().longest_leaf })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_parts_hold_the_longest_list() {
        for longest in [0, 1, LIST_PART, LIST_PART + 1, MAX_LIST_PARTS * LIST_PART, MAX_LIST_PARTS * LIST_PART + 1, 12_290_298, 536_870_911]
        {
            let (part, count) = list_parts(longest);
            assert!(part >= LIST_PART && count <= MAX_LIST_PARTS && part * count >= longest, "{longest}: {count} of {part}");
            assert!(longest > MAX_LIST_PARTS * LIST_PART || (part, count) == (LIST_PART, longest.div_ceil(LIST_PART).max(1)), "{longest}");
        }
    }
}
