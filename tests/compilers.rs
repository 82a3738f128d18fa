//! What a compiler for GPUs makes of the kernels: that of Mesa's driver for AMD, which compiles for a GPU that is not
//! there (`RADV_FORCE_FAMILY`). A processor's driver never fuses a product and a sum into one operation with one
//! rounding; a GPU's does wherever `precise` is missing, and its results would then differ from those of other devices.

#![allow(unsafe_code, reason = "plain Vulkan, without the crate: what is compiled is never run")]
#![allow(clippy::unwrap_used)]

use ash::vk;
use std::fs;
use std::path::PathBuf;

/// A device of the row's driver, on which nothing can run.
struct Compiler {
    device: ash::Device,
    executables: ash::khr::pipeline_executable_properties::Device,
    layout: vk::PipelineLayout,
    instance: ash::Instance,
    _entry: ash::Entry,
}

/// A kernel as compiled.
struct Compiled {
    statistics: Vec<(String, u64)>,
    assembly: String,
}

impl Compiler {
    fn new() -> Self {
        // SAFETY: plain Vulkan; all structs outlive the calls that read them, and the device has the extension.
        unsafe {
            let entry = ash::Entry::load().unwrap();
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let instance = entry.create_instance(&vk::InstanceCreateInfo::default().application_info(&application), None).unwrap();
            let physical = instance.enumerate_physical_devices().unwrap()[0];
            let name = instance.get_physical_device_properties(physical).device_name_as_c_str().unwrap().to_owned();
            assert!(name.to_str().unwrap().contains("RADV"), "{name:?}: this test needs the driver that scripts/setup unpacks as radv");
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let extensions = [ash::khr::pipeline_executable_properties::NAME.as_ptr()];
            let core = vk::PhysicalDeviceFeatures::default().shader_int64(true);
            let mut executable = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
            let mut addresses = vk::PhysicalDeviceBufferDeviceAddressFeatures::default().buffer_device_address(true);
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&extensions)
                .enabled_features(&core)
                .push_next(&mut executable)
                .push_next(&mut addresses);
            let device = instance.create_device(physical, &info, None).unwrap();
            let executables = ash::khr::pipeline_executable_properties::Device::new(&instance, &device);
            let buffer = vk::DescriptorSetLayoutBinding::default()
                .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::COMPUTE);
            let buffers: Vec<_> = (0..32).map(|i| buffer.binding(i)).collect();
            let set = device.create_descriptor_set_layout(&vk::DescriptorSetLayoutCreateInfo::default().bindings(&buffers), None).unwrap();
            let push = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(256)];
            let layout = vk::PipelineLayoutCreateInfo::default().set_layouts(std::slice::from_ref(&set)).push_constant_ranges(&push);
            let layout = device.create_pipeline_layout(&layout, None).unwrap();
            Self { device, executables, layout, instance, _entry: entry }
        }
    }

    /// Compiles a kernel. `value` is that of all its specialization constants but the first two, the size of workgroups
    /// and the items of an invocation.
    fn compile(&self, code: &[u32], value: Option<u32>) -> Compiled {
        let ids = if value.is_some() { 2..12 } else { 0..0 };
        let entries: Vec<_> = ids.map(|id| vk::SpecializationMapEntry { constant_id: id, offset: 0, size: 4 }).collect();
        let data = value.unwrap_or_default().to_ne_bytes();
        let constants = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
        // SAFETY: as in `new`; the pointers to text are valid while it is written.
        unsafe {
            let module = self.device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(code), None).unwrap();
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main")
                .specialization_info(&constants);
            let kept = vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR | vk::PipelineCreateFlags::CAPTURE_INTERNAL_REPRESENTATIONS_KHR;
            let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(self.layout).flags(kept)];
            let pipeline = self.device.create_compute_pipelines(vk::PipelineCache::null(), &info, None).unwrap()[0];
            let executable = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
            let statistics = self.executables.get_pipeline_executable_statistics(&executable).unwrap();
            let statistics = statistics.iter().map(|s| (s.name_as_c_str().unwrap().to_str().unwrap().to_owned(), s.value.u64)).collect();
            let mut texts = self.executables.get_pipeline_executable_internal_representations(&executable).unwrap();
            let mut room: Vec<Vec<u8>> = texts.iter().map(|t| vec![0; t.data_size]).collect();
            for (text, room) in texts.iter_mut().zip(&mut room) {
                text.p_data = room.as_mut_ptr().cast();
            }
            let mut count = texts.len() as u32;
            let read = self.executables.fp().get_pipeline_executable_internal_representations_khr;
            read(self.device.handle(), &raw const executable, &raw mut count, texts.as_mut_ptr()).result().unwrap();
            let assembly = texts.iter().position(|t| t.name_as_c_str() == Ok(c"Assembly")).unwrap();
            let assembly = String::from_utf8_lossy(&room[assembly]).into_owned();
            self.device.destroy_pipeline(pipeline, None);
            self.device.destroy_shader_module(module, None);
            Compiled { statistics, assembly }
        }
    }
}

/// Operations of products and sums with a single rounding, but for those with a factor of 2, which is exact.
fn fused(assembly: &str) -> impl Iterator<Item = &str> {
    let operations = assembly.lines().flat_map(|line| line.split(';').next().unwrap_or_default().split("::")).map(str::trim);
    operations.filter(|operation| {
        let name = operation.split_whitespace().next().unwrap_or_default();
        let doubles = [" 2.0,", " 0x40000000,"].iter().any(|two| operation.contains(two));
        name.starts_with("v_") && name.contains("_fma") && !doubles
    })
}

#[test]
fn fused_operations_are_recognised() {
    let found = |line: &str| fused(line).count();
    assert_eq!(found("\tv_fma_f32 v64, v51, -v56, v64    ; d541"), 1);
    assert_eq!(found("\tv_dual_add_f32 v1, v2, v3 :: v_dual_fmac_f32 v4, v5, v6 ; c880"), 1);
    assert_eq!(found("\tv_dual_fmac_f32 v59, 2.0, v3 :: v_dual_sub_f32 v58, v55, v58"), 0);
    assert_eq!(found("\tv_fmamk_f32 v14, v5, 0x40000000, v66"), 0);
    assert_eq!(found("\tv_fmamk_f32 v14, v5, 0x40400000, v66"), 1);
    assert_eq!(found("\tv_mul_f32_e64 v66, |v39|, |v41|"), 0);
}

#[test]
#[ignore = "runs on the row `radv` of scripts/test"]
fn kernels_are_compiled_as_written() {
    let compiler = Compiler::new();
    let is_kernel = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        // Rays are traced by other kinds of shaders, and answer only to a tolerance.
        (name.ends_with(".address.spv") || name.ends_with(".descriptor.spv")) && !name.starts_with("baseline.7")
    };
    let mut kernels: Vec<_> = fs::read_dir(env!("OUT_DIR")).unwrap().map(|f| f.unwrap().path()).filter(is_kernel).collect();
    kernels.sort();
    assert!(kernels.len() > 100, "{} kernels in {}", kernels.len(), env!("OUT_DIR"));
    let mut faults = Vec::new();
    for path in &kernels {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let code: Vec<u32> = fs::read(path).unwrap().chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect();
        for value in [None, Some(1), Some(2)] {
            let compiled = compiler.compile(&code, value);
            let all = |wanted: &str| compiled.statistics.iter().find(|(name, _)| name == wanted).unwrap().1;
            println!("{name} {value:?}: {} registers, {} bytes", all("VGPRs"), all("Code size"));
            assert!(compiled.assembly.contains("v_"), "{name}: no assembly");
            faults.extend(fused(&compiled.assembly).map(|operation| format!("{name} {value:?}: {operation}")));
            if all("Spilled VGPRs") > 0 {
                faults.push(format!("{name} {value:?}: {} registers are spilled", all("Spilled VGPRs")));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    // SAFETY: nothing made from the device but its layouts is left, and nothing runs.
    unsafe {
        compiler.device.destroy_device(None);
        compiler.instance.destroy_instance(None);
    }
}
