//! The device: chosen, checked, opened, with its queue, allocator and pipelines.

use super::acceleration::Acceleration;
use super::debug::DebugUtils;
use super::failed;
use super::kernel::{Kernel, Pipeline, Specialization, create_pipeline};
use super::memory::{Buffer, BufferRef};
use super::requirements::{DeviceReport, Requirements};
use crate::error::{Error, Result};
use crate::kernels::Target;
use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::collections::HashMap;
use std::ffi::CStr;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, RwLock};

/// How kernels get their buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Binding {
    /// By address in the push constants.
    Address,
    /// By storage-buffer descriptors: for devices without buffer addresses, and for synchronization validation, which follows descriptors only.
    Descriptors,
}

/// What to open.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Part of a device's name, or its index in the list of [`list_devices`]; `None`: the best that qualifies.
    pub device: Option<String>,
    /// How kernels get their buffers; `None`: by address where the device can.
    pub binding: Option<Binding>,
    /// Shapes of the kernels; `None`: by the kind of device.
    pub target: Option<Target>,
    /// File of the pipeline cache; `None`: no cache on disk.
    pub pipeline_cache: Option<PathBuf>,
    /// Leave the start-up self-test out.
    pub trust: bool,
}

/// A kernel by name, and its specialization constants.
type PipelineKey = (&'static str, Vec<(u32, u32)>);

/// An opened device. Cheap to clone; everything made from it keeps it alive.
#[derive(Clone)]
pub struct Gpu(Arc<Inner>);

struct Inner {
    // Held in an option so that it is gone before the device.
    allocator: Option<Arc<Mutex<Allocator>>>,
    pipelines: RwLock<HashMap<PipelineKey, Pipeline>>,
    cache: vk::PipelineCache,
    cache_file: Option<PathBuf>,
    binding: Binding,
    requirements: Requirements,
    report: DeviceReport,
    limits: vk::PhysicalDeviceLimits,
    target: Target,
    queue: Mutex<vk::Queue>,
    family: u32,
    debug_device: Option<ash::ext::debug_utils::Device>,
    acceleration: Option<Acceleration>,
    device: ash::Device,
    debug: Option<DebugUtils>,
    instance: ash::Instance,
    physical: vk::PhysicalDevice,
    /// A word of ones: the device count of whoever knows the count on the host.
    unbounded: OnceLock<(vk::Buffer, vk::DeviceMemory, BufferRef)>,
    _entry: ash::Entry,
}

struct Session {
    entry: ash::Entry,
    instance: ash::Instance,
    debug: bool,
}

/// Opens the loader and an instance.
fn open_instance() -> Result<Session> {
    // SAFETY: the loader is trusted as every Vulkan program trusts it.
    let entry = unsafe { ash::Entry::load() }.map_err(|e| Error::NoVulkan(e.to_string()))?;
    // SAFETY: plain enumeration.
    let extensions =
        unsafe { entry.enumerate_instance_extension_properties(None) }.map_err(failed("vkEnumerateInstanceExtensionProperties"))?;
    let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
    let mut wanted = Vec::new();
    let debug = has(ash::ext::debug_utils::NAME);
    if debug {
        wanted.push(ash::ext::debug_utils::NAME.as_ptr());
    }
    let mut flags = vk::InstanceCreateFlags::empty();
    if has(ash::khr::portability_enumeration::NAME) {
        // MoltenVK shows itself only on request.
        wanted.push(ash::khr::portability_enumeration::NAME.as_ptr());
        flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
    }
    let application = vk::ApplicationInfo::default().application_name(c"olbvh").engine_name(c"olbvh").api_version(vk::API_VERSION_1_2);
    let info = vk::InstanceCreateInfo::default().application_info(&application).enabled_extension_names(&wanted).flags(flags);
    // SAFETY: all structs outlive the call.
    let instance = unsafe { entry.create_instance(&info, None) }.map_err(|e| Error::NoVulkan(format!("vkCreateInstance: {e:?}")))?;
    Ok(Session { entry, instance, debug })
}

/// Every Vulkan device of this machine with what it lacks, if anything.
///
/// # Errors
/// [`Error::NoVulkan`] if there is no loader or driver.
pub fn list_devices() -> Result<Vec<DeviceReport>> {
    let session = open_instance()?;
    // SAFETY: the instance is alive, and destroyed once.
    let devices = unsafe { session.instance.enumerate_physical_devices() };
    let reports = devices
        .map(|d| d.into_iter().map(|d| DeviceReport::new(&session.instance, d)).collect())
        .map_err(failed("vkEnumeratePhysicalDevices"));
    // SAFETY: nothing made from the instance is left.
    unsafe { session.instance.destroy_instance(None) };
    reports
}

/// The device asked for, or the best one that qualifies.
fn choose(instance: &ash::Instance, wanted: Option<&str>) -> Result<(vk::PhysicalDevice, DeviceReport)> {
    // SAFETY: the instance is alive.
    let devices = unsafe { instance.enumerate_physical_devices() }.map_err(failed("vkEnumeratePhysicalDevices"))?;
    let all: Vec<_> = devices.into_iter().map(|d| (d, DeviceReport::new(instance, d))).collect();
    let names = || all.iter().enumerate().map(|(i, (_, r))| format!("{i}: {}", r.name)).collect::<Vec<_>>().join(", ");
    if all.is_empty() {
        return Err(Error::NoDevice("the Vulkan loader finds no driver; install one (mesa-vulkan-drivers runs on any processor)".into()));
    }
    if let Some(wanted) = wanted {
        let lower = wanted.to_lowercase();
        let by_index = wanted.parse::<usize>().ok().and_then(|i| all.get(i));
        let found = by_index.or_else(|| all.iter().find(|(_, r)| r.name.to_lowercase().contains(&lower)));
        let Some((device, report)) = found else {
            return Err(Error::NoDevice(format!("none is called `{wanted}`; there are {}", names())));
        };
        if !report.requirements.missing.is_empty() {
            return Err(Error::NoDevice(format!("{} lacks {}", report.name, report.requirements.missing.join(", "))));
        }
        return Ok((*device, report.clone()));
    }
    let rank = |r: &DeviceReport| ["discrete", "integrated", "virtual", "other", "cpu"].iter().position(|k| *k == r.kind);
    let best = all.iter().filter(|(_, r)| r.requirements.missing.is_empty()).min_by_key(|(_, r)| rank(r));
    best.cloned().ok_or_else(|| {
        let lacking = all.iter().map(|(_, r)| format!("{} lacks {}", r.name, r.requirements.missing.join(", ")));
        Error::NoDevice(lacking.collect::<Vec<_>>().join("; "))
    })
}

impl Gpu {
    /// Opens a device and tests that it can be trusted.
    ///
    /// # Errors
    /// [`Error::NoVulkan`], [`Error::NoDevice`] with what is missing, [`Error::SelfTest`].
    pub fn new(options: &GpuOptions) -> Result<Self> {
        let session = open_instance()?;
        let chosen = choose(&session.instance, options.device.as_deref());
        let (physical, report) = match chosen {
            Ok(chosen) => chosen,
            Err(e) => {
                // SAFETY: nothing made from the instance is left.
                unsafe { session.instance.destroy_instance(None) };
                return Err(e);
            }
        };
        let gpu = Self::open(session, physical, report, options)?;
        gpu.make_unbounded()?;
        if !options.trust {
            crate::primitives::self_test(&gpu)?;
        }
        Ok(gpu)
    }

    fn open(session: Session, physical: vk::PhysicalDevice, report: DeviceReport, options: &GpuOptions) -> Result<Self> {
        let requirements = report.requirements.clone();
        let Session { entry, instance, debug } = session;
        let binding = match options.binding {
            Some(Binding::Address) if !requirements.buffer_addresses => {
                return Err(Error::NoDevice(format!("{} has no buffer addresses", report.name)));
            }
            Some(binding) => binding,
            None if requirements.buffer_addresses => Binding::Address,
            None => Binding::Descriptors,
        };
        let (family, _) = requirements.queue_family.unwrap_or_default();
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
        let extensions: Vec<_> = requirements.extensions.iter().map(|e| e.as_ptr()).collect();
        let mut addresses = vk::PhysicalDeviceBufferDeviceAddressFeatures::default().buffer_device_address(true);
        let mut control = vk::PhysicalDeviceSubgroupSizeControlFeatures::default().subgroup_size_control(true).compute_full_subgroups(true);
        let mut info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&extensions);
        if requirements.buffer_addresses {
            info = info.push_next(&mut addresses);
        }
        if requirements.subgroup_size_control {
            info = info.push_next(&mut control);
        }
        let mut structures = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
        let mut ray_queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
        if requirements.ray_query() {
            info = info.push_next(&mut structures).push_next(&mut ray_queries);
        }
        // SAFETY: only features and extensions that the device reported are enabled; all structs outlive the calls.
        let (device, queue, limits) = unsafe {
            let device = instance.create_device(physical, &info, None).map_err(failed("vkCreateDevice"))?;
            let queue = device.get_device_queue(family, 0);
            (device, queue, instance.get_physical_device_properties(physical).limits)
        };
        let debug_utils = if debug { DebugUtils::new(&entry, &instance) } else { None };
        let debug_device = debug.then(|| ash::ext::debug_utils::Device::new(&instance, &device));
        let acceleration = requirements.ray_query().then(|| Acceleration::new(&instance, physical, &device));
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
            buffer_device_address: requirements.buffer_addresses,
            // Small blocks, since every block counts in full against the device's memory.
            allocation_sizes: gpu_allocator::AllocationSizes::new(16 << 20, 4 << 20),
        });
        let allocator = allocator.map_err(|e| Error::Memory { name: "olbvh.allocator".into(), bytes: 0, reason: e.to_string() })?;
        let stored = options.pipeline_cache.as_ref().and_then(|f| std::fs::read(f).ok()).unwrap_or_default();
        let cache_info = vk::PipelineCacheCreateInfo::default().initial_data(&stored);
        // SAFETY: drivers check the header of the data and ignore what is not theirs.
        let cache = unsafe { device.create_pipeline_cache(&cache_info, None) }.map_err(failed("vkCreatePipelineCache"))?;
        let target = options.target.unwrap_or_else(|| Target::select(report.subgroup, report.kind == "cpu"));
        Ok(Self(Arc::new(Inner {
            allocator: Some(Arc::new(Mutex::new(allocator))),
            pipelines: RwLock::default(),
            cache,
            cache_file: options.pipeline_cache.clone(),
            binding,
            requirements,
            report,
            limits,
            target,
            queue: Mutex::new(queue),
            family,
            debug_device,
            acceleration,
            device,
            debug: debug_utils,
            instance,
            physical,
            unbounded: OnceLock::new(),
            _entry: entry,
        })))
    }

    /// The word of ones, in memory of its own: it is made before everything else and outlives every recording.
    fn make_unbounded(&self) -> Result<()> {
        let device = self.device();
        let mut usage = super::memory::USAGE;
        let mut flags = vk::MemoryAllocateFlagsInfo::default();
        if self.has_addresses() {
            usage |= vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
            flags = flags.flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
        }
        // SAFETY: plain creation, binding and mapping of one small host-visible buffer; freed in `drop` of `Inner`.
        unsafe {
            let buffer =
                device.create_buffer(&vk::BufferCreateInfo::default().size(512).usage(usage), None).map_err(failed("vkCreateBuffer"))?;
            let needs = device.get_buffer_memory_requirements(buffer);
            let memory = self.0.instance.get_physical_device_memory_properties(self.0.physical);
            let wanted = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let kind = (0..memory.memory_type_count)
                .find(|&i| needs.memory_type_bits >> i & 1 == 1 && memory.memory_types[i as usize].property_flags.contains(wanted));
            let kind = kind.ok_or_else(|| Error::NoDevice("no host-visible memory for buffers".into()))?;
            let info = vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(kind).push_next(&mut flags);
            let block = device.allocate_memory(&info, None).map_err(failed("vkAllocateMemory"))?;
            device.bind_buffer_memory(buffer, block, 0).map_err(failed("vkBindBufferMemory"))?;
            let mapped = device.map_memory(block, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()).map_err(failed("vkMapMemory"))?;
            mapped.cast::<u32>().write(u32::MAX);
            device.unmap_memory(block);
            super::debug::name(self.debug_device(), buffer, "olbvh.unbounded");
            let address = if self.has_addresses() {
                device.get_buffer_device_address(&vk::BufferDeviceAddressInfo::default().buffer(buffer))
            } else {
                0
            };
            let _ = self.0.unbounded.set((buffer, block, BufferRef { buffer, offset: 0, size: 512, address }));
        }
        Ok(())
    }

    /// The pipeline of a kernel with these constants, compiled at first use.
    pub(crate) fn pipeline<K: Kernel>(&self, spec: K::Spec) -> Result<Pipeline> {
        let key = (K::INFO.name, spec.values());
        if let Some(found) = self.0.pipelines.read().ok().and_then(|p| p.get(&key).copied()) {
            return Ok(found);
        }
        let made = create_pipeline(self, K::INFO, &key.1)?;
        if let Ok(mut pipelines) = self.0.pipelines.write() {
            pipelines.insert(key, made);
        }
        Ok(made)
    }

    /// What the device is.
    pub fn report(&self) -> &DeviceReport {
        &self.0.report
    }

    /// How kernels get their buffers.
    pub fn binding(&self) -> Binding {
        self.0.binding
    }

    /// Shapes of the kernels.
    pub fn target(&self) -> &Target {
        &self.0.target
    }

    /// Limits of the device.
    pub fn limits(&self) -> &vk::PhysicalDeviceLimits {
        &self.0.limits
    }

    /// The device's memory allocator.
    pub fn allocator(&self) -> &Arc<Mutex<Allocator>> {
        self.0.allocator.as_ref().unwrap_or_else(|| unreachable!("the allocator is taken in drop only"))
    }

    /// The logical device.
    pub fn device(&self) -> &ash::Device {
        &self.0.device
    }

    /// Subgroup size that pipelines are compiled for.
    pub fn subgroup_size(&self) -> u32 {
        self.0.report.subgroup
    }

    /// Messages of validation layers so far; always empty without a layer.
    pub fn validation_messages(&self) -> Vec<String> {
        self.0.debug.as_ref().and_then(|d| d.messages.lock().ok().map(|m| m.clone())).unwrap_or_default()
    }

    pub(crate) fn requires_subgroup_size(&self) -> bool {
        let [least, _, most] = self.0.requirements.subgroup_sizes;
        self.0.requirements.subgroup_size_control && least != most
    }

    pub(crate) fn has_addresses(&self) -> bool {
        self.0.requirements.buffer_addresses
    }

    /// Functions for acceleration structures, where the device has ray queries.
    pub(super) fn acceleration(&self) -> Option<&Acceleration> {
        self.0.acceleration.as_ref()
    }

    pub(crate) fn pipeline_cache(&self) -> vk::PipelineCache {
        self.0.cache
    }

    pub(crate) fn debug_device(&self) -> Option<&ash::ext::debug_utils::Device> {
        self.0.debug_device.as_ref()
    }

    pub(crate) fn family(&self) -> u32 {
        self.0.family
    }

    pub(crate) fn timestamp_bits(&self) -> u32 {
        self.0.requirements.queue_family.map_or(0, |(_, bits)| bits)
    }

    pub(crate) fn queue(&self) -> Result<MutexGuard<'_, vk::Queue>> {
        self.0.queue.lock().map_err(|_| Error::Invalid("the queue's lock is poisoned by an earlier panic".into()))
    }

    /// A buffer whose first word is all ones.
    pub(crate) fn unbounded(&self) -> BufferRef {
        self.constant_buffer().part(0, 16)
    }

    /// A buffer to name where a kernel's optional array is not there.
    pub(crate) fn nothing(&self) -> BufferRef {
        self.constant_buffer().part(256, 16)
    }

    fn constant_buffer(&self) -> BufferRef {
        self.0.unbounded.get().map_or(BufferRef { buffer: vk::Buffer::null(), offset: 0, size: 512, address: 0 }, |u| u.2)
    }

    /// A device-local buffer; see [`Buffer::new`].
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn buffer(&self, name: &str, size: u64) -> Result<Buffer> {
        Buffer::new(self, name, size)
    }
}

impl Inner {
    /// Writes the pipeline cache beside its file and renames it, so that readers never see half of it.
    fn save_cache(&self) -> Option<()> {
        let file = self.cache_file.as_ref()?;
        // SAFETY: the cache belongs to this device, which is alive.
        let data = unsafe { self.device.get_pipeline_cache_data(self.cache) }.ok()?;
        if std::fs::read(file).is_ok_and(|stored| stored == data) {
            return None;
        }
        std::fs::create_dir_all(file.parent()?).ok()?;
        let temporary = file.with_extension(format!("{}.tmp", std::process::id()));
        std::fs::write(&temporary, data).ok()?;
        std::fs::rename(&temporary, file).ok()
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        self.save_cache();
        // SAFETY: whoever uses the device holds an `Arc` of it, so nothing is in use any more; children go before parents.
        unsafe {
            let _ = self.device.device_wait_idle();
            for p in self.pipelines.get_mut().map(std::mem::take).unwrap_or_default().into_values() {
                self.device.destroy_pipeline(p.handle, None);
                self.device.destroy_pipeline_layout(p.layout, None);
                self.device.destroy_descriptor_set_layout(p.set_layout, None);
            }
            self.device.destroy_pipeline_cache(self.cache, None);
            if let Some((buffer, memory, _)) = self.unbounded.take() {
                self.device.destroy_buffer(buffer, None);
                self.device.free_memory(memory, None);
            }
            drop(self.allocator.take());
            self.device.destroy_device(None);
            if let Some(debug) = self.debug.take() {
                debug.instance.destroy_debug_utils_messenger(debug.messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Gpu({}, {:?})", self.0.report.name, self.0.binding)
    }
}
