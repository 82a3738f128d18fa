//! Acceleration structures over triangles, for devices that support ray tracing: built on the device, compacted, and
//! made the only instance of a scene that shaders trace rays in.

use super::buffer_ref::BufferRef;
use super::context::Gpu;
use super::memory::Buffer;
use super::ray_functions::Acceleration;
use super::recorder::Recorder;
use super::{debug, failed};
use crate::error::{Error, Result};
use crate::times::StageTimes;
use ash::vk;
use gpu_allocator::MemoryLocation;

/// Bytes from one vertex to the next.
const VERTEX_STRIDE: u64 = 16;

/// Triangles in device memory, visible to all commands.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangles {
    /// Three 32-bit floats per vertex, 16 bytes apart.
    pub vertices: BufferRef,
    /// Number of vertices.
    pub points: u32,
    /// Three vertex indices per triangle.
    pub indices: BufferRef,
    /// Number of triangles.
    pub count: u32,
    /// Factor from these coordinates to those of the rays.
    pub scale: f32,
}

/// An acceleration structure and its memory.
struct Structure {
    gpu: Gpu,
    handle: vk::AccelerationStructureKHR,
    address: u64,
    memory: Buffer,
}

impl Structure {
    fn new(gpu: &Gpu, name: &str, ty: vk::AccelerationStructureTypeKHR, bytes: u64) -> Result<Self> {
        let functions = &extension(gpu)?.functions;
        let usage = vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR;
        let memory = Buffer::with_usage(gpu, name, bytes, MemoryLocation::GpuOnly, usage)?;
        let info = vk::AccelerationStructureCreateInfoKHR::default().buffer(memory.all().buffer).size(bytes).ty(ty);
        // SAFETY: the buffer has the required usage and size, and lives as long as the structure.
        let (handle, address) = unsafe {
            let handle = functions.create_acceleration_structure(&info, None).map_err(failed("vkCreateAccelerationStructureKHR"))?;
            let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(handle);
            (handle, functions.get_acceleration_structure_device_address(&info))
        };
        debug::name(gpu.debug_device(), handle, name);
        Ok(Self { gpu: gpu.clone(), handle, address, memory })
    }
}

impl Drop for Structure {
    fn drop(&mut self) {
        if let Some(extension) = self.gpu.acceleration() {
            // SAFETY: work with the structure has ended, since owning calls wait for their submissions.
            unsafe { extension.functions.destroy_acceleration_structure(self.handle, None) };
        }
    }
}

fn extension(gpu: &Gpu) -> Result<&Acceleration> {
    gpu.acceleration().ok_or_else(|| Error::Invalid(format!("{} traces no rays", gpu.report().name)))
}

const BUILDS: vk::PipelineStageFlags = vk::PipelineStageFlags::ACCELERATION_STRUCTURE_BUILD_KHR;

/// Makes writes of compute shaders and transfers visible to builds.
fn barrier_before(r: &mut Recorder<'_>) {
    let source = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
    let written = vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE;
    r.barrier_between("acceleration.input → acceleration.build", (source, written), (BUILDS, vk::AccessFlags::SHADER_READ));
}

/// Makes a written structure visible to copies, builds and rays.
fn barrier_after(r: &mut Recorder<'_>) {
    let written = vk::AccessFlags::ACCELERATION_STRUCTURE_WRITE_KHR;
    let ways = r.gpu().report().requirements.ray_tracing;
    let mut stages = BUILDS;
    if ways.queries {
        stages |= vk::PipelineStageFlags::COMPUTE_SHADER;
    }
    if ways.pipelines {
        stages |= vk::PipelineStageFlags::RAY_TRACING_SHADER_KHR;
    }
    let target = (stages, vk::AccessFlags::ACCELERATION_STRUCTURE_READ_KHR);
    r.barrier_between("acceleration.build → acceleration.use", (BUILDS, written), target);
}

/// Builds one structure over `count` primitives of a geometry. Also returns the bytes of scratch memory, and the times.
fn build(
    gpu: &Gpu,
    names: [&str; 2],
    ty: vk::AccelerationStructureTypeKHR,
    geometry: vk::AccelerationStructureGeometryKHR<'_>,
    count: u32,
) -> Result<(Structure, u64, StageTimes)> {
    let Acceleration { functions, scratch_alignment, .. } = extension(gpu)?;
    let geometries = [geometry];
    let flags = vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE | vk::BuildAccelerationStructureFlagsKHR::ALLOW_COMPACTION;
    let mut info = vk::AccelerationStructureBuildGeometryInfoKHR::default().ty(ty).flags(flags).geometries(&geometries);
    info.mode = vk::BuildAccelerationStructureModeKHR::BUILD;
    let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
    let kind = vk::AccelerationStructureBuildTypeKHR::DEVICE;
    // SAFETY: sizes depend on counts and formats only; no address is read.
    unsafe { functions.get_acceleration_structure_build_sizes(kind, &info, &[count], &mut sizes) };
    let structure = Structure::new(gpu, names[0], ty, sizes.acceleration_structure_size)?;
    let scratch = gpu.buffer("olbvh.acceleration.scratch", sizes.build_scratch_size + scratch_alignment)?;
    info.dst_acceleration_structure = structure.handle;
    info.scratch_data.device_address = scratch.all().address.next_multiple_of(*scratch_alignment);
    let range = [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count)];
    let ((), times) = gpu.submit("olbvh.acceleration.build", |r| {
        barrier_before(r);
        r.stage(names[1], |r| {
            // SAFETY: structure and scratch memory have the sizes that the device reported; the barrier makes the
            // inputs visible.
            unsafe { functions.cmd_build_acceleration_structures(r.commands, &[info], &[&range]) };
            Ok(())
        })?;
        barrier_after(r);
        Ok(())
    })?;
    Ok((structure, scratch.size(), times))
}

/// Makes a compacted copy. Also returns the times.
fn compact(gpu: &Gpu, structure: &Structure) -> Result<(Structure, StageTimes)> {
    let functions = &extension(gpu)?.functions;
    let kind = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
    let info = vk::QueryPoolCreateInfo::default().query_type(kind).query_count(1);
    // SAFETY: plain creation; destroyed below on every path.
    let queries = unsafe { gpu.device().create_query_pool(&info, None) }.map_err(failed("vkCreateQueryPool"))?;
    let asked = gpu.submit("olbvh.acceleration.size", |r| {
        // SAFETY: the structure was built by a submission that has ended, after a barrier.
        unsafe {
            gpu.device().cmd_reset_query_pool(r.commands, queries, 0, 1);
            functions.cmd_write_acceleration_structures_properties(r.commands, &[structure.handle], kind, queries, 0);
        }
        Ok(())
    });
    let mut bytes = [0u64];
    // SAFETY: the query was written if the submission succeeded, and nothing uses the pool any more.
    let read = unsafe {
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        let read = asked.and_then(|((), times)| {
            let read = gpu.device().get_query_pool_results(queries, 0, &mut bytes, flags);
            read.map(|()| times).map_err(failed("vkGetQueryPoolResults"))
        });
        gpu.device().destroy_query_pool(queries, None);
        read
    };
    let mut times = read?;
    let ty = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
    let smaller = Structure::new(gpu, "olbvh.acceleration.compacted", ty, bytes[0])?;
    let ((), more) = gpu.submit("olbvh.acceleration.compact", |r| {
        r.stage("acceleration.compact", |r| {
            let info = vk::CopyAccelerationStructureInfoKHR::default().src(structure.handle).dst(smaller.handle);
            // SAFETY: the copy has the size that the device reported.
            unsafe {
                functions.cmd_copy_acceleration_structure(r.commands, &info.mode(vk::CopyAccelerationStructureModeKHR::COMPACT));
            }
            Ok(())
        })?;
        barrier_after(r);
        Ok(())
    })?;
    times.add(more);
    Ok((smaller, times))
}

/// A scene of triangles in which `GL_EXT_ray_query` and `GL_EXT_ray_tracing` trace rays.
pub struct AccelerationStructure {
    scene: Structure,
    triangles: Structure,
    built_bytes: u64,
    scratch_bytes: u64,
    times: StageTimes,
    _instance: Buffer,
}

impl AccelerationStructure {
    /// Builds the structure, compacts it, and makes the scene. Triangle i of the input is primitive i of the scene. All
    /// are opaque.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the device does not support ray tracing, [`Error::TooLarge`], [`Error::Memory`], or a
    /// failed Vulkan call.
    pub(crate) fn build(gpu: &Gpu, input: &Triangles) -> Result<Self> {
        let most = extension(gpu)?.most_triangles;
        if u64::from(input.count) > most {
            return Err(Error::TooLarge(format!("{} triangles; the device's acceleration structures hold {most}", input.count)));
        }
        let scaled = |s: f32| [s, 0.0, 0.0, 0.0, 0.0, s, 0.0, 0.0, 0.0, 0.0, s, 0.0];
        let transform = gpu.upload::<f32>("olbvh.acceleration.transform", &scaled(input.scale))?;
        let address = |of: BufferRef| vk::DeviceOrHostAddressConstKHR { device_address: of.address };
        let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
            .vertex_format(vk::Format::R32G32B32_SFLOAT)
            .vertex_data(address(input.vertices))
            .vertex_stride(VERTEX_STRIDE)
            .max_vertex(input.points.saturating_sub(1))
            .index_type(vk::IndexType::UINT32)
            .index_data(address(input.indices))
            .transform_data(address(transform.all()));
        let geometry = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
            .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
            .flags(vk::GeometryFlagsKHR::OPAQUE);
        let names = ["olbvh.acceleration.built", "acceleration.build"];
        let bottom = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
        let (built, scratch_bytes, mut times) = build(gpu, names, bottom, geometry, input.count)?;
        let (triangles, time) = compact(gpu, &built)?;
        times.add(time);
        // The words of a VkAccelerationStructureInstanceKHR: transform, mask and index, flags and offset, reference.
        let mut words: Vec<u32> = scaled(1.0).map(f32::to_bits).to_vec();
        words.extend([0xff00_0000, 0, triangles.address as u32, (triangles.address >> 32) as u32]);
        let instance = gpu.upload("olbvh.acceleration.instance", &words)?;
        let instances = vk::AccelerationStructureGeometryInstancesDataKHR::default().data(address(instance.all()));
        let geometry = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(vk::AccelerationStructureGeometryDataKHR { instances });
        let names = ["olbvh.acceleration.scene", "acceleration.scene"];
        let (scene, _, time) = build(gpu, names, vk::AccelerationStructureTypeKHR::TOP_LEVEL, geometry, 1)?;
        times.add(time);
        Ok(Self { scene, triangles, built_bytes: built.memory.size(), scratch_bytes, times, _instance: instance })
    }

    /// Device address of the scene, low word first, for `accelerationStructureEXT(uvec2)` in shaders. The scene is
    /// visible to shaders that trace rays.
    pub fn address(&self) -> [u32; 2] {
        [self.scene.address as u32, (self.scene.address >> 32) as u32]
    }

    /// Bytes of the structure and its scene, after compaction.
    pub fn bytes(&self) -> u64 {
        self.triangles.memory.size() + self.scene.memory.size()
    }

    /// Bytes of the structure before compaction.
    pub fn built_bytes(&self) -> u64 {
        self.built_bytes
    }

    /// Bytes of scratch memory that the build used.
    pub fn scratch_bytes(&self) -> u64 {
        self.scratch_bytes
    }

    /// What build, compaction and scene took.
    pub fn times(&self) -> &StageTimes {
        &self.times
    }
}

impl std::fmt::Debug for AccelerationStructure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "AccelerationStructure({} bytes, {} before compaction)", self.bytes(), self.built_bytes)
    }
}
