//! A mesh and its tree in memory of a host, which rebuilds them as often as it likes.

use super::{
    BuildScratch, Capacity, MAX_ENTRIES, MeshArrays, MeshInput, MeshScratch, MeshView, Tree, TreeMemory, check_points, cmd_build,
    cmd_move_mesh, cmd_prepare_mesh,
};
use crate::error::Result;
use crate::gpu::{Arena, BufferRef, Gpu, Recorder};
use crate::options::BuildOptions;

/// What must be known of a mesh and its tree before memory is allocated for them.
#[derive(Clone, Copy, Debug)]
pub struct ScenePlan {
    /// Number of points.
    pub points: u32,
    /// Floats from one point to the next, at least 3.
    pub stride: u32,
    /// Number of tetrahedra.
    pub tets: u32,
    /// The largest tree that there is room for; one that would be larger is built coarser.
    pub capacity: Capacity,
    /// How the tree is built. Neither its capacity nor its budget is needed, since there is `capacity`.
    pub options: BuildOptions,
}

/// Bytes of memory that a plan needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneBytes {
    /// For mesh and tree, kept as long as the tree is queried.
    pub memory: u64,
    /// Used during construction only; scenes that are built one after the other can share it.
    pub scratch: u64,
}

/// A mesh and its tree in memory of a host. The buffers must outlive what is recorded with it.
#[derive(Clone, Copy, Debug)]
pub struct PlacedScene {
    /// The mesh.
    pub mesh: MeshView,
    /// The tree over it.
    pub tree: TreeMemory,
    options: BuildOptions,
    mesh_scratch: MeshScratch,
    build_scratch: BuildScratch,
}

impl ScenePlan {
    /// A plan with [`Capacity::usual`] and the usual options, for points of three floats each. `level` is the deepest
    /// that leaves may have; how deep they are is chosen by α, which is coarse for thin bodies and small meshes. See
    /// [`ScenePlan::like`].
    pub fn usual(points: u32, tets: u32, level: u32) -> Self {
        Self { points, stride: 3, tets, capacity: Capacity::usual(tets, level), options: BuildOptions::default() }
    }

    /// A plan for trees like this one, over the same cells and points that may have moved: leaves are on its level, with
    /// room for `slack` times its entries, 1.5 for example, or for one per tetrahedron where that is more.
    /// Points have three floats each.
    pub fn like(tree: &Tree, slack: f32) -> Self {
        let (input, status) = (tree.mesh().input, tree.status());
        let entries = ((f64::from(status.entries) * f64::from(slack.max(1.0))) as u32).max(input.tets).min(MAX_ENTRIES);
        let options = BuildOptions { level: Some(status.level), capacity: None, budget: None, ..*tree.options() };
        let capacity = Capacity::for_entries(entries, status.level).with_candidates(input.tets, &options);
        Self { points: input.points, stride: 3, tets: input.tets, capacity, options }
    }

    /// The memory to allocate, with usage flags [`Gpu::usage`], at offsets that are multiples of
    /// [`crate::gpu::ALIGNMENT`].
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] for options or a capacity out of their limits, [`crate::Error::TooLarge`] for too many tetrahedra.
    pub fn bytes(&self, gpu: &Gpu) -> Result<SceneBytes> {
        self.check()?;
        Ok(SceneBytes { memory: Arena::measure(|a| self.memory(a))?, scratch: Arena::measure(|a| self.scratch(gpu, a))? })
    }

    /// Divides memory of these sizes. `positions` and `cells` (four indices per tetrahedron) are read whenever the tree is
    /// built.
    ///
    /// # Errors
    /// As [`ScenePlan::bytes`], and [`crate::Error::Invalid`] for parts that are too small.
    pub fn place(&self, gpu: &Gpu, positions: BufferRef, cells: BufferRef, memory: BufferRef, scratch: BufferRef) -> Result<PlacedScene> {
        let Self { points, stride, tets, options, .. } = *self;
        self.check()?;
        let input = MeshInput { positions, stride, points, cells, tets };
        input.check()?;
        let (arrays, tree) = self.memory(&mut Arena::new(memory))?;
        let (mesh_scratch, build_scratch) = self.scratch(gpu, &mut Arena::new(scratch))?;
        let mesh = MeshView { input, arrays };
        Ok(PlacedScene { mesh, tree, options, mesh_scratch, build_scratch })
    }

    /// Rejects options and strides that [`PlacedScene::cmd_build`] would reject.
    fn check(&self) -> Result<()> {
        self.options.alpha_fixed()?;
        self.options.checked_level()?;
        check_points("positions", self.points, self.stride)
    }

    fn memory(&self, arena: &mut Arena) -> Result<(MeshArrays, TreeMemory)> {
        Ok((MeshArrays::carve(arena, self.points, self.tets)?, TreeMemory::carve(arena, &self.capacity, &self.options)?))
    }

    fn scratch(&self, gpu: &Gpu, arena: &mut Arena) -> Result<(MeshScratch, BuildScratch)> {
        let mesh = MeshScratch::carve(arena, self.points, self.tets)?;
        Ok((mesh, BuildScratch::carve(gpu, arena, self.tets, &self.capacity, &self.options)?))
    }
}

impl PlacedScene {
    /// Records the preparation of the mesh and the construction of its tree, for the positions at the time of execution.
    /// Reads positions and cells in compute shaders, uses memory and scratch in compute shaders and transfers, and ends with
    /// a barrier from these to compute shaders and transfers.
    ///
    /// # Errors
    /// Those of [`cmd_prepare_mesh`] and [`cmd_build`].
    pub fn cmd_build(&self, r: &mut Recorder<'_>) -> Result<()> {
        cmd_prepare_mesh(r, &self.mesh.input, &self.mesh.arrays, &self.mesh_scratch)?;
        self.cmd_tree(r)
    }

    /// As [`PlacedScene::cmd_build`], for points that have moved since then: neighbours, whose search takes most of the
    /// preparation, stay as they were ([`cmd_move_mesh`]).
    ///
    /// # Errors
    /// Those of [`cmd_move_mesh`] and [`cmd_build`].
    pub fn cmd_rebuild(&self, r: &mut Recorder<'_>) -> Result<()> {
        cmd_move_mesh(r, &self.mesh.input, &self.mesh.arrays, &self.mesh_scratch)?;
        self.cmd_tree(r)
    }

    fn cmd_tree(&self, r: &mut Recorder<'_>) -> Result<()> {
        r.barrier("scene.mesh → scene.tree");
        cmd_build(r, &self.mesh, &self.tree, &self.options, &self.build_scratch)
    }
}
