//! A host's Vulkan device, across the border to C.

use super::{OlbvhGpu, OlbvhStatus, border, give, handle, missing, put};
use crate::error::Error;
use crate::gpu::{Enabled, Gpu, GpuOptions, HostDevice, Requirements};
use ash::vk::{self, Handle};
use std::ffi::c_char;
use std::ptr::null;
use std::sync::{Arc, Mutex};

/// What a host enables when it makes a device for olbvh.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhHostRequirements {
    /// The first queue family with compute; any other with compute will do.
    pub queue_family: u32,
    /// Not 0: the device has the feature `bufferDeviceAddress`. Without it, buffers are bound by descriptors.
    pub buffer_addresses: u32,
    /// Not 0: it has the feature `shaderInt64`.
    pub shader_int64: u32,
    /// Not 0: it has the features `subgroupSizeControl` and `computeFullSubgroups`, and heeds them.
    pub subgroup_size_control: u32,
    /// Number of names that follow.
    pub extension_count: u32,
    /// Names of device extensions, which stay where they are.
    pub extensions: [*const c_char; 4],
}

/// Tells what to enable on a physical device before a device is made from it. Handles are cast to `uint64_t`, `vkGetInstanceProcAddr` to a function without
/// arguments. Ends with `OLBVH_STATUS_DEVICE` where the device does not qualify; `olbvh_last_error` tells what it lacks.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_host_check(
    get_instance_proc_addr: Option<unsafe extern "C" fn()>,
    instance: u64,
    physical_device: u64,
    out: *mut OlbvhHostRequirements,
) -> OlbvhStatus {
    border(|| {
        let Some(get) = get_instance_proc_addr.filter(|_| instance != 0 && physical_device != 0) else {
            return Err(missing("the loader's function or a handle"));
        };
        // SAFETY: the host passes the loader's function and handles of a living instance.
        let instance = unsafe { load(get, instance) };
        let found = Requirements::check(&instance, vk::PhysicalDevice::from_raw(physical_device));
        if !found.missing.is_empty() {
            return Err(Error::NoDevice(format!("the physical device lacks {}", found.missing.join(", "))));
        }
        let mut told = OlbvhHostRequirements {
            queue_family: found.queue_family.unwrap_or_default().0,
            buffer_addresses: found.buffer_addresses.into(),
            shader_int64: found.shader_int64.into(),
            subgroup_size_control: found.subgroup_size_control.into(),
            extension_count: 0,
            extensions: [null(); 4],
        };
        for (name, place) in found.extensions_without_rays().zip(&mut told.extensions) {
            *place = name.as_ptr();
            told.extension_count += 1;
        }
        put(out, told)
    })
}

/// The functions of an instance.
///
/// # Safety
/// The loader's function, cast, and a living instance.
unsafe fn load(get: unsafe extern "C" fn(), instance: u64) -> ash::Instance {
    // SAFETY: as promised.
    unsafe {
        let get = std::mem::transmute::<unsafe extern "C" fn(), vk::PFN_vkGetInstanceProcAddr>(get);
        ash::Instance::load(&ash::StaticFn { get_instance_proc_addr: get }, vk::Instance::from_raw(instance))
    }
}

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
            let instance = load(get, host.instance);
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
