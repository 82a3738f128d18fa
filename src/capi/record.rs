//! Recording into a host's command buffer and memory, across the border to C: nothing is submitted, waited for or made.

use super::{OlbvhBuildOptions, OlbvhGpu, OlbvhStatus, border, give, handle, handle_mut, put, release};
use crate::build::{BuildScratch, Capacity, MeshArrays, MeshInput, MeshScratch, MeshView, TreeMemory, cmd_build, cmd_prepare_mesh};
use crate::error::{Error, Result};
use crate::glsl::SceneBuffers;
use crate::gpu::{ALIGNMENT, BufferRef, DescriptorPools, Gpu, Recorder, USAGE};
use crate::options::{BuildOptions, TOLERANCE};
use crate::primitives::Arena;
use crate::query::{LocateOptions, LocateOutput, PointInput, Scene, cmd_locate};
use crate::reference::grid::MAX_LEVEL;
use ash::vk::{self, Handle};
use std::ffi::c_char;

/// Entries per tetrahedron that there is room for where nothing else is asked for.
const ENTRIES: u32 = 24;

/// A part of a buffer of the host's.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhBuffer {
    /// `VkBuffer`.
    pub buffer: u64,
    /// Bytes from its start.
    pub offset: u64,
    /// Bytes.
    pub size: u64,
    /// Device address of the first byte of the part; 0 where buffer addresses are not enabled.
    pub address: u64,
}

impl OlbvhBuffer {
    fn part(&self) -> BufferRef {
        let Self { offset, size, address, .. } = *self;
        BufferRef { buffer: vk::Buffer::from_raw(self.buffer), offset, size, address }
    }
}

impl From<BufferRef> for OlbvhBuffer {
    fn from(part: BufferRef) -> Self {
        let BufferRef { buffer, offset, size, address } = part;
        Self { buffer: buffer.as_raw(), offset, size, address }
    }
}

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
    /// How to build. Without a capacity there is room for 24 entries per tetrahedron, or for what the budget allows.
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
    /// `VkBufferUsageFlags` of every buffer; with buffer addresses `VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT` as well.
    pub usage: u32,
}

/// A mesh and its tree in memory of the host's.
pub struct OlbvhScene {
    scene: Scene,
    planned: Planned,
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

/// Points to locate, and where the answers go.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhLocation {
    /// 32-bit floats, three of each point.
    pub points: OlbvhBuffer,
    /// Floats from one point to the next, at least 3.
    pub stride: u32,
    /// Points.
    pub count: u32,
    /// As `olbvh_locate` takes it.
    pub tolerance: f32,
    /// A word per point: its owner, or 0xffffffff.
    pub owners: OlbvhBuffer,
    /// Four floats per point, in the order of the cell's vertices; zeroes without an owner.
    pub barycentrics: OlbvhBuffer,
}

/// Commands being recorded, and the descriptor sets they use: one per frame in flight.
pub struct OlbvhRecording {
    /// Refers to the two below, which it is dropped before.
    recorder: Option<Recorder<'static>>,
    gpu: *mut Gpu,
    pools: *mut DescriptorPools,
    /// Of the recording that has ended.
    stages: Vec<(String, u32, u32)>,
}

/// A stage that was timed.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhStage {
    /// Such as "build.levels".
    pub name: [c_char; 64],
    /// Query with the time of its begin.
    pub begin: u32,
    /// Query with the time of its end.
    pub end: u32,
}

impl Drop for OlbvhRecording {
    fn drop(&mut self) {
        self.recorder = None;
        // SAFETY: both came from boxes, and the recorder that referred to them is gone.
        drop(unsafe { (Box::from_raw(self.pools), Box::from_raw(self.gpu)) });
    }
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
            (None, Some(bytes)) => Capacity::for_bytes(bytes, self.level, &options)?,
            (entries, _) => Capacity::for_entries(entries.unwrap_or(self.tets.saturating_mul(ENTRIES)), self.level),
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
            usage: USAGE.as_raw(),
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
        let planned = plan.read()?;
        let (arrays, tree) = plan.memory(&mut Arena::new(memory.part()), &planned)?;
        let (mesh_scratch, build_scratch) = plan.scratch(gpu, &mut Arena::new(scratch.part()), &planned)?;
        let input = MeshInput { positions: positions.part(), stride, points, cells: cells.part(), tets };
        let longest_leaf = if plan.longest_leaf == 0 { tets } else { plan.longest_leaf };
        let scene = Scene { mesh: MeshView { input, arrays }, tree, longest_leaf };
        give(out, OlbvhScene { scene, planned, mesh_scratch, build_scratch })
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

/// Makes what commands are recorded with: one per frame in flight, used by one thread at a time.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_new(gpu: *const OlbvhGpu, out: *mut *mut OlbvhRecording) -> OlbvhStatus {
    border(|| {
        let gpu = handle(gpu, "gpu")?.0.clone();
        let pools = Box::into_raw(Box::new(DescriptorPools::new(&gpu)));
        give(out, OlbvhRecording { recorder: None, gpu: Box::into_raw(Box::new(gpu)), pools, stages: Vec::new() })
    })
}

/// Lets a recording go, when its commands have been executed; null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_free(recording: *mut OlbvhRecording) {
    release(recording);
}

/// Begins anew. `commands` is a `VkCommandBuffer` in the recording state, outside of a render pass; what was recorded before has been executed. 0
/// rehearses: commands compile what they need, and the end makes room for the descriptor sets they would take, so that recording the same later makes
/// nothing. `queries` is a reset `VkQueryPool` for timestamps of that many queries, or 0; stages are timed as long as there are queries left.
/// The recording binds a compute pipeline, push constants, and set 0 where the device has no buffer addresses.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_begin(recording: *mut OlbvhRecording, commands: u64, queries: u64, query_count: u32) -> OlbvhStatus {
    border(|| {
        let recording = handle_mut(recording, "recording")?;
        recording.recorder = None;
        // SAFETY: both live until the recorder is gone, see `drop`, and nobody else refers to the pools; the host vouches for the commands.
        unsafe {
            (*recording.pools).reset()?;
            let queries = (queries != 0).then(|| (vk::QueryPool::from_raw(queries), query_count));
            let recorder = Recorder::new(&*recording.gpu, vk::CommandBuffer::from_raw(commands), queries);
            recording.recorder = Some(recorder.with_pools(&mut *recording.pools));
        }
        Ok(())
    })
}

/// Ends the recording, the command buffer stays open. Fails where a barrier is missing between two commands, and names them.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_end(recording: *mut OlbvhRecording) -> OlbvhStatus {
    border(|| {
        let recording = handle_mut(recording, "recording")?;
        let mut recorder = recording.recorder.take().ok_or_else(not_begun)?;
        let (rehearsed, room, ended) = (recorder.commands() == vk::CommandBuffer::null(), recorder.descriptor_room(), recorder.finish());
        recording.stages = std::mem::take(&mut recorder.stages);
        drop(recorder);
        if rehearsed {
            // SAFETY: no recorder refers to the pools.
            unsafe { &mut *recording.pools }.reserve(room)?;
        }
        ended
    })
}

/// Tells which queries of a recording that has ended have the times of its `index`th stage; fails behind the last.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_stage(recording: *const OlbvhRecording, index: u32, out: *mut OlbvhStage) -> OlbvhStatus {
    border(|| {
        let stages = &handle(recording, "recording")?.stages;
        let stage = stages.get(index as usize).ok_or_else(|| Error::Invalid(format!("stage {index} of {}", stages.len())))?;
        let mut name = [0; 64];
        name.iter_mut().zip(stage.0.bytes().take(63)).for_each(|(c, b)| *c = b as c_char);
        put(out, OlbvhStage { name, begin: stage.1, end: stage.2 })
    })
}

/// Records a barrier: what was written so far is visible to the compute shaders, transfers and indirect commands that follow.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_barrier(recording: *mut OlbvhRecording) -> OlbvhStatus {
    recorded(recording, |r| {
        r.barrier("host → host");
        Ok(())
    })
}

/// Records the construction of a scene's tree for the positions there are then. Reads positions and cells in compute shaders, uses memory and scratch in
/// compute shaders and transfers, and ends with a barrier as `olbvh_cmd_barrier` records it.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_build(recording: *mut OlbvhRecording, scene: *const OlbvhScene) -> OlbvhStatus {
    recorded(recording, |r| {
        let OlbvhScene { scene, planned, mesh_scratch, build_scratch } = handle(scene, "scene")?;
        cmd_prepare_mesh(r, &scene.mesh.input, &scene.mesh.arrays, mesh_scratch)?;
        r.barrier("scene.mesh → scene.tree");
        cmd_build(r, &scene.mesh, &scene.tree, &planned.capacity, &planned.options, build_scratch)
    })
}

/// Records the location of points: compute shaders read mesh, tree and points, and write the answers. No barrier before or after.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_locate(
    recording: *mut OlbvhRecording,
    scene: *const OlbvhScene,
    location: *const OlbvhLocation,
) -> OlbvhStatus {
    recorded(recording, |r| {
        let scene = &handle(scene, "scene")?.scene;
        let OlbvhLocation { points, stride, count, tolerance, owners, barycentrics } = *handle(location, "location")?;
        let input = PointInput { points: points.part(), stride, count, hints: None, order: None };
        let output = LocateOutput { owners: owners.part(), barycentrics: barycentrics.part() };
        let tolerance = if tolerance < 0.0 { TOLERANCE } else { tolerance };
        cmd_locate(r, scene, &input, &output, &LocateOptions { tolerance, ..LocateOptions::default() })
    })
}

fn not_begun() -> Error {
    Error::Invalid("the recording has not begun".into())
}

/// Appends to a recording that has begun.
fn recorded(recording: *mut OlbvhRecording, work: impl FnOnce(&mut Recorder<'static>) -> Result<()>) -> OlbvhStatus {
    border(|| work(handle_mut(recording, "recording")?.recorder.as_mut().ok_or_else(not_begun)?))
}
