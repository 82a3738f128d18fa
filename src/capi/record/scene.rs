//! The C interface to a mesh and its tree in the host's memory, and to their construction.

use super::{OlbvhBuffer, OlbvhRecording, recorded};
use crate::build::{BuildScratch, Capacity, MeshArrays, MeshInput, MeshScratch, MeshView, TreeMemory, cmd_build, cmd_prepare_mesh};
use crate::capi::{OlbvhBuildOptions, OlbvhGpu, OlbvhStatus, border, give, handle, put, release};
use crate::error::{Error, Result};
use crate::glsl::SceneBuffers;
use crate::gpu::{ALIGNMENT, Gpu};
use crate::grid::MAX_LEVEL;
use crate::options::{BuildOptions, Lists};
use crate::primitives::Arena;
use crate::query::Scene;

/// Entries per tetrahedron for which there is room by default, if all leaves have full lists.
const ENTRIES: u32 = 24;

/// What must be known of a mesh and its tree before memory is allocated for them.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhPlan {
    /// Number of points.
    pub points: u32,
    /// Distance from one point to the next in 32-bit floats, at least 3.
    pub stride: u32,
    /// Number of tetrahedra.
    pub tets: u32,
    /// Deepest level that the leaves may have, at most 10.
    pub level: u32,
    /// Upper bound on the number of entries of a leaf; 0: unknown. If it is too low, points are lost. Location records
    /// one dispatch for every 16,384 entries, at most 16 dispatches.
    pub longest_leaf: u32,
    /// How to build the tree. If both a capacity and a budget are given, the smaller one holds. If neither is given,
    /// there is room for 8 entries per tetrahedron, or 24 if all leaves have full lists. A tree that would need more is
    /// made coarser.
    pub build: OlbvhBuildOptions,
}

/// Memory that a plan needs.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhPlanSizes {
    /// Bytes for mesh and tree, kept as long as the tree is queried.
    pub memory: u64,
    /// Bytes used only during construction; frames in flight on one queue can share them.
    pub scratch: u64,
    /// Offsets of parts of buffers must be multiples of this.
    pub alignment: u64,
    /// `VkBufferUsageFlags` that every buffer needs; where buffer addresses are used, they include
    /// `VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT`.
    pub usage: u32,
}

/// A mesh and its tree in the host's memory.
pub struct OlbvhScene {
    pub(super) gpu: Gpu,
    pub(super) scene: Scene,
    options: BuildOptions,
    mesh_scratch: MeshScratch,
    build_scratch: BuildScratch,
}

/// Where the arrays of a scene are, as olbvh.glsl needs them.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhSceneArrays {
    /// Content of the buffer whose address is passed to `olbvh_open`. With descriptors, this buffer is the first
    /// binding.
    pub addresses: [u32; 22],
    /// Buffers of the other bindings, in order.
    pub bindings: [OlbvhBuffer; 10],
    /// What was built, in words: level of the leaves, level before the limits (by alpha or as requested; larger than
    /// the level of the leaves where a capacity lowered it), candidates, entries, nodes, internal
    /// nodes, leaves, …
    pub status: OlbvhBuffer,
}

/// A plan with its defaults resolved.
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
            (Some(entries), Some(bytes)) => {
                let within = Capacity::for_bytes(bytes, self.level, &options)?;
                if within.entries < entries { within } else { Capacity::for_entries(entries, self.level) }
            }
            (Some(entries), None) => Capacity::for_entries(entries, self.level),
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
        Ok((MeshScratch::carve(arena, self.points, self.tets)?, BuildScratch::carve(gpu, arena, self.tets, capacity, options)?))
    }
}

/// Reports how much memory a plan needs.
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

/// Makes a scene for a plan. `positions` and `cells` (four indices per tetrahedron) are read whenever its tree is
/// built; `memory` and `scratch` have the sizes that `olbvh_plan_measure` reported. The host keeps the buffers as long
/// as it records with the scene.
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
        let needed = ((u64::from(stride) * u64::from(points.saturating_sub(1)) + 3).saturating_mul(4), 16 * u64::from(tets));
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

/// Frees a scene, but not its buffers; null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_scene_free(scene: *mut OlbvhScene) {
    release(scene);
}

/// Reports where the arrays of a scene are. `field`, a float per point, may be null or of size 0: none.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_scene_arrays(scene: *const OlbvhScene, field: *const OlbvhBuffer, out: *mut OlbvhSceneArrays) -> OlbvhStatus {
    border(|| {
        let scene = &handle(scene, "scene")?.scene;
        // SAFETY: the caller passes null or a valid `OlbvhBuffer`.
        let field = unsafe { field.as_ref() }.copied().unwrap_or_default();
        let field = field.optional(4 * u64::from(scene.mesh.input.points), "a field")?;
        let buffers = SceneBuffers::new(&scene.mesh, &scene.tree, field);
        let [_, bindings @ ..] = buffers.list(scene.tree.status).map(OlbvhBuffer::from);
        put(out, OlbvhSceneArrays { addresses: bytemuck::cast(buffers.addresses()), bindings, status: scene.tree.status.into() })
    })
}

/// Records the construction of a scene's tree for the positions at the time of execution. Reads positions and cells in
/// compute shaders, uses memory and scratch in compute shaders and transfers, and ends with a barrier like that of
/// `olbvh_cmd_barrier`.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_build(recording: *mut OlbvhRecording, scene: *const OlbvhScene) -> OlbvhStatus {
    recorded(recording, |r| {
        let OlbvhScene { scene, options, mesh_scratch, build_scratch, .. } = handle(scene, "scene")?;
        cmd_prepare_mesh(r, &scene.mesh.input, &scene.mesh.arrays, mesh_scratch)?;
        r.barrier("scene.mesh → scene.tree");
        cmd_build(r, &scene.mesh, &scene.tree, options, build_scratch)
    })
}
