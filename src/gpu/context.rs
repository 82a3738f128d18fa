//! A device in use: its queue, allocator and pipelines. `open.rs` makes one of our own, `host.rs` takes one of the host's.

use super::acceleration::Acceleration;
use super::debug::DebugUtils;
use super::failed;
use super::kernel::{Kernel, Pipeline, Specialization, create_pipeline};
use super::memory::{Buffer, BufferRef, Ledger};
use super::requirements::{DeviceReport, INTEL};
use crate::error::{Error, Result};
use crate::kernels::{ALL, Row, Target};
use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};

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
    /// Part of a device's name, or its index in the list of [`super::list_devices`]; `None`: the best that qualifies.
    pub device: Option<String>,
    /// How kernels get their buffers; `None`: by address where the device can.
    pub binding: Option<Binding>,
    /// Shapes of the kernels; `None`: by the kind of device, see [`Row`].
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
pub struct Gpu {
    inner: Arc<Inner>,
    target: Arc<Target>,
    ledger: Option<Arc<Ledger>>,
}

/// What a [`Gpu`] stands on. Dropping it destroys device and instance, unless they are the host's.
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

struct Inner {
    foundation: Foundation,
    // Held in an option so that it is gone before the device.
    allocator: Option<Arc<Mutex<Allocator>>>,
    pipelines: RwLock<HashMap<PipelineKey, Pipeline>>,
    cache: vk::PipelineCache,
    cache_file: Option<PathBuf>,
    binding: Binding,
    limits: vk::PhysicalDeviceLimits,
    debug_device: Option<ash::ext::debug_utils::Device>,
    acceleration: Option<Acceleration>,
    constants: Constants,
}

/// A small buffer that is made before everything else and outlives every recording, in memory of its own: a word of ones, the device count of whoever
/// knows the count on the host, and room to name where a kernel's optional array is not there.
#[derive(Default)]
struct Constants {
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    address: u64,
}

/// Its bytes.
const CONSTANTS: u64 = 512;

/// An allocator of our own.
fn make_allocator(foundation: &Foundation) -> Result<Arc<Mutex<Allocator>>> {
    let made = Allocator::new(&AllocatorCreateDesc {
        instance: foundation.instance.clone(),
        device: foundation.device.clone(),
        physical_device: foundation.physical,
        debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
        buffer_device_address: foundation.report.requirements.buffer_addresses,
        // Small blocks, since every block counts in full against the device's memory.
        allocation_sizes: gpu_allocator::AllocationSizes::new(16 << 20, 4 << 20),
    });
    let made = made.map_err(|e| Error::Memory { name: "olbvh.allocator".into(), bytes: 0, reason: e.to_string() })?;
    Ok(Arc::new(Mutex::new(made)))
}

impl Gpu {
    /// Makes what is missing of allocator and pipeline cache, and tests that the device can be trusted, if there is a queue to do it on.
    pub(super) fn on(foundation: Foundation, options: &GpuOptions) -> Result<Self> {
        let Foundation { instance, physical, device, report, .. } = &foundation;
        let requirements = &report.requirements;
        let binding = match options.binding {
            Some(Binding::Address) if !requirements.buffer_addresses => {
                return Err(Error::NoDevice(format!("{} has no buffer addresses", report.name)));
            }
            Some(binding) => binding,
            None if requirements.buffer_addresses => Binding::Address,
            None => Binding::Descriptors,
        };
        // SAFETY: the handle is one of this instance.
        let limits = unsafe { instance.get_physical_device_properties(*physical) }.limits;
        let (buffers, bound) = (ALL.iter().map(|k| k.buffers.len()).max().unwrap_or(0), limits.max_per_stage_descriptor_storage_buffers);
        if binding == Binding::Descriptors && buffers > bound as usize {
            let text = format!("{} binds {bound} storage buffers to a shader; kernels need {buffers}, or buffer addresses", report.name);
            return Err(Error::NoDevice(text));
        }
        if requirements.sizes_vary() && !requirements.subgroup_size_control {
            let [least, usual, most] = requirements.subgroup_sizes;
            let name = &report.name;
            // These run a kernel in as many lanes as suits it, and say all the same that there are as many as usual.
            if report.vendor == INTEL {
                let text =
                    format!("{name}: subgroups of {least} to {most}; `subgroupSizeControl` and `computeFullSubgroups` must be enabled");
                return Err(Error::NoDevice(text));
            }
            log::warn!(
                "{name}: subgroups of {least} to {most}, no size control enabled; the driver is trusted to run kernels with {usual}"
            );
        }
        let target = options.target.clone().unwrap_or_else(|| Row::of(report).target(&report.room));
        target.check(&report.room)?;
        let allocator = foundation.allocator.clone().map_or_else(|| make_allocator(&foundation), Ok)?;
        let cache = if let Some(cache) = foundation.pipeline_cache {
            cache
        } else {
            let stored = options.pipeline_cache.as_ref().and_then(|f| std::fs::read(f).ok()).unwrap_or_default();
            let info = vk::PipelineCacheCreateInfo::default().initial_data(&stored);
            // SAFETY: drivers check the header of the data and ignore what is not theirs.
            unsafe { device.create_pipeline_cache(&info, None) }.map_err(failed("vkCreatePipelineCache"))?
        };
        let traced = requirements.ray_tracing;
        let mut inner = Inner {
            allocator: Some(allocator),
            pipelines: RwLock::default(),
            cache,
            cache_file: options.pipeline_cache.clone(),
            binding,
            limits,
            debug_device: foundation.debug_utils.then(|| ash::ext::debug_utils::Device::new(instance, device)),
            acceleration: traced.any().then(|| Acceleration::new(instance, *physical, device, traced.pipelines)),
            constants: Constants::default(),
            foundation,
        };
        inner.make_constants()?;
        let gpu = Self { inner: Arc::new(inner), target: Arc::new(target), ledger: None };
        if !options.trust && gpu.inner.foundation.queue.is_some() {
            crate::primitives::self_test(&gpu)?;
        }
        Ok(gpu)
    }

    /// The pipeline of a kernel with these constants, compiled at first use.
    pub(crate) fn pipeline<K: Kernel>(&self, spec: K::Spec) -> Result<Pipeline> {
        let key = (K::INFO.name, spec.values());
        if let Some(found) = self.inner.pipelines.read().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return Ok(*found);
        }
        let made = create_pipeline(self, K::INFO, &key.1)?;
        match self.inner.pipelines.write().unwrap_or_else(PoisonError::into_inner).entry(key) {
            Entry::Vacant(place) => Ok(*place.insert(made)),
            Entry::Occupied(first) => {
                // SAFETY: another thread was first, and nobody has got this one.
                unsafe { made.destroy(self.device()) };
                Ok(*first.get())
            }
        }
    }

    /// What the device is.
    pub fn report(&self) -> &DeviceReport {
        &self.inner.foundation.report
    }

    /// How kernels get their buffers.
    pub fn binding(&self) -> Binding {
        self.inner.binding
    }

    /// Usage of every buffer that a host hands to kernels: [`super::USAGE`], and the flag for addresses where buffers go by them.
    pub fn usage(&self) -> vk::BufferUsageFlags {
        let addresses =
            if self.binding() == Binding::Address { vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS } else { vk::BufferUsageFlags::empty() };
        super::USAGE | addresses
    }

    /// Shapes of the kernels.
    pub fn target(&self) -> &Target {
        &self.target
    }

    /// The same device with other shapes of the kernels. What is made from either can be used with both, but scratch memory is carved and used
    /// with the same shapes.
    ///
    /// # Errors
    /// [`Error::Invalid`] if they do not fit the device.
    pub fn with_target(&self, target: Target) -> Result<Self> {
        target.check(&self.report().room)?;
        Ok(Self { inner: self.inner.clone(), target: Arc::new(target), ledger: self.ledger.clone() })
    }

    /// Whether both are handles of one opened device.
    pub fn is_same_device(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.inner, &other.inner)
    }

    /// The same device, where all buffers made from this handle and its clones take at most `bytes` together, transfers included: the next one is refused
    /// with [`Error::Memory`]. The allocator takes memory from the driver in blocks of 16 MiB, or as large as a larger buffer.
    #[must_use]
    pub fn with_memory(&self, bytes: u64) -> Self {
        Self { ledger: Some(Arc::new(Ledger::new(bytes))), ..self.clone() }
    }

    /// What [`Gpu::with_memory`] was told; all there are without a limit.
    pub fn memory_limit(&self) -> u64 {
        self.ledger().map_or(u64::MAX, Ledger::limit)
    }

    /// Bytes that buffers made from this handle may still take; all there are without a limit.
    pub fn memory_left(&self) -> u64 {
        self.ledger().map_or(u64::MAX, Ledger::left)
    }

    /// The most bytes that buffers made from this handle took at once; 0 without a limit.
    pub fn memory_peak(&self) -> u64 {
        self.ledger().map_or(0, Ledger::peak)
    }

    pub(super) fn ledger(&self) -> Option<&Ledger> {
        self.ledger.as_deref()
    }

    /// Tests that the device can be trusted with these shapes of the kernels, as opening it does.
    ///
    /// # Errors
    /// [`Error::SelfTest`].
    pub fn self_test(&self) -> Result<()> {
        crate::primitives::self_test(self)
    }

    /// Limits of the device.
    pub fn limits(&self) -> &vk::PhysicalDeviceLimits {
        &self.inner.limits
    }

    /// The device's memory allocator.
    pub fn allocator(&self) -> &Arc<Mutex<Allocator>> {
        self.inner.allocator.as_ref().unwrap_or_else(|| unreachable!("the allocator is taken in drop only"))
    }

    /// The logical device.
    pub fn device(&self) -> &ash::Device {
        &self.inner.foundation.device
    }

    /// Subgroup size that pipelines are compiled for.
    pub fn subgroup_size(&self) -> u32 {
        self.inner.foundation.report.subgroup
    }

    /// Messages of validation layers so far; always empty without a layer.
    pub fn validation_messages(&self) -> Vec<String> {
        self.inner
            .foundation
            .ours
            .as_ref()
            .and_then(|o| o.debug.as_ref())
            .and_then(|d| d.messages.lock().ok().map(|m| m.clone()))
            .unwrap_or_default()
    }

    /// Whether kernels read records of four words as two of 64 bits: processors, which fetch every component by itself.
    pub(super) fn reads_wide(&self) -> bool {
        self.report().requirements.shader_int64 && Row::of(self.report()) == Row::Cpu
    }

    pub(crate) fn requires_subgroup_size(&self) -> bool {
        let requirements = &self.report().requirements;
        requirements.subgroup_size_control && requirements.sizes_vary()
    }

    pub(crate) fn has_addresses(&self) -> bool {
        self.inner.foundation.report.requirements.buffer_addresses
    }

    /// Functions for acceleration structures and rays, where the device traces rays.
    pub(super) fn acceleration(&self) -> Option<&Acceleration> {
        self.inner.acceleration.as_ref()
    }

    pub(crate) fn pipeline_cache(&self) -> vk::PipelineCache {
        self.inner.cache
    }

    pub(crate) fn debug_device(&self) -> Option<&ash::ext::debug_utils::Device> {
        self.inner.debug_device.as_ref()
    }

    pub(crate) fn family(&self) -> u32 {
        self.inner.foundation.family
    }

    pub(crate) fn timestamp_bits(&self) -> u32 {
        self.inner.foundation.report.requirements.queue_family.map_or(0, |(_, bits)| bits)
    }

    pub(crate) fn queue(&self) -> Result<MutexGuard<'_, vk::Queue>> {
        let Some(queue) = &self.inner.foundation.queue else {
            return Err(Error::Invalid("the host lent no queue: only the cmd_* functions can be used".into()));
        };
        queue.lock().map_err(|_| Error::Invalid("the queue's lock is poisoned by an earlier panic".into()))
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
        let Constants { buffer, address, .. } = self.inner.constants;
        BufferRef { buffer, offset: 0, size: CONSTANTS, address }
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
    /// Makes the constants; what there is of them when something fails goes with the rest.
    fn make_constants(&mut self) -> Result<()> {
        let Foundation { instance, physical, device, report, .. } = &self.foundation;
        let addresses = report.requirements.buffer_addresses;
        let mut usage = super::memory::USAGE;
        let mut flags = vk::MemoryAllocateFlagsInfo::default();
        if addresses {
            usage |= vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
            flags = flags.flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
        }
        let made = &mut self.constants;
        // SAFETY: plain creation, binding and mapping of one small host-visible buffer; freed in `drop`.
        unsafe {
            let info = vk::BufferCreateInfo::default().size(CONSTANTS).usage(usage);
            made.buffer = device.create_buffer(&info, None).map_err(failed("vkCreateBuffer"))?;
            let needs = device.get_buffer_memory_requirements(made.buffer);
            let memory = instance.get_physical_device_memory_properties(*physical);
            let wanted = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let find = |wanted| {
                (0..memory.memory_type_count)
                    .find(|&i| needs.memory_type_bits >> i & 1 == 1 && memory.memory_types[i as usize].property_flags.contains(wanted))
            };
            // Every invocation reads the word: beside the device, if there is room, and not across a bus.
            let mut allocated = Err(Error::NoDevice("no host-visible memory for buffers".into()));
            for kind in [wanted | vk::MemoryPropertyFlags::DEVICE_LOCAL, wanted].into_iter().filter_map(find) {
                let info = vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(kind).push_next(&mut flags);
                allocated = device.allocate_memory(&info, None).map_err(failed("vkAllocateMemory"));
                if allocated.is_ok() {
                    break;
                }
            }
            made.memory = allocated?;
            device.bind_buffer_memory(made.buffer, made.memory, 0).map_err(failed("vkBindBufferMemory"))?;
            let mapped = device.map_memory(made.memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()).map_err(failed("vkMapMemory"))?;
            mapped.cast::<u32>().write(u32::MAX);
            device.unmap_memory(made.memory);
            super::debug::name(self.debug_device.as_ref(), made.buffer, "olbvh.constants");
            if addresses {
                made.address = device.get_buffer_device_address(&vk::BufferDeviceAddressInfo::default().buffer(made.buffer));
            }
        }
        Ok(())
    }

    /// Writes the pipeline cache beside its file and renames it, so that readers never see half of it.
    fn save_cache(&self) -> Option<()> {
        let file = self.cache_file.as_ref()?;
        // SAFETY: the cache belongs to this device, which is alive.
        let data = unsafe { self.foundation.device.get_pipeline_cache_data(self.cache) }.ok()?;
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
        let Foundation { device, pipeline_cache, ours, .. } = &self.foundation;
        if pipeline_cache.is_none() {
            self.save_cache();
        }
        // SAFETY: whoever uses the device holds an `Arc` of it, and a host has waited for what it recorded (see `from_raw`), so nothing is in
        // use any more; children go before parents, and what is the host's stays.
        unsafe {
            if ours.is_some() {
                let _ = device.device_wait_idle();
            }
            for p in self.pipelines.get_mut().map(std::mem::take).unwrap_or_default().into_values() {
                p.destroy(device);
            }
            if pipeline_cache.is_none() {
                device.destroy_pipeline_cache(self.cache, None);
            }
            device.destroy_buffer(self.constants.buffer, None);
            device.free_memory(self.constants.memory, None);
        }
        drop(self.allocator.take());
    }
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Gpu({}, {:?})", self.report().name, self.binding())
    }
}
