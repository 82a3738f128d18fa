//! Construction of the tree on the device (the paper's §3.2), as a pipeline of recorded stages.
//!
//! ```text
//! 0 mesh     check cells · bounds → grid · normalise vertices · measure cells
//!            · match faces → neighbours (once per mesh) · boundary bits
//! 1 depth    estimate per tetrahedron → level l                                                      Eq. 11–12
//! 2 codes    count cells per tetrahedron · scan · [mark · filter · settle seeds · fit]               Eq. 1–6
//!            · emit (code, tetrahedron) · stable radix sort
//! 3 splits   count node ends per level · scan · emit PO and CO in place                              Eq. 7–10
//! 4 leaves   boundary flags, quarters of entries, octants, boxes                                     Alg. 1
//!   slabs    two planes around the tetrahedra of each leaf at the surface
//!   levels   flags, masks, boxes of the parents, level by level, with a barrier between levels       Alg. 2
//! 5 ranges   smallest and largest value of a field per node: cells · down · up
//!            (once per field and time step)
//! ```
//! Counts stay on the device: every dispatch whose size depends on one is indirect. [`cmd_build`] records the whole
//! pipeline within given capacities. [`Tree::build`] records the same stages in three or four submissions and reads
//! counts back between them, to allocate exactly what is needed.

mod candidates;
mod mesh;
mod plan;
mod prepare;
mod ranges;
mod scene;
mod stages;
mod tree;

pub(crate) use mesh::KeptMesh;
pub use mesh::{BadCells, DeviceMesh};
pub(crate) use plan::MAX_ENTRIES;
pub use plan::{Capacity, TreeMemory};
pub(crate) use plan::{CountScratch, FilterScratch, SortedScratch};
#[cfg(feature = "cli")]
pub(crate) use plan::{SHARE, filtered};
pub(crate) use prepare::check_points;
pub use prepare::{MAX_TETS, MeshArrays, MeshInput, MeshScratch, MeshView, cmd_move_mesh, cmd_prepare_mesh};
pub(crate) use ranges::{check_components, check_field};
pub use ranges::{cmd_ranges, range_bytes};
pub use scene::{PlacedScene, SceneBytes, ScenePlan};
pub use tree::Tree;

use crate::error::{Error, Result};
use crate::gpu::{Arena, Gpu, Recorder};
use crate::options::BuildOptions;
use stages::Build;

/// Scratch memory of a whole build.
#[derive(Clone, Copy, Debug)]
pub struct BuildScratch {
    /// What it was carved for.
    made_for: (u32, Capacity, BuildOptions),
    pub(crate) counts: CountScratch,
    pub(crate) filter: Option<FilterScratch>,
    pub(crate) sorted: SortedScratch,
}

impl BuildScratch {
    /// Takes the scratch memory for a mesh of `tets` tetrahedra, bad ones included, within `capacity` and the capacity
    /// of `options`, at least `tets` candidates; then there is a tree for every mesh.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for a capacity of fewer entries than tetrahedra or for sizes that shaders cannot number,
    /// [`Error::Invalid`] if the arena is too small or the level too deep.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, tets: u32, capacity: &Capacity, options: &BuildOptions) -> Result<Self> {
        capacity.check(options)?;
        let room = options.capacity.unwrap_or(u32::MAX).min(capacity.candidates);
        if room < tets {
            let level = capacity.level;
            let bytes = Arena::measure(|a| TreeMemory::carve(a, &Capacity::for_entries(tets, level), options))?;
            return Err(Error::TooLarge(format!(
                "the root alone may list {tets} tetrahedra, the capacity is {room} entries; plan for {tets} or more, {bytes} bytes of tree down to level {level}"
            )));
        }
        Ok(Self {
            made_for: (tets, *capacity, *options),
            counts: CountScratch::carve(gpu, arena, tets)?,
            filter: FilterScratch::carve(gpu, arena, tets, options, capacity)?,
            sorted: SortedScratch::carve(gpu, arena, capacity)?,
        })
    }

    /// Rejects a build of another kind or size than the one that the memory was carved for.
    fn check(&self, tets: u32, tree: &TreeMemory, options: &BuildOptions) -> Result<()> {
        let (room, capacity, carved) = &self.made_for;
        let kind = |o: &BuildOptions| (o.assign, o.lists, o.boxes, o.has_slabs(), o.capacity);
        let wrong = if tets > *room {
            format!("{tets} tetrahedra, in memory for {room}")
        } else if kind(options) != kind(carved)
            || kind(options) != (tree.assign, tree.lists, tree.boxes.is_some(), tree.slabs, options.capacity)
        {
            "assign, lists, boxes, slabs or capacity other than those that tree and scratch were carved for".into()
        } else if *capacity != tree.capacity {
            "a tree and scratch that were carved for different capacities".into()
        } else {
            return Ok(());
        };
        Err(Error::Invalid(format!("a build of {wrong}")))
    }
}

/// Records a whole build within the capacity of `tree`: nothing is submitted, waited for, allocated or read back. Where
/// the heuristic's level would need more entries, a coarser tree is built, down to the root alone, which has no more
/// entries than there are tetrahedra. `tree.status` reports the level that was built, or, where a budget or
/// [`Capacity::entries`] is too small for the root, that nothing was.
///
/// `scratch` must be carved for that capacity and options with the same `assign`, `lists`, `boxes`, `slabs` and `capacity`. The
/// first use of `tree` and `scratch` is a transfer or compute write. `mesh` is read by compute shaders and transfers. The
/// last use is a compute write, followed by a barrier to compute, transfer and indirect reads.
///
/// # Errors
/// [`crate::Error::Invalid`] for α or a level outside 0…10, and for a mesh, a tree or options that `scratch` was not carved
/// for.
pub fn cmd_build(r: &mut Recorder<'_>, mesh: &MeshView, tree: &TreeMemory, options: &BuildOptions, scratch: &BuildScratch) -> Result<()> {
    scratch.check(mesh.input.tets, tree, options)?;
    let BuildScratch { counts, filter, sorted, .. } = scratch;
    let (capacity, filter) = (&tree.capacity, filter.as_ref());
    let build = Build { mesh, options, status: tree.status, grid: tree.grid, counts, filter };
    // Without a filter, every candidate is an entry.
    let most = if filter.is_some() { capacity.candidates } else { capacity.candidates.min(capacity.entries) };
    build.depth(r, most, capacity.level)?;
    build.count(r)?;
    build.filter(r, true)?;
    build.fit(r, capacity)?;
    build.codes(r, tree.p, capacity, sorted)?;
    build.count_splits(r, capacity, sorted)?;
    build.splits(r, tree, sorted)?;
    build.leaves(r, tree, sorted)?;
    build.slabs(r, tree, sorted)?;
    build.levels(r, tree, sorted)
}
