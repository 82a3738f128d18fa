//! A host's Vulkan device, across the border to C.

use super::{OlbvhGpu, OlbvhStatus, border, give, handle, missing};
use crate::error::Error;
use crate::gpu::{Enabled, Gpu, GpuOptions, HostDevice};
use ash::vk::{self, Handle};
use std::sync::{Arc, Mutex};

/// A Vulkan device of the host's, to be used and never destroyed by olbvh. Handles are cast to `uint64_t`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhHostDevice {
    /// `vkGetInstanceProcAddr`, cast to this type.
    pub get_instance_proc_addr: Option<unsafe extern "C" fn()>,
    /// `VkInstance`, of Vulkan 1.2 or later.
    pub instance: u64,
    /// `VkPhysicalDevice`.
    pub physical_device: u64,
    /// `VkDevice`.
    pub device: u64,
    /// `VkQueue` of that family. Nobody else submits to it while a function runs that does work at once (`olbvh_gpu_from_host` with its self-test, uploads,
    /// builds, queries); those that record do not touch it. 0: recording is all that is done, untested.
    pub queue: u64,
    /// `VkPipelineCache` of the host's, which knows the kernels of earlier runs. 0: one that lasts as long as the `olbvh_gpu`.
    pub pipeline_cache: u64,
    /// Queue family with compute; it needs nothing else.
    pub queue_family: u32,
    /// Not 0: the feature `bufferDeviceAddress` is enabled.
    pub buffer_addresses: u32,
    /// Not 0: feature `shaderInt64` is enabled, which only drivers for processors profit from.
    pub shader_int64: u32,
    /// Not 0: `VK_EXT_subgroup_size_control` (or Vulkan 1.3) is enabled with `subgroupSizeControl` and `computeFullSubgroups`. Wanted where subgroup sizes
    /// vary: without it the driver is trusted to run kernels with its usual size, which the self-test at the opening checks; Intel's are not.
    pub subgroup_size_control: u32,
    /// Not 0: the instance extension `VK_EXT_debug_utils` is enabled.
    pub debug_utils: u32,
}

/// Works on a device of the host's, which outlives everything made from the handle. Buffers are used by queues of that family alone, with exclusive sharing: a
/// host that reads or writes them on another family transfers their ownership.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_gpu_from_host(host: *const OlbvhHostDevice, out: *mut *mut OlbvhGpu) -> OlbvhStatus {
    border(|| {
        let host = handle(host, "host")?;
        let null = [host.instance, host.physical_device, host.device].contains(&0);
        let Some(get) = host.get_instance_proc_addr.filter(|_| !null) else {
            return Err(missing("a handle of the host's device"));
        };
        // SAFETY: the host passes handles of one living device, and the loader's function.
        let gpu = unsafe {
            let get = std::mem::transmute::<unsafe extern "C" fn(), vk::PFN_vkGetInstanceProcAddr>(get);
            let functions = ash::StaticFn { get_instance_proc_addr: get };
            let instance = ash::Instance::load(&functions, vk::Instance::from_raw(host.instance));
            let device = ash::Device::load(instance.fp_v1_0(), vk::Device::from_raw(host.device));
            let lent = HostDevice {
                physical: vk::PhysicalDevice::from_raw(host.physical_device),
                device,
                family: host.queue_family,
                queue: (host.queue != 0).then(|| Arc::new(Mutex::new(vk::Queue::from_raw(host.queue)))),
                allocator: None,
                pipeline_cache: (host.pipeline_cache != 0).then(|| vk::PipelineCache::from_raw(host.pipeline_cache)),
                enabled: Enabled {
                    buffer_addresses: host.buffer_addresses != 0,
                    shader_int64: host.shader_int64 != 0,
                    subgroup_size_control: host.subgroup_size_control != 0,
                    debug_utils: host.debug_utils != 0,
                    ..Enabled::default()
                },
                instance,
            };
            Gpu::from_raw(lent, &GpuOptions::default())
        };
        give(
            out,
            OlbvhGpu(gpu.map_err(|e| match e {
                Error::NoDevice(why) => Error::NoDevice(format!("the host's device: {why}")),
                other => other,
            })?),
        )
    })
}
