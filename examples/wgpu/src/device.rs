//! wgpu's device, opened with what olbvh would like to have enabled, and lent to olbvh.
//!
//! One thing is missing: wgpu enables `subgroupSizeControl` without `computeFullSubgroups`, and chains its structs only
//! after the callback. So olbvh requires no subgroup size here. Where sizes vary, it trusts the driver with a warning;
//! a device of Intel's, which cannot be trusted in this, is refused.

use anyhow::{Context, Result, ensure};
use ash::vk;
use olbvh::gpu::{EnabledFeatures, Gpu, GpuOptions, HostDevice, Requirements};
use std::sync::{Arc, Mutex};
use wgpu::hal::api::Vulkan;
use wgpu::hal::vulkan::CreateDeviceCallback;

pub struct Device {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    addresses: bool,
}

impl Device {
    /// Opens the device; with `addresses`, it has buffer addresses, which wgpu itself does not use.
    pub fn open(addresses: bool) -> Result<Self> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN;
        let instance = wgpu::Instance::new(descriptor);
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
        let int64 = adapter.features() & wgpu::Features::SHADER_INT64;
        let descriptor = wgpu::DeviceDescriptor { label: Some("wgpu_frame"), required_features: int64, ..Default::default() };
        let (features, limits, hints) = (descriptor.required_features, &descriptor.required_limits, &descriptor.memory_hints);
        // SAFETY: the callback adds a feature that the device has; the device comes from this adapter.
        unsafe {
            let (opened, addresses) = {
                let raw = adapter.as_hal::<Vulkan>().context("wgpu has no Vulkan here")?;
                let needs = Requirements::check(raw.shared_instance().raw_instance(), raw.raw_physical_device());
                ensure!(needs.missing.is_empty(), "the device lacks {}", needs.missing.join(", "));
                let addresses = addresses && needs.buffer_addresses;
                let mut feature = vk::PhysicalDeviceBufferDeviceAddressFeatures::default().buffer_device_address(addresses);
                let feature = &mut feature;
                let add: Box<CreateDeviceCallback<'_>> = Box::new(move |args| *args.create_info = args.create_info.push_next(feature));
                (raw.open_with_callback(features, limits, hints, Some(add))?, addresses)
            };
            let (device, queue) = adapter.create_device_from_hal(opened, &descriptor)?;
            Ok(Self { device, queue, addresses })
        }
    }

    /// A handle of olbvh for this device.
    ///
    /// # Safety
    /// The device must outlive the handle and everything made from it. While a function of olbvh submits (recording
    /// functions do not), no other thread may submit.
    pub unsafe fn gpu(&self) -> Result<Gpu> {
        // SAFETY: the handles are alive and belong together; the caller ensures the rest.
        unsafe {
            let device = self.device.as_hal::<Vulkan>().context("not a device of Vulkan's")?;
            let instance = device.shared_instance();
            let lent = HostDevice {
                instance: instance.raw_instance().clone(),
                physical: device.raw_physical_device(),
                device: device.raw_device().clone(),
                family: device.queue_family_index(),
                queue: Some(Arc::new(Mutex::new(device.raw_queue()))),
                allocator: None,
                pipeline_cache: None,
                // No `subgroup_size_control`: wgpu enables that without `computeFullSubgroups`.
                enabled: EnabledFeatures {
                    buffer_addresses: self.addresses,
                    shader_int64: self.device.features().contains(wgpu::Features::SHADER_INT64),
                    debug_utils: instance.extensions().contains(&ash::ext::debug_utils::NAME),
                    ..EnabledFeatures::default()
                },
            };
            Ok(Gpu::from_raw(lent, &GpuOptions::default())?)
        }
    }
}

/// The messages of validation layers, which wgpu passes on to the log.
pub struct Messages(Mutex<Vec<String>>);

static MESSAGES: Messages = Messages(Mutex::new(Vec::new()));

impl log::Log for Messages {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.level() <= log::Level::Warn
    }

    fn log(&self, record: &log::Record<'_>) {
        let text = record.args().to_string();
        if text.starts_with("VALIDATION") {
            self.0.lock().unwrap().push(text);
        } else if self.enabled(record.metadata()) && record.target() != "wgpu_hal::vulkan::instance" {
            eprintln!("{}: {text}", record.target());
        }
    }

    fn flush(&self) {}
}

impl Messages {
    pub fn collect() -> Result<()> {
        log::set_max_level(log::LevelFilter::Warn);
        log::set_logger(&MESSAGES).map_err(|e| anyhow::anyhow!("{e}"))
    }

    /// Fails if there were any messages.
    pub fn none() -> Result<()> {
        let messages = MESSAGES.0.lock().unwrap();
        ensure!(messages.is_empty(), "validation: {}", messages.join("\n"));
        Ok(())
    }
}
