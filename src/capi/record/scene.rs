//! The C interface to a mesh and its tree in the host's memory, and to their construction.

use super::{OlbvhBuffer, OlbvhRecording, begun};
use crate::build::{Capacity, MAX_ENTRIES, MeshArrays, PlacedScene, SceneBytes, ScenePlan};
use crate::capi::{OlbvhBuildOptions, OlbvhGpu, OlbvhStatus, border, check_level, give, handle, optional, place, release};
use crate::error::{Error, Result};
use crate::glsl::SceneBuffers;
use crate::gpu::{ALIGNMENT, Gpu, Recorder};
use crate::options::{Lists, usual_capacity};
use crate::query::Scene;

/// Entries per tetrahedron for which there is room by default, if all leaves have full lists.
const ENTRIES: u32 = 24;

/// The deepest level by default.
const DEFAULT_LEVEL: u32 = 7;

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
    /// Deepest level that the leaves may have, from 1 to 10. 0: the level of `build`, or 7 if that has none.
    pub level: u32,
    /// Upper bound on the number of entries of a leaf; 0: unknown. If it is too low, points are lost. Location records
    /// one dispatch for every 16,384 entries, on a GPU at most 16 dispatches.
    pub longest_leaf: u32,
    /// How to build the tree. If both a capacity and a budget are given, the smaller one holds. If neither is given,
    /// there is room for 8 entries per tetrahedron, or 24 if all leaves have full lists. A tree that would need more is
    /// made coarser. A capacity is at least the number of tetrahedra.
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
    placed: PlacedScene,
}

impl OlbvhScene {
    /// The scene, which must lie on the device of the recording.
    pub(super) fn on_device_of(&self, r: &Recorder<'_>, what: &str) -> Result<&Scene> {
        if self.gpu.is_same_device(r.gpu()) {
            return Ok(&self.scene);
        }
        Err(Error::Invalid(format!("{what} lies on another device than the recording; make both with one olbvh_gpu")))
    }
}

/// The recorder of a recording that has begun, and a scene to record with.
///
/// # Safety
/// See [`crate::capi`].
pub(super) unsafe fn begun_with<'a>(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    what: &str,
) -> Result<(&'a mut Recorder<'static>, &'a OlbvhScene)> {
    // SAFETY: the caller keeps the rules of `capi`.
    let (r, scene) = unsafe { (begun(recording)?, handle(scene, what)?) };
    scene.on_device_of(r, what)?;
    Ok((r, scene))
}

/// Where the arrays of a scene are, as olbvh.glsl needs them.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhSceneArrays {
    /// Content of the buffer whose address is passed to `olbvh_open`, a multiple of 8. With descriptors, this buffer is
    /// the first binding.
    pub addresses: [u32; 22],
    /// Buffers of the other bindings, in order.
    pub bindings: [OlbvhBuffer; 10],
    /// An `olbvh_build_status`: what was built.
    pub status: OlbvhBuffer,
    /// An `olbvh_mesh_status`: what is known of the mesh, such as the number of bad tetrahedra.
    pub mesh_status: OlbvhBuffer,
    /// One bit per tetrahedron, lowest bit of a word first: set if it is bad, and so left out of the tree.
    pub bad: OlbvhBuffer,
}

/// The result of `olbvh_cmd_build`, which the device writes to `olbvh_scene_arrays_data.status`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[allow(dead_code, reason = "the device writes it, and C programs read it")]
pub struct OlbvhBuildStatus {
    /// Level of the leaves.
    pub level: u32,
    /// Level before the limits, by alpha or as requested; `level` is smaller where a limit lowered it.
    pub wanted_level: u32,
    /// Number of octree cells in the bounding boxes of all tetrahedra, of which the entries are chosen.
    pub candidates: u32,
    /// Number of entries, that is of (tetrahedron, leaf) pairs.
    pub entries: u32,
    /// Number of nodes.
    pub nodes: u32,
    /// Number of internal nodes.
    pub internal: u32,
    /// Number of leaves.
    pub leaves: u32,
    /// Number of leaves that the surface of the mesh may pass through.
    pub boundary_leaves: u32,
    /// Number of entries of the longest leaf, for `olbvh_plan.longest_leaf`.
    pub longest_leaf: u32,
    /// Bit k: on level k, some tetrahedron has more than 32 candidates.
    pub large_levels: u32,
    /// Sum of the estimates from which the level by alpha follows, lower word first.
    pub sum: [u32; 2],
    /// Number of candidates on every level from 0 to 10, two words each, lower word first.
    pub total: [u32; 22],
    /// Element k is the number of nodes on levels 0 to k.
    pub levels: [u32; 11],
    /// Not 0: the tree is empty, since its capacity is too small even for a single node; that of a plan never is.
    pub overflow: u32,
}

/// What is known of a mesh, which the device writes to `olbvh_scene_arrays_data.mesh_status`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
#[allow(dead_code, reason = "the device writes it, and C programs read it")]
pub struct OlbvhMeshStatus {
    /// Lower corner of the bounds, in a form of the kernels.
    pub lo: [u32; 3],
    /// Upper corner of the bounds, in a form of the kernels.
    pub hi: [u32; 3],
    /// Number of bad tetrahedra, which the tree leaves out: a vertex does not exist, occurs twice, or has a coordinate
    /// that is not finite or beyond 2^125.
    pub bad: u32,
    /// Number of boundary tetrahedra: those on the surface, without volume, beside a fold, or at a crowded vertex.
    pub boundary: u32,
    /// Number of tetrahedra without volume.
    pub zero_volume: u32,
    /// Number of tetrahedra of negative volume, in the order of their vertices; they are as good as others.
    pub negative: u32,
    /// Number of crowded vertices, at which more than 128 tetrahedra may meet.
    pub crowded: u32,
    /// Not 0: the table of faces is full, as it can be beyond 429 million tetrahedra only. The tree must not be used.
    pub overflow: u32,
    /// Number of faces that more than two tetrahedra share, none of which are neighbours there.
    pub branched: u32,
    /// Not 0: since `olbvh_cmd_build`, some tetrahedra were bad for a while and have lost their neighbours.
    pub parted: u32,
}

impl OlbvhPlan {
    /// The plan with its defaults resolved.
    fn read(&self) -> Result<ScenePlan> {
        let mut options = self.build.read()?;
        check_level(self.level)?;
        let level = if self.level == 0 { options.level.unwrap_or(DEFAULT_LEVEL) } else { self.level };
        let usual = usual_capacity(self.tets);
        let capacity = match (options.capacity, options.budget.take()) {
            (None, None) if options.lists == Lists::Boundary => Capacity::usual(self.tets, level),
            (None, None) => Capacity::for_entries(self.tets.saturating_mul(ENTRIES).min(MAX_ENTRIES), level),
            (Some(entries), None) => Capacity::for_entries(entries, level),
            (entries, Some(bytes)) => {
                let (within, most) = (Capacity::for_bytes(bytes, level, &options)?, entries.unwrap_or(usual));
                if within.entries < most { within } else { Capacity::for_entries(most, level) }
            }
        };
        // The planned entries are the limit, not candidates, unless more of them are asked for than are usual.
        options.capacity = options.capacity.filter(|&entries| entries > usual);
        let Self { points, stride, tets, .. } = *self;
        Ok(ScenePlan { points, stride, tets, capacity: capacity.with_candidates(tets, &options), options })
    }
}

/// Reports how much memory a plan needs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_plan_measure(gpu: *const OlbvhGpu, plan: *const OlbvhPlan, out: *mut OlbvhPlanSizes) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (gpu, plan, out) = unsafe { (&handle(gpu, "gpu")?.0, handle(plan, "plan")?, place(out)?) };
        let SceneBytes { memory, scratch } = plan.read()?.bytes(gpu)?;
        out.write(OlbvhPlanSizes { memory, scratch, alignment: ALIGNMENT, usage: gpu.usage().as_raw() });
        Ok(())
    })
}

/// Makes a scene for a plan. `positions` (32-bit floats, three per point at the distance of the plan's `stride`) and `cells`
/// (four indices per tetrahedron) are read whenever its tree is built; `memory` and `scratch` have the sizes that
/// `olbvh_plan_measure` reported. The host keeps the buffers as long as it records with the scene.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_scene_place(
    gpu: *const OlbvhGpu,
    plan: *const OlbvhPlan,
    positions: OlbvhBuffer,
    cells: OlbvhBuffer,
    memory: OlbvhBuffer,
    scratch: OlbvhBuffer,
    out: *mut *mut OlbvhScene,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (gpu, plan, out) = unsafe { (&handle(gpu, "gpu")?.0, handle(plan, "plan")?, place(out)?) };
        let (positions, cells) = (positions.aligned("positions")?, cells.aligned("cells")?);
        let placed = plan.read()?.place(gpu, positions, cells, memory.part(), scratch.part())?;
        let scene = Scene::recorded(placed.mesh, placed.tree);
        let longest_leaf = if plan.longest_leaf == 0 { scene.longest_leaf } else { plan.longest_leaf };
        give(out, OlbvhScene { gpu: gpu.clone(), scene: Scene { longest_leaf, ..scene }, placed });
        Ok(())
    })
}

/// Frees a scene, but not its buffers; null is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_scene_free(scene: *mut OlbvhScene) {
    // SAFETY: the caller keeps the rules of `capi`.
    unsafe { release(scene, "scene") };
}

/// Reports where the arrays of a scene are. `field`, a float per point, may be null or of size 0: none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_scene_arrays(
    scene: *const OlbvhScene,
    field: *const OlbvhBuffer,
    out: *mut OlbvhSceneArrays,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (scene, field, out) = unsafe { (&handle(scene, "scene")?.scene, optional(field, "field")?, place(out)?) };
        let buffers = SceneBuffers::new(&scene.mesh, &scene.tree, field.and_then(OlbvhBuffer::given))?;
        let [_, bindings @ ..] = buffers.list(scene.tree.status).map(OlbvhBuffer::from);
        let MeshArrays { status: mesh_status, bad, .. } = scene.mesh.arrays;
        let [status, mesh_status, bad] = [scene.tree.status, mesh_status, bad].map(OlbvhBuffer::from);
        out.write(OlbvhSceneArrays { addresses: bytemuck::cast(buffers.addresses()), bindings, status, mesh_status, bad });
        Ok(())
    })
}

/// Records the construction of a scene's tree for the positions at the time of execution. Reads positions and cells in
/// compute shaders, uses memory and scratch in compute shaders and transfers, and ends with a barrier like that of
/// `olbvh_cmd_barrier`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_build(recording: *mut OlbvhRecording, scene: *const OlbvhScene) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (r, scene) = unsafe { begun_with(recording, scene, "scene")? };
        scene.placed.cmd_build(r)
    })
}

/// As `olbvh_cmd_build`, for positions that have changed since a tree of the scene was built: neighbours, whose search
/// takes much of that time, stay as they were found then. The cells must be the same. A tetrahedron that was or becomes
/// bad, see `olbvh_mesh_status.bad`, has no neighbours until the next `olbvh_cmd_build`, and `parted` is not 0 until then: no
/// point is lost, but the tree is larger, and places inside may count as surface for `olbvh_cmd_nearest`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_rebuild(recording: *mut OlbvhRecording, scene: *const OlbvhScene) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (r, scene) = unsafe { begun_with(recording, scene, "scene")? };
        scene.placed.cmd_rebuild(r)
    })
}
