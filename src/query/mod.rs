//! Questions to a tree on the device: point location (SPEC 3.1, 3.2), volume rendering (3.3), slicing (3.4), overlap (3.5).

mod locate;
mod overlap;
mod slice;
mod volume;

pub use locate::{LocateOptions, LocateOutput, Located, Path, PointInput, cmd_interpolate, cmd_locate, locate, locate_all};
pub use overlap::{Overlapped, Party, overlap};
pub use slice::{SliceMemory, Sliced, slice};
pub use volume::{Drawn, render};

use crate::build::{DeviceMesh, MeshView, Tree, TreeMemory};

/// A mesh and its tree, as queries get them.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    /// The mesh.
    pub mesh: MeshView,
    /// The tree over it.
    pub tree: TreeMemory,
    /// At least the entries of the longest leaf: lists are searched in so many slices.
    pub longest_leaf: u32,
}

impl Scene {
    /// A mesh and its tree in memory of our own.
    pub fn new(mesh: &DeviceMesh, tree: &Tree) -> Self {
        let view = MeshView { input: *mesh.input(), arrays: *mesh.arrays() };
        Self { mesh: view, tree: *tree.memory(), longest_leaf: tree.status().longest_leaf }
    }
}
