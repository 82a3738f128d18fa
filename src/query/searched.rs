//! What pictures and slices search: the octree, or the baseline that it is compared with.

use super::Scene;
use crate::build::{MeshView, Tree, TreeMemory};
use crate::gpu::BufferRef;

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

/// The structure that a query searches.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Structure {
    Octree(TreeMemory),
    Binary(BinaryTree),
}

/// A mesh and the structure over it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Searched {
    pub mesh: MeshView,
    pub structure: Structure,
}

impl Searched {
    /// The octree, if it is one.
    pub fn octree(&self) -> Option<&TreeMemory> {
        if let Structure::Octree(tree) = &self.structure { Some(tree) } else { None }
    }

    /// Replaces the flags of the nodes if the structure is an octree.
    pub fn with_flags(mut self, to: BufferRef) -> Self {
        if let Structure::Octree(TreeMemory { flags, .. }) = &mut self.structure {
            *flags = to;
        }
        self
    }

    /// The octree's [`crate::options::Lists`] as the kernels take it; 0 for the binary tree.
    pub fn lists(&self) -> u32 {
        self.octree().map_or(0, |tree| tree.lists as u32)
    }
}

impl From<&Scene> for Searched {
    fn from(scene: &Scene) -> Self {
        Self { mesh: scene.mesh, structure: Structure::Octree(scene.tree) }
    }
}

impl From<&Tree> for Searched {
    fn from(tree: &Tree) -> Self {
        Self { mesh: tree.mesh(), structure: Structure::Octree(*tree.memory()) }
    }
}

/// Dispatches the octree kernel (with its `extra` arguments and the constants of its `kind`) or the corresponding
/// binary-tree kernel, one invocation per item. Both take the buffers of the structure and the arguments and constants
/// that follow.
macro_rules! dispatch {
    ($r:ident, $groups:expr, $searched:expr, $octree:ident $octree_spec:ident { $($extra:ident),* } { $($kind:ident),* }, $binary:ident $binary_spec:ident,
     { $($name:ident: $value:expr),* $(,)? }, { $($constant:ident),* }) => {{
        let $crate::query::searched::Searched { mesh, structure } = $searched;
        let workgroup = $r.gpu().target().query;
        match *structure {
            $crate::query::searched::Structure::Octree($crate::build::TreeMemory { grid, masks, co, po, p, flags, .. }) => {
                let arguments = $octree { grid, masks, co, po, p, flags, $($extra,)* $($name: $value),* };
                $r.dispatch(&arguments, $octree_spec { workgroup, $($kind,)* $($constant,)* ..Default::default() }, $groups)
            }
            $crate::query::searched::Structure::Binary($crate::query::searched::BinaryTree { nodes, root, ids }) => {
                let $crate::build::MeshArrays { grid, boundary, .. } = mesh.arrays;
                let arguments = $binary { grid, nodes, root, ids, boundary, $($name: $value),* };
                $r.dispatch(&arguments, $binary_spec { workgroup, $($constant,)* ..Default::default() }, $groups)
            }
        }
    }};
}
pub(super) use dispatch;
