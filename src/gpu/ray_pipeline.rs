//! Ray-tracing pipelines (`VK_KHR_ray_tracing_pipeline`), for devices without ray queries: one shader launches rays,
//! one receives the closest hits, one the misses. Buffers are passed by address, which every such device supports.

use super::context::{Binding, Gpu};
use super::kernel::{Kernel, KernelInfo, push_constants, uses};
use super::memory::Buffer;
use super::ray_functions::RayFunctions;
use super::recorder::Recorder;
use super::{debug, failed};
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;

/// Rays of one row of a launch.
const ROW: u32 = 1 << 16;

fn extension(gpu: &Gpu) -> Result<&RayFunctions> {
    let functions = gpu.acceleration().and_then(|a| a.pipelines.as_ref());
    functions.ok_or_else(|| Error::Invalid(format!("{} has no ray-tracing pipelines", gpu.report().name)))
}

/// A pipeline of three shaders, without specialization constants.
pub(crate) struct RayPipeline {
    gpu: Gpu,
    info: &'static KernelInfo,
    handle: vk::Pipeline,
    layout: vk::PipelineLayout,
    /// Shader binding tables of the launch, miss and hit shaders.
    tables: [vk::StridedDeviceAddressRegionKHR; 3],
    memory: Option<Buffer>,
}

impl RayPipeline {
    /// Compiles the shader that launches rays, the one for rays that miss, and the one for the closest hit.
    ///
    /// # Errors
    /// [`Error::Invalid`] without the extension, [`Error::Memory`], or a failed Vulkan call.
    pub(crate) fn new<Launch: Kernel, Miss: Kernel, Hit: Kernel>(gpu: &Gpu) -> Result<Self> {
        let functions = &extension(gpu)?.functions;
        let device = gpu.device();
        let info = Launch::INFO;
        let bytes = info.push_bytes(Binding::Address) as u32;
        let ranges = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::RAYGEN_KHR).size(bytes)];
        let layout_info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges);
        // SAFETY: plain creation; destroyed when `made` is dropped.
        let layout = unsafe { device.create_pipeline_layout(&layout_info, None) }.map_err(failed("vkCreatePipelineLayout"))?;
        let (tables, handle) = ([vk::StridedDeviceAddressRegionKHR::default(); 3], vk::Pipeline::null());
        let mut made = Self { gpu: gpu.clone(), info, handle, layout, tables, memory: None };
        let stages = [
            (Launch::INFO, vk::ShaderStageFlags::RAYGEN_KHR),
            (Miss::INFO, vk::ShaderStageFlags::MISS_KHR),
            (Hit::INFO, vk::ShaderStageFlags::CLOSEST_HIT_KHR),
        ];
        let mut modules = Modules { device, made: Vec::new() };
        for (kernel, _) in stages {
            modules.add(kernel)?;
        }
        let of = |i: usize| vk::PipelineShaderStageCreateInfo::default().stage(stages[i].1).module(modules.made[i]).name(c"main");
        let (unused, general) = (vk::SHADER_UNUSED_KHR, vk::RayTracingShaderGroupTypeKHR::GENERAL);
        let group = vk::RayTracingShaderGroupCreateInfoKHR::default().general_shader(unused).closest_hit_shader(unused);
        let group = group.any_hit_shader(unused).intersection_shader(unused);
        let hit = group.ty(vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP).closest_hit_shader(2);
        let groups = [group.ty(general).general_shader(0), group.ty(general).general_shader(1), hit];
        let stages = [of(0), of(1), of(2)];
        let create_info = vk::RayTracingPipelineCreateInfoKHR::default().stages(&stages).groups(&groups);
        let infos = [create_info.max_pipeline_ray_recursion_depth(1).layout(layout)];
        // SAFETY: all structs outlive the call; objects belong to this device.
        let pipelines =
            unsafe { functions.create_ray_tracing_pipelines(vk::DeferredOperationKHR::null(), gpu.pipeline_cache(), &infos, None) };
        made.handle = pipelines.map_err(|(_, e)| failed("vkCreateRayTracingPipelinesKHR")(e))?[0];
        debug::name(gpu.debug_device(), made.handle, info.name);
        made.fill_tables()?;
        Ok(made)
    }

    /// Writes the shaders' handles to the shader binding tables.
    fn fill_tables(&mut self) -> Result<()> {
        let RayFunctions { functions, handle_bytes, alignment, .. } = extension(&self.gpu)?;
        // SAFETY: the pipeline has three groups.
        let handles = unsafe { functions.get_ray_tracing_shader_group_handles(self.handle, 0, 3, 3 * *handle_bytes as usize) };
        let handles = handles.map_err(failed("vkGetRayTracingShaderGroupHandlesKHR"))?;
        let size = u64::from(handle_bytes.next_multiple_of(*alignment));
        let usage = vk::BufferUsageFlags::SHADER_BINDING_TABLE_KHR;
        let (name, bytes) = ("olbvh.ray_pipeline.tables", 3 * size + u64::from(*alignment));
        let mut memory = Buffer::with_usage(&self.gpu, name, bytes, MemoryLocation::CpuToGpu, usage)?;
        let begin = memory.all().address.next_multiple_of(u64::from(*alignment));
        let skipped = (begin - memory.all().address) as usize;
        let mapped = memory.mapped_mut().ok_or_else(|| Error::Memory { name: name.into(), bytes, reason: "it is not mapped".into() })?;
        for (i, handle) in handles.chunks_exact(*handle_bytes as usize).enumerate() {
            let at = skipped + i * size as usize;
            mapped[at..at + handle.len()].copy_from_slice(handle);
            self.tables[i] = vk::StridedDeviceAddressRegionKHR { device_address: begin + i as u64 * size, stride: size, size };
        }
        self.memory = Some(memory);
        Ok(())
    }

    /// Records the launch of `count` rays, in rows of 65,536. Reads what compute shaders and transfers wrote before.
    /// What it writes is visible to following compute shaders and transfers, and to the host.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for more rays than the device can launch at once.
    pub(crate) fn record<Launch: Kernel>(&self, r: &mut Recorder<'_>, arguments: &Launch, count: u32) -> Result<()> {
        let RayFunctions { functions, most_rays, .. } = extension(&self.gpu)?;
        let (width, height) = (count.min(ROW), count.div_ceil(ROW));
        if u64::from(width) * u64::from(height) > u64::from(*most_rays) {
            return Err(Error::TooLarge(format!("{count} rays; the device launches {most_rays} at a time")));
        }
        if count == 0 {
            return Ok(());
        }
        let (shader, transfer) = (vk::PipelineStageFlags::COMPUTE_SHADER, vk::PipelineStageFlags::TRANSFER);
        let (rays, reads) = (vk::PipelineStageFlags::RAY_TRACING_SHADER_KHR, vk::AccessFlags::SHADER_READ);
        let writes = vk::AccessFlags::SHADER_WRITE;
        r.barrier_between("compute → rays", (shader | transfer, writes | vk::AccessFlags::TRANSFER_WRITE), (rays, reads | writes));
        r.touch(&uses(arguments), self.info.name);
        if !r.is_rehearsal() {
            let push = push_constants(arguments, Binding::Address)?;
            let ([launch, miss, hit], callable) = (&self.tables, vk::StridedDeviceAddressRegionKHR::default());
            // SAFETY: pipeline and tables belong together and to this device; the push constants fit the layout, which
            // was made from the same numbers; the creator of the recorder guarantees a valid command buffer.
            unsafe {
                let device = self.gpu.device();
                device.cmd_bind_pipeline(r.commands, vk::PipelineBindPoint::RAY_TRACING_KHR, self.handle);
                device.cmd_push_constants(r.commands, self.layout, vk::ShaderStageFlags::RAYGEN_KHR, 0, &push);
                functions.cmd_trace_rays(r.commands, launch, miss, hit, &callable, width, height, 1);
            }
        }
        let target =
            (shader | transfer | vk::PipelineStageFlags::HOST, reads | vk::AccessFlags::TRANSFER_READ | vk::AccessFlags::HOST_READ);
        r.barrier_between("rays → compute", (rays, writes), target);
        Ok(())
    }
}

/// Shader modules, which are needed while a pipeline is made from them.
struct Modules<'a> {
    device: &'a ash::Device,
    made: Vec<vk::ShaderModule>,
}

impl Modules<'_> {
    fn add(&mut self, kernel: &KernelInfo) -> Result<()> {
        let words = kernel.words(Binding::Address, false);
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the code was produced by the shader compiler.
        self.made.push(unsafe { self.device.create_shader_module(&info, None) }.map_err(failed("vkCreateShaderModule"))?);
        Ok(())
    }
}

impl Drop for Modules<'_> {
    fn drop(&mut self) {
        for &module in &self.made {
            // SAFETY: a pipeline does not refer to its modules after its creation.
            unsafe { self.device.destroy_shader_module(module, None) };
        }
    }
}

impl Drop for RayPipeline {
    fn drop(&mut self) {
        // SAFETY: work with the pipeline has ended, since owning calls wait for their submissions.
        unsafe {
            self.gpu.device().destroy_pipeline(self.handle, None);
            self.gpu.device().destroy_pipeline_layout(self.layout, None);
        }
    }
}

impl std::fmt::Debug for RayPipeline {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "RayPipeline({})", self.info.name)
    }
}
