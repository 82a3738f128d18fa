//! What an opened device stands on, one of our own or the host's.

use super::debug::DebugUtils;
use super::requirements::DeviceReport;
use ash::vk;
use gpu_allocator::vulkan::Allocator;
use std::sync::{Arc, Mutex};

/// What a [`super::Gpu`] stands on. Dropping it destroys device and instance, unless they are the host's.
pub(super) struct Foundation {
    pub instance: ash::Instance,
    pub physical: vk::PhysicalDevice,
    pub device: ash::Device,
    /// What of the device is enabled.
    pub report: DeviceReport,
    pub family: u32,
    /// Where the convenient layer submits; a host need not lend one.
    pub queue: Option<Arc<Mutex<vk::Queue>>>,
    /// `None`: one of our own.
    pub allocator: Option<Arc<Mutex<Allocator>>>,
    /// `None`: one of our own.
    pub pipeline_cache: Option<vk::PipelineCache>,
    /// The instance has debug-utils enabled.
    pub debug_utils: bool,
    /// `None`: the device is the host's.
    pub ours: Option<Ours>,
}

/// What only a device of our own has.
pub(super) struct Ours {
    pub debug: Option<DebugUtils>,
    pub _entry: ash::Entry,
}

impl Drop for Foundation {
    fn drop(&mut self) {
        let Some(ours) = &self.ours else { return };
        // SAFETY: what was made from the device is gone; children go before parents.
        unsafe {
            self.device.destroy_device(None);
            if let Some(debug) = &ours.debug {
                debug.instance.destroy_debug_utils_messenger(debug.messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}
