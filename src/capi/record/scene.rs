//! A mesh and its tree in memory of a host's, and their construction.

use super::{OlbvhBuffer, OlbvhRecording, recorded};
use crate::build::{BuildScratch, Capacity, MeshArrays, MeshInput, MeshScratch, MeshView, TreeMemory, cmd_build, cmd_prepare_mesh};
use crate::capi::{OlbvhBuildOptions, OlbvhGpu, OlbvhStatus, border, give, handle, put, release};
use crate::error::{Error, Result};
use crate::glsl::SceneBuffers;
use crate::gpu::{ALIGNMENT, Gpu};
use crate::options::{BuildOptions, Lists};
use crate::primitives::Arena;
use crate::query::Scene;
use crate::reference::grid::MAX_LEVEL;

/// Entries per tetrahedron that there is room for where nothing else is asked for and lists are whole.
const ENTRIES: u32 = 24;

/// What is known of a mesh and its tree before there is memory for them.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhPlan {
    /// Points.
    pub points: u32,
    /// 32-bit floats from one point to the next, at least 3.
    pub stride: u32,
    /// Tetrahedra.
    pub tets: u32,
    /// Deepest level that the leaves may have, up to 10.
    pub level: u32,
    /// At least the entries of the longest leaf, 0: any number. Location takes a dispatch for every 16,384 of them.
    pub longest_leaf: u32,
    /// How to build. Without a capacity there is room for 8 entries per tetrahedron (24 where all are listed), or for what the budget allows; trees that need more
    /// get coarser.
    pub build: OlbvhBuildOptions,
}

/// What memory a plan wants.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhPlanSizes {
    /// Bytes of mesh and tree, kept as long as the tree is asked.
    pub memory: u64,
    /// Bytes in use while building only; frames in flight on one queue can share them.
    pub scratch: u64,
    /// Offsets of parts are multiples of this.
    pub alignment: u64,
    /// `VkBufferUsageFlags` of every buffer, with buffer addresses `VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT` among them.
    pub usage: u32,
}

/// A mesh and its tree in memory of the host's.
pub struct OlbvhScene {
    pub(super) gpu: Gpu,
    pub(super) scene: Scene,
    options: BuildOptions,
    mesh_scratch: MeshScratch,
    build_scratch: BuildScratch,
}

/// Where the arrays of a scene are: what olbvh.glsl gets.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhSceneArrays {
    /// The content of the buffer whose address `olbvh_open` gets. By descriptors that buffer is the first of the bindings.
    pub addresses: [u32; 22],
    /// The buffers of the other bindings, in order.
    pub bindings: [OlbvhBuffer; 10],
    /// What was built, in words: level of the leaves, level that was asked for, candidates, entries, nodes, internal nodes, leaves, …
    pub status: OlbvhBuffer,
}

/// What a plan means.
struct Planned {
    options: BuildOptions,
    capacity: Capacity,
}

impl OlbvhPlan {
    fn read(&self) -> Result<Planned> {
        let mut options = self.build.read()?;
        if self.level > MAX_LEVEL {
            return Err(Error::Invalid(format!("level {} is beyond {MAX_LEVEL}", self.level)));
        }
        let capacity = match (options.capacity, options.budget.take()) {
            (Some(entries), _) => Capacity::for_entries(entries, self.level),
            (None, Some(bytes)) => Capacity::for_bytes(bytes, self.level, &options)?,
            (None, None) if options.lists == Lists::Boundary => Capacity::usual(self.tets, self.level),
            (None, None) => Capacity::for_entries(self.tets.saturating_mul(ENTRIES), self.level),
        };
        Ok(Planned { options, capacity })
    }

    fn memory(&self, arena: &mut Arena, planned: &Planned) -> Result<(MeshArrays, TreeMemory)> {
        Ok((MeshArrays::carve(arena, self.points, self.tets)?, TreeMemory::carve(arena, &planned.capacity, &planned.options)?))
    }

    fn scratch(&self, gpu: &Gpu, arena: &mut Arena, planned: &Planned) -> Result<(MeshScratch, BuildScratch)> {
        let Planned { options, capacity } = planned;
        Ok((MeshScratch::carve(arena, self.tets)?, BuildScratch::carve(gpu, arena, self.tets, capacity, options)?))
    }
}

/// Tells what memory a plan wants.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_plan_measure(gpu: *const OlbvhGpu, plan: *const OlbvhPlan, out: *mut OlbvhPlanSizes) -> OlbvhStatus {
    border(|| {
        let (gpu, plan) = (&handle(gpu, "gpu")?.0, handle(plan, "plan")?);
        let planned = plan.read()?;
        let sizes = OlbvhPlanSizes {
            memory: Arena::measure(|a| plan.memory(a, &planned))?,
            scratch: Arena::measure(|a| plan.scratch(gpu, a, &planned))?,
            alignment: ALIGNMENT,
            usage: gpu.usage().as_raw(),
        };
        put(out, sizes)
    })
}

/// A scene of that plan: `positions` and `cells` (four indices per tetrahedron) are read whenever it is built, `memory` and `scratch` are of the sizes
/// measured. The host keeps the buffers as long as it records with the scene.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_scene_place(
    gpu: *const OlbvhGpu,
    plan: *const OlbvhPlan,
    positions: OlbvhBuffer,
    cells: OlbvhBuffer,
    memory: OlbvhBuffer,
    scratch: OlbvhBuffer,
    out: *mut *mut OlbvhScene,
) -> OlbvhStatus {
    border(|| {
        let (gpu, plan) = (&handle(gpu, "gpu")?.0, handle(plan, "plan")?);
        let OlbvhPlan { points, stride, tets, .. } = *plan;
        let needed = (4 * (u64::from(stride) * u64::from(points.saturating_sub(1)) + 3), 16 * u64::from(tets));
        if positions.size < needed.0 || cells.size < needed.1 {
            let text =
                format!("{} bytes of positions and {} of cells; the plan has {} and {}", positions.size, cells.size, needed.0, needed.1);
            return Err(Error::Invalid(text));
        }
        let (positions, cells) = (positions.aligned("positions")?, cells.aligned("cells")?);
        let planned = plan.read()?;
        let (arrays, tree) = plan.memory(&mut Arena::new(memory.part()), &planned)?;
        let (mesh_scratch, build_scratch) = plan.scratch(gpu, &mut Arena::new(scratch.part()), &planned)?;
        let input = MeshInput { positions, stride, points, cells, tets };
        let longest_leaf = if plan.longest_leaf == 0 { tets } else { plan.longest_leaf };
        let scene = Scene { mesh: MeshView { input, arrays }, tree, longest_leaf };
        give(out, OlbvhScene { gpu: gpu.clone(), scene, options: planned.options, mesh_scratch, build_scratch })
    })
}

/// Lets a scene go, but not its buffers; null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_scene_free(scene: *mut OlbvhScene) {
    release(scene);
}

/// Tells where the arrays of a scene are. `field`, a float per point, may be null.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_scene_arrays(scene: *const OlbvhScene, field: *const OlbvhBuffer, out: *mut OlbvhSceneArrays) -> OlbvhStatus {
    border(|| {
        let scene = &handle(scene, "scene")?.scene;
        // SAFETY: the caller passes null or a buffer.
        let buffers = SceneBuffers::new(&scene.mesh, &scene.tree, unsafe { field.as_ref() }.map(OlbvhBuffer::part));
        let [_, bindings @ ..] = buffers.list(scene.tree.status).map(OlbvhBuffer::from);
        put(out, OlbvhSceneArrays { addresses: bytemuck::cast(buffers.addresses()), bindings, status: scene.tree.status.into() })
    })
}

/// Records the construction of a scene's tree for the positions there are then. Reads positions and cells in compute shaders, uses memory and scratch in
/// compute shaders and transfers, and ends with a barrier as `olbvh_cmd_barrier` records it.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_build(recording: *mut OlbvhRecording, scene: *const OlbvhScene) -> OlbvhStatus {
    recorded(recording, |r| {
        let OlbvhScene { scene, options, mesh_scratch, build_scratch, .. } = handle(scene, "scene")?;
        cmd_prepare_mesh(r, &scene.mesh.input, &scene.mesh.arrays, mesh_scratch)?;
        r.barrier("scene.mesh → scene.tree");
        cmd_build(r, &scene.mesh, &scene.tree, options, build_scratch)
    })
}
