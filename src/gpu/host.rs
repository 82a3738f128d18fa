//! A device that belongs to the host application: what it must have enabled, and what it provides.

use super::context::{Gpu, GpuOptions};
use super::foundation::Foundation;
use super::queue::HostQueue;
use super::requirements::{DeviceReport, RayTracing, Requirements};
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::Allocator;
use std::sync::{Arc, Mutex};

/// The features and extensions of [`super::Requirements`] that the host has enabled. Nothing else of the device is
/// used, even if it is supported.
#[derive(Clone, Copy, Debug, Default)]
#[allow(clippy::struct_excessive_bools)]
pub struct EnabledFeatures {
    /// Feature `bufferDeviceAddress`; without it kernels receive their buffers as descriptors.
    pub buffer_addresses: bool,
    /// Feature `shaderInt64`, which only helps drivers that run on a processor.
    pub shader_int64: bool,
    /// `VK_EXT_subgroup_size_control` (or Vulkan 1.3) with `subgroupSizeControl` and `computeFullSubgroups`. Wanted
    /// where subgroup sizes vary. Without it a warning is logged and the driver is trusted to run kernels with its
    /// usual size, which the self-test checks; Intel's drivers are not trusted in this.
    pub subgroup_size_control: bool,
    /// `VK_KHR_acceleration_structure`, and `VK_KHR_ray_query` and `VK_KHR_ray_tracing_pipeline` as set here, with
    /// their features. Used by a baseline only.
    pub ray_tracing: RayTracing,
    /// Instance extension `VK_EXT_debug_utils`: objects are named and stages labelled.
    pub debug_utils: bool,
}

/// A Vulkan device owned by the host. The fields are cheap handles and function tables; this crate never destroys any
/// of them.
#[derive(Clone)]
pub struct HostDevice {
    /// The instance, of Vulkan 1.2 or later.
    pub instance: ash::Instance,
    /// The physical device.
    pub physical: vk::PhysicalDevice,
    /// The logical device.
    pub device: ash::Device,
    /// Family of the queues that the recorded commands are submitted to; it must support compute.
    pub family: u32,
    /// A queue of that family with the lock that the host also takes for its own submissions; used by the owning calls
    /// and the start-up self-test. `None`: only the `cmd_*` functions can be used, and the device is not tested.
    pub queue: Option<Arc<dyn HostQueue>>,
    /// The host's allocator, made with `buffer_device_address` if that is enabled. `None`: this crate makes its own.
    pub allocator: Option<Arc<Mutex<Allocator>>>,
    /// The host's pipeline cache, which must not require external synchronization, since several threads compile
    /// simultaneously. `None`: this crate makes its own.
    pub pipeline_cache: Option<vk::PipelineCache>,
    /// What is enabled.
    pub enabled: EnabledFeatures,
}

impl std::fmt::Debug for HostDevice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "HostDevice({:?}, {:?})", self.device.handle(), self.enabled)
    }
}

impl Gpu {
    /// Uses a device of the host. Of `options`, `device` is ignored, and `pipeline_cache` is used only if the host
    /// provides no cache.
    ///
    /// Buffers are used on queues of `host.family` only, with exclusive sharing: a host that reads or writes them on
    /// another family must transfer their ownership. A `Gpu` can be used by any number of threads; a
    /// [`super::Recorder`] by one.
    ///
    /// # Errors
    /// [`Error::NoDevice`] with what is missing, [`Error::SelfTest`], [`Error::Memory`], [`Error::Vulkan`] if a call
    /// fails, [`Error::Invalid`] for a target that does not fit the device.
    ///
    /// # Safety
    /// The handles are valid and belong together. Everything that `host.enabled` names is enabled. `host.family`
    /// supports compute, and `host.queue` passes on a queue of it. The device outlives every clone of the `Gpu` and
    /// everything made from it. When the last of these is dropped, nothing recorded through it is being executed.
    pub unsafe fn from_raw(host: HostDevice, options: &GpuOptions) -> Result<Self> {
        let HostDevice { instance, physical, device, family, queue, allocator, pipeline_cache, enabled } = host;
        // SAFETY: the caller promises that the handles are valid and belong together.
        let mut requirements = unsafe { Requirements::check(&instance, physical) };
        requirements.buffer_addresses &= enabled.buffer_addresses;
        requirements.shader_int64 &= enabled.shader_int64;
        requirements.subgroup_size_control &= enabled.subgroup_size_control;
        requirements.ray_tracing.queries &= enabled.ray_tracing.queries && requirements.buffer_addresses;
        requirements.ray_tracing.pipelines &= enabled.ray_tracing.pipelines && requirements.buffer_addresses;
        // SAFETY: as above.
        let mut report = unsafe { DeviceReport::of(&instance, physical, requirements) };
        if !report.requirements.missing.is_empty() {
            return Err(Error::NoDevice(format!("{} lacks {}", report.name, report.requirements.missing.join(", "))));
        }
        // SAFETY: as above.
        let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
        let Some(of_family) = families.get(family as usize).filter(|f| f.queue_flags.contains(vk::QueueFlags::COMPUTE)) else {
            return Err(Error::NoDevice(format!("queue family {family} of {} has no compute", report.name)));
        };
        report.requirements.queue_family = Some((family, of_family.timestamp_valid_bits));
        let (debug_utils, ours) = (enabled.debug_utils, None);
        Self::on(Foundation { instance, physical, device, report, family, queue, allocator, pipeline_cache, debug_utils, ours }, options)
    }
}
