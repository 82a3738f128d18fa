//! Properties of kernels known at build time, and their pipelines.

use super::buffer_ref::BufferRef;
use super::context::{Binding, Gpu};
use super::pipelines::Pipeline;
use super::{debug, failed};
use crate::error::{Error, Result};
use ash::vk;

/// How a kernel uses a buffer, from its declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    Read,
    Write,
    ReadWrite,
}

#[derive(Debug)]
pub(crate) struct BufferInfo {
    pub name: &'static str,
    pub access: Access,
    /// Its address must be a multiple of this.
    pub alignment: u64,
}

/// A kernel as reflected by `build.rs`.
#[derive(Debug)]
pub(crate) struct KernelInfo {
    pub name: &'static str,
    pub address: &'static [u8],
    /// SPIR-V with buffers by address, and records of four words read as two 64-bit words.
    pub wide: &'static [u8],
    pub descriptor: &'static [u8],
    pub buffers: &'static [BufferInfo],
    pub scalar_bytes: usize,
    /// Whether it belongs to queries, or to the baselines that they are compared with.
    pub for_queries: bool,
}

/// Specialization constants as pairs (id, value).
pub(crate) trait Specialization: Copy + Default {
    fn values(&self) -> Vec<(u32, u32)>;
}

/// A kernel by the type of its arguments; implemented by generated code.
pub(crate) trait Kernel: Arguments {
    type Spec: Specialization;
    const INFO: &'static KernelInfo;
}

/// The arguments of a kernel.
pub(crate) trait Arguments {
    fn info(&self) -> &'static KernelInfo;
    fn buffers(&self) -> Vec<BufferRef>;
    /// Writes the scalars into the push-constant bytes, from byte `base` on.
    fn scalars(&self, base: usize, out: &mut [u8]);
}

impl KernelInfo {
    /// Bytes of push constants that precede the scalars.
    pub(crate) fn scalar_base(&self, binding: Binding) -> usize {
        if binding == Binding::Address { 8 * self.buffers.len() } else { 0 }
    }

    /// Bytes of push constants.
    pub(super) fn push_bytes(&self, binding: Binding) -> usize {
        self.scalar_base(binding) + self.scalar_bytes
    }

    /// The SPIR-V words of a variant.
    pub(super) fn words(&self, binding: Binding, wide: bool) -> Vec<u32> {
        let code = match binding {
            Binding::Address if wide => self.wide,
            Binding::Address => self.address,
            Binding::Descriptors => self.descriptor,
        };
        code.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
    }
}

/// The push constants of a kernel: its scalars, preceded by the addresses of its buffers if they are passed by address.
/// Addresses are checked, since a host may have omitted one and the device would access address 0.
pub(super) fn push_constants(arguments: &dyn Arguments, binding: Binding) -> Result<Vec<u8>> {
    let kernel = arguments.info();
    let mut push = vec![0u8; kernel.push_bytes(binding)];
    arguments.scalars(kernel.scalar_base(binding), &mut push);
    if binding == Binding::Address {
        for ((place, buffer), info) in push.chunks_exact_mut(8).zip(arguments.buffers()).zip(kernel.buffers) {
            // Kernels do not access an empty buffer.
            if buffer.size > 0 && (buffer.address == 0 || !buffer.address.is_multiple_of(info.alignment)) {
                let fault = if buffer.address == 0 {
                    "has no device address".into()
                } else {
                    format!("is not at a multiple of {} bytes", info.alignment)
                };
                return Err(Error::Invalid(format!("{} is given `{}`, which {fault}", kernel.name, info.name)));
            }
            place.copy_from_slice(&buffer.address.to_le_bytes());
        }
    }
    Ok(push)
}

/// The ranges that a kernel uses, and whether it writes each.
pub(super) fn uses(arguments: &dyn Arguments) -> Vec<(BufferRef, bool)> {
    arguments.buffers().into_iter().zip(arguments.info().buffers).map(|(b, i)| (b, i.access != Access::Read)).collect()
}

impl Gpu {
    /// The pipeline of a kernel with these constants, compiled at first use.
    pub(super) fn pipeline(&self, kernel: &'static KernelInfo, constants: Vec<(u32, u32)>) -> Result<Pipeline> {
        let key = (kernel.name, constants);
        if let Some(found) = self.pipelines().find(&key) {
            return Ok(found);
        }
        let made = create_pipeline(self, kernel, &key.1)?;
        Ok(self.pipelines().keep(self.device(), key, made))
    }
}

/// Compiles a kernel for a device.
fn create_pipeline(gpu: &Gpu, info: &KernelInfo, constants: &[(u32, u32)]) -> Result<Pipeline> {
    let mut made = Pipeline::default();
    let compiled = compile(gpu, info, constants, &mut made);
    if compiled.is_err() {
        // SAFETY: the pipeline has not been handed out.
        unsafe { made.destroy(gpu.device()) };
    }
    compiled.map(|()| made)
}

/// Makes the parts of a pipeline, in order.
fn compile(gpu: &Gpu, info: &KernelInfo, constants: &[(u32, u32)], made: &mut Pipeline) -> Result<()> {
    let device = gpu.device();
    let binding = gpu.binding();
    let words = info.words(binding, gpu.reads_wide());
    let bindings: Vec<_> = (0..info.buffers.len() as u32)
        .map(|i| {
            let b = vk::DescriptorSetLayoutBinding::default().binding(i).descriptor_count(1);
            b.descriptor_type(vk::DescriptorType::STORAGE_BUFFER).stage_flags(vk::ShaderStageFlags::COMPUTE)
        })
        .collect();
    let push_bytes = info.push_bytes(binding) as u32;
    let ranges = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(push_bytes)];
    let entries: Vec<_> = constants
        .iter()
        .enumerate()
        .map(|(i, (id, _))| vk::SpecializationMapEntry { constant_id: *id, offset: 4 * i as u32, size: 4 })
        .collect();
    let values: Vec<u8> = constants.iter().flat_map(|(_, v)| v.to_le_bytes()).collect();
    let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(&values);
    // SAFETY: all structs outlive the calls; objects belong to this device; on failure the caller destroys the parts
    // that were made.
    unsafe {
        if binding == Binding::Descriptors {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            made.set_layout = device.create_descriptor_set_layout(&info, None).map_err(failed("vkCreateDescriptorSetLayout"))?;
        }
        let sets = [made.set_layout];
        let mut layout_info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(if push_bytes > 0 { &ranges } else { &[] });
        if binding == Binding::Descriptors {
            layout_info = layout_info.set_layouts(&sets);
        }
        made.layout = device.create_pipeline_layout(&layout_info, None).map_err(failed("vkCreatePipelineLayout"))?;
        let module = device
            .create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&words), None)
            .map_err(failed("vkCreateShaderModule"))?;
        let mut stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(&specialization);
        let size = gpu.subgroup_size_of(info);
        let mut required = vk::PipelineShaderStageRequiredSubgroupSizeCreateInfo::default().required_subgroup_size(size);
        if gpu.requires_subgroup_size() {
            // Where the driver may choose the subgroup size, `gl_SubgroupSize` and the lanes that run can differ:
            // require the size and full subgroups.
            stage = stage.push_next(&mut required).flags(vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS);
        }
        let infos = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(made.layout)];
        let pipelines = device.create_compute_pipelines(gpu.pipeline_cache(), &infos, None);
        device.destroy_shader_module(module, None);
        made.handle = pipelines.map_err(|(_, e)| failed("vkCreateComputePipelines")(e))?[0];
    }
    debug::name(gpu.debug_device(), made.handle, info.name);
    debug::name(gpu.debug_device(), made.layout, info.name);
    Ok(())
}
