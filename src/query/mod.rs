//! Questions to a tree on the device: point location (SPEC 3.1, 3.2), volume rendering (3.3), slicing (3.4), overlap (3.5).

mod all_owners;
mod locate;
mod order;
mod overlap;
mod slice;
mod visible;
mod volume;

pub use all_owners::{OwnersMemory, cmd_count_owners, cmd_list_owners, locate_all};
pub use locate::{LocateOptions, LocateOutput, Located, Path, PointInput, cmd_interpolate, cmd_locate, locate};
pub use order::{PointOrder, cmd_sort_points};
pub use overlap::{OverlapInput, OverlapMemory, Overlapped, PairMemory, cmd_count_pairs, cmd_list_pairs, cmd_overlap, overlap};
pub(crate) use slice::Slicing;
pub use slice::{SliceInput, SliceMemory, Sliced, cmd_slice, slice};
pub use visible::{cmd_visible, visible_bytes};
pub(crate) use volume::{Canvas, Rays};
pub use volume::{Drawn, RenderInput, RenderMemory, RenderPart, Shown, cmd_render, render};

use crate::build::{DeviceMesh, MeshView, Tree, TreeMemory};
use crate::error::Result;
use crate::gpu::{BufferRef, Groups};
use crate::reference::locate::LIST_PART;

/// A binary tree in device memory: what the LBVH baseline is to the queries.
#[derive(Clone, Copy, Debug)]
pub struct BinaryTree {
    /// [`crate::layout::LbvhNode`] per internal node.
    pub nodes: BufferRef,
    /// A word: the reference to the root, or all ones.
    pub root: BufferRef,
    /// Tetrahedron at each place.
    pub ids: BufferRef,
}

/// What finds the cells of a mesh: the octree, or the baseline that it is compared with.
#[derive(Clone, Copy, Debug)]
pub enum Structure {
    /// The octree.
    Octree(TreeMemory),
    /// The binary tree.
    Binary(BinaryTree),
}

/// How many invocations a kernel needs: as many as items, or the workgroups that the device knows.
pub(crate) trait Items {
    fn groups(self, workgroup: u32) -> Groups;
}

impl Items for u32 {
    fn groups(self, workgroup: u32) -> Groups {
        Groups::Count(self.div_ceil(workgroup))
    }
}

impl Items for Groups {
    fn groups(self, _: u32) -> Groups {
        self
    }
}

/// Dispatches the kernel for the octree, with `extra` arguments and constants of its `kind`, or its twin for the binary tree, one invocation per item;
/// both take the structure and the arguments that follow.
macro_rules! dispatch {
    ($r:ident, $items:expr, $searched:expr, $octree:ident $octree_spec:ident { $($extra:ident),* } { $($kind:ident),* }, $binary:ident $binary_spec:ident,
     { $($name:ident: $value:expr),* $(,)? }, { $($constant:ident),* }) => {{
        let $crate::query::StructureView { mesh, structure } = $searched;
        let workgroup = $r.gpu().target().query;
        let groups = $crate::query::Items::groups($items, workgroup);
        match *structure {
            $crate::query::Structure::Octree($crate::build::TreeMemory { grid, masks, co, po, p, flags, .. }) => {
                let arguments = $octree { grid, masks, co, po, p, flags, $($extra,)* $($name: $value),* };
                $r.dispatch(&arguments, $octree_spec { workgroup, $($kind,)* $($constant,)* ..Default::default() }, groups)
            }
            $crate::query::Structure::Binary($crate::query::BinaryTree { nodes, root, ids }) => {
                let $crate::build::MeshArrays { grid, boundary, .. } = mesh.arrays;
                let arguments = $binary { grid, nodes, root, ids, boundary, $($name: $value),* };
                $r.dispatch(&arguments, $binary_spec { workgroup, $($constant,)* ..Default::default() }, groups)
            }
        }
    }};
}
use dispatch;

/// How far one recording goes with work that takes as many dispatches as it takes: each looks at so many candidates per item and no more, so that no
/// device is kept busy for seconds. What is finished is passed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rounds {
    /// Dispatches recorded, one after the other.
    pub count: u32,
    /// Goes on where an earlier recording ended.
    pub resume: bool,
}

impl Rounds {
    /// That many, from the beginning.
    pub fn begin(count: u32) -> Self {
        Self { count, resume: false }
    }

    /// That many more.
    pub fn resume(count: u32) -> Self {
        Self { count, resume: true }
    }
}

/// A mesh and what finds its cells.
#[derive(Clone, Copy, Debug)]
pub struct StructureView {
    /// The mesh.
    pub mesh: MeshView,
    /// What finds its cells.
    pub structure: Structure,
}

impl StructureView {
    /// A mesh in memory of our own, and what was built over it.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if that was built over another mesh.
    pub fn new(mesh: &DeviceMesh, built: &dyn Built) -> Result<Self> {
        let searched = built.searched();
        mesh.check(&searched.mesh)?;
        Ok(searched)
    }

    /// The same with other flags for the nodes of an octree.
    fn with_flags(mut self, to: BufferRef) -> Self {
        if let Structure::Octree(TreeMemory { flags, .. }) = &mut self.structure {
            *flags = to;
        }
        self
    }

    /// Which lists an octree keeps, for its kernels.
    fn lists(&self) -> u32 {
        if let Structure::Octree(tree) = self.structure { tree.lists as u32 } else { 0 }
    }
}

/// What owning calls find cells with: a tree or an LBVH, there as long as the call, which a [`StructureView`] or a [`Scene`] alone does not see to.
pub trait Built: sealed::Sealed {
    /// It and its mesh, as recorded functions take them.
    fn searched(&self) -> StructureView;
}

pub(crate) mod sealed {
    /// No others are known to be there.
    pub trait Sealed {}
}

impl sealed::Sealed for Tree {}

impl Built for Tree {
    fn searched(&self) -> StructureView {
        StructureView { mesh: *self.mesh(), structure: Structure::Octree(*self.memory()) }
    }
}

impl From<&Scene> for StructureView {
    fn from(scene: &Scene) -> Self {
        Self { mesh: scene.mesh, structure: Structure::Octree(scene.tree) }
    }
}

/// A mesh and its tree, as queries get them.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// The mesh.
    pub mesh: MeshView,
    /// The tree over it.
    pub tree: TreeMemory,
    /// Entries of the longest leaf: lists are searched slice by slice, up to there, so a smaller number loses points. A host that does not read
    /// [`crate::layout::BuildStatus::longest_leaf`] back gives the number of tetrahedra, which no list exceeds; that costs up to [`MAX_LIST_PARTS`] dispatches.
    pub longest_leaf: u32,
}

/// Dispatches that the longest list takes: slices are longer than [`LIST_PART`] rather than more.
pub const MAX_LIST_PARTS: u32 = 16;

/// Entries of a list that one dispatch searches, and how many dispatches that makes of the longest.
fn list_parts(longest: u32) -> (u32, u32) {
    let part = LIST_PART.max(longest.div_ceil(MAX_LIST_PARTS).next_power_of_two());
    (part, longest.div_ceil(part).max(1))
}

impl Scene {
    /// A mesh and its tree in memory of our own.
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
    fn few_slices_hold_the_longest_list() {
        for longest in [0, 1, LIST_PART, LIST_PART + 1, MAX_LIST_PARTS * LIST_PART, MAX_LIST_PARTS * LIST_PART + 1, 12_290_298, 536_870_911]
        {
            let (part, count) = list_parts(longest);
            assert!(part >= LIST_PART && count <= MAX_LIST_PARTS && part * count >= longest, "{longest}: {count} of {part}");
            assert!(longest > MAX_LIST_PARTS * LIST_PART || (part, count) == (LIST_PART, longest.div_ceil(LIST_PART).max(1)), "{longest}");
        }
    }
}
