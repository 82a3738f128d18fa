//! The Vulkan objects of an opened device, owned by this crate or by the host.

use super::debug::DebugUtils;
use super::queue::HostQueue;
use super::requirements::DeviceReport;
use ash::vk;
use gpu_allocator::vulkan::Allocator;
use std::sync::{Arc, Mutex};

/// The Vulkan objects of a [`super::Gpu`]. Dropping it destroys device and instance, unless they are the host's.
pub(super) struct Foundation {
    pub instance: ash::Instance,
    pub physical: vk::PhysicalDevice,
    pub device: ash::Device,
    /// The device's properties, and the features that are enabled.
    pub report: DeviceReport,
    pub family: u32,
    /// The queue that owning calls submit to; a host need not provide one.
    pub queue: Option<Arc<dyn HostQueue>>,
    /// The host's allocator. `None`: this crate makes its own.
    pub allocator: Option<Arc<Mutex<Allocator>>>,
    /// The host's pipeline cache. `None`: this crate makes its own.
    pub pipeline_cache: Option<vk::PipelineCache>,
    /// Whether the instance has `VK_EXT_debug_utils` enabled.
    pub debug_utils: bool,
    /// `None`: the device is the host's.
    pub ours: Option<Ours>,
}

/// What exists only for a device owned by this crate.
pub(super) struct Ours {
    pub debug: Option<DebugUtils>,
    pub _entry: ash::Entry,
}

impl Drop for Foundation {
    fn drop(&mut self) {
        let Some(ours) = &self.ours else { return };
        // SAFETY: everything made from the device has been destroyed; children are destroyed before parents.
        unsafe {
            self.device.destroy_device(None);
            if let Some(debug) = &ours.debug {
                debug.instance.destroy_debug_utils_messenger(debug.messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}
