//! A device in use: its queue, allocator and pipelines. `open.rs` opens a device owned by this crate, `host.rs` takes
//! one of the host.

use super::buffer_ref::BufferRef;
use super::constants::Constants;
use super::foundation::Foundation;
use super::heap::Heap;
use super::kept::Kept;
use super::kernel::KernelInfo;
use super::ledger::Ledger;
use super::pipelines::{Pipelines, cache_file};
use super::pool::Pool;
use super::queue::HostQueue;
use super::ray_functions::Acceleration;
use super::requirements::{DeviceReport, INTEL};
use crate::error::{Error, Result};
use crate::gpu::{DeviceClass, Target};
use crate::kernels::MOST_BUFFERS;
use ash::vk;
use std::path::PathBuf;
use std::sync::Arc;

/// How kernels receive their buffers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Binding {
    /// By address in the push constants.
    Address,
    /// By storage-buffer descriptors: for devices without buffer addresses, and for synchronization validation, which
    /// tracks descriptors only.
    Descriptors,
}

/// How to open a device.
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Part of a device's name, or its index in the list of [`super::list_devices`]; `None`: the best device that meets
    /// the requirements.
    pub device: Option<String>,
    /// How kernels receive their buffers; `None`: by address where the device supports it.
    pub binding: Option<Binding>,
    /// Tuning parameters of the kernels; `None`: those of the kind of device, see [`DeviceClass`].
    pub target: Option<Target>,
    /// Folder in which compiled pipelines are kept, in one file per device and driver; `None`: they are not kept.
    pub pipeline_cache: Option<PathBuf>,
    /// Skip the start-up self-test.
    pub trust: bool,
}

/// An opened device. Cheap to clone; everything made from it keeps it alive.
#[derive(Clone)]
pub struct Gpu {
    // Declared before `inner`, so that the kept memory is freed before the device is destroyed.
    memory: Keep,
    inner: Arc<Inner>,
    target: Arc<Target>,
}

/// How the memory of a handle's buffers is kept.
#[derive(Clone)]
enum Keep {
    /// Taken and returned without a limit.
    Freely,
    /// Kept for other buffers, see [`Gpu::with_pool`].
    Pooled(Arc<Pool>),
    /// Counted against a limit, see [`Gpu::with_memory`].
    Limited(Arc<Ledger>),
}

struct Inner {
    // Memory and allocator are declared before `foundation`, so that they are freed before the device is destroyed.
    kept: Kept,
    constants: Constants,
    heap: Arc<Heap>,
    foundation: Foundation,
    pipelines: Pipelines,
    binding: Binding,
    limits: vk::PhysicalDeviceLimits,
    debug_device: Option<ash::ext::debug_utils::Device>,
    acceleration: Option<Acceleration>,
}

impl Gpu {
    /// Makes an allocator and a pipeline cache if the host provides none, and runs the self-test if there is a queue
    /// for it.
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
        let vk::PhysicalDeviceProperties { limits, pipeline_cache_uuid, .. } =
            unsafe { instance.get_physical_device_properties(*physical) };
        let bound = limits.max_per_stage_descriptor_storage_buffers;
        if binding == Binding::Descriptors && MOST_BUFFERS > bound as usize {
            let text =
                format!("{} binds {bound} storage buffers to a shader; kernels need {MOST_BUFFERS}, or buffer addresses", report.name);
            return Err(Error::NoDevice(text));
        }
        if requirements.sizes_vary() && !requirements.subgroup_size_control {
            let [least, usual, most] = requirements.subgroup_sizes;
            let name = &report.name;
            // Intel's drivers run a kernel with a subgroup size of their choice, and still report the usual size to the
            // shader.
            if report.vendor == INTEL {
                let text =
                    format!("{name}: subgroups of {least} to {most}; `subgroupSizeControl` and `computeFullSubgroups` must be enabled");
                return Err(Error::NoDevice(text));
            }
            log::warn!(
                "{name}: subgroups of {least} to {most}, no size control enabled; the driver is trusted to run kernels with {usual}"
            );
        }
        let target = options.target.clone().unwrap_or_else(|| DeviceClass::of(report).target(&report.room));
        target.check(&report.room)?;
        let debug_device = foundation.debug_utils.then(|| ash::ext::debug_utils::Device::new(instance, device));
        let heap = Heap::new(&foundation)?;
        let constants = Constants::new(&heap, debug_device.as_ref())?;
        let file = options.pipeline_cache.as_ref().map(|folder| cache_file(folder, pipeline_cache_uuid));
        let pipelines = Pipelines::new(&foundation, file)?;
        let traced = requirements.ray_tracing;
        let acceleration = traced.any().then(|| Acceleration::new(instance, *physical, device, traced.pipelines));
        let kept = Kept::default();
        let inner = Inner { kept, constants, heap, foundation, pipelines, binding, limits, debug_device, acceleration };
        let gpu = Self { inner: Arc::new(inner), target: Arc::new(target), memory: Keep::Freely };
        if !options.trust && gpu.inner.foundation.queue.is_some() {
            crate::primitives::self_test(&gpu)?;
        }
        Ok(gpu)
    }

    /// Properties of the device.
    pub fn report(&self) -> &DeviceReport {
        &self.inner.foundation.report
    }

    /// How kernels receive their buffers.
    pub fn binding(&self) -> Binding {
        self.inner.binding
    }

    /// The usage flags that every buffer must have that a host passes to kernels, with the one for
    /// device addresses where buffers are passed by address.
    pub fn usage(&self) -> vk::BufferUsageFlags {
        let addresses =
            if self.binding() == Binding::Address { vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS } else { vk::BufferUsageFlags::empty() };
        super::USAGE | addresses
    }

    /// Tuning parameters of the kernels.
    pub fn target(&self) -> &Target {
        &self.target
    }

    /// The same device with other tuning parameters of the kernels. Objects made from either handle can be used with
    /// both, but scratch memory must be carved and used with the same parameters.
    ///
    /// # Errors
    /// [`Error::Invalid`] if they do not fit the device.
    pub fn with_target(&self, target: Target) -> Result<Self> {
        target.check(&self.report().room)?;
        Ok(Self { target: Arc::new(target), ..self.clone() })
    }

    /// Whether both are handles of the same opened device.
    pub fn is_same_device(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.inner, &other.inner)
    }

    /// The same device with a memory limit: all buffers made from this handle and its clones, transfer buffers
    /// included (but for 64 KiB of host memory that small results are read back through), may take at most `bytes`
    /// together; a buffer beyond that is refused with [`Error::Memory`]. The allocator takes memory from the driver in
    /// blocks of 16 MiB, or of the buffer's size if that is larger. Memory of dropped buffers is not kept: the limit
    /// replaces a pool ([`Gpu::with_pool`]).
    #[must_use]
    pub fn with_memory(&self, bytes: u64) -> Self {
        Self { memory: Keep::Limited(Arc::new(Ledger::new(bytes))), ..self.clone() }
    }

    /// The same device with a memory pool: when large buffers made from this handle and its clones are dropped, up to
    /// `bytes` of their memory is kept for buffers of nearly the same size. It is freed when this handle, its clones
    /// and everything made from them are gone, or when the device is full. Use it for repeated work: drivers clear
    /// fresh memory, which may take as long as the work on it. A memory limit of this handle ([`Gpu::with_memory`])
    /// does not hold for the new one.
    #[must_use]
    pub fn with_pool(&self, bytes: u64) -> Self {
        let pool = Pool::new(bytes);
        Self { memory: Keep::Pooled(Arc::new(pool)), ..self.clone() }
    }

    /// The limit set with [`Gpu::with_memory`]; `u64::MAX` without one.
    pub fn memory_limit(&self) -> u64 {
        self.ledger().map_or(u64::MAX, Ledger::limit)
    }

    /// Bytes that buffers made from this handle may still take; `u64::MAX` without a limit.
    pub fn memory_left(&self) -> u64 {
        self.ledger().map_or(u64::MAX, Ledger::left)
    }

    /// The most bytes that buffers made from this handle took simultaneously; 0 without a limit.
    pub fn memory_peak(&self) -> u64 {
        self.ledger().map_or(0, Ledger::peak)
    }

    pub(super) fn ledger(&self) -> Option<&Ledger> {
        if let Keep::Limited(ledger) = &self.memory { Some(ledger) } else { None }
    }

    pub(super) fn pool(&self) -> Option<&Pool> {
        if let Keep::Pooled(pool) = &self.memory { Some(pool) } else { None }
    }

    /// Runs the self-test with these tuning parameters, as opening a device does.
    ///
    /// # Errors
    /// [`Error::SelfTest`], or [`Error::Invalid`] if the host lent no queue.
    pub fn self_test(&self) -> Result<()> {
        crate::primitives::self_test(self)
    }

    /// The device's Vulkan limits.
    pub fn limits(&self) -> &vk::PhysicalDeviceLimits {
        &self.inner.limits
    }

    pub(super) fn kept(&self) -> &Kept {
        &self.inner.kept
    }

    pub(super) fn heap(&self) -> &Arc<Heap> {
        &self.inner.heap
    }

    /// A report of the memory that the device's allocator holds, be it the host's or this crate's.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a panic has left its lock poisoned.
    pub fn allocated(&self) -> Result<gpu_allocator::AllocatorReport> {
        Ok(self.heap().allocator.lock().map_err(|_| Error::Invalid("the allocator's lock is poisoned".into()))?.generate_report())
    }

    /// The logical device.
    pub fn device(&self) -> &ash::Device {
        &self.inner.foundation.device
    }

    /// Subgroup size that pipelines are compiled for, except those of queries.
    pub fn subgroup_size(&self) -> u32 {
        self.inner.foundation.report.subgroup
    }

    /// Subgroup size that the pipeline of a kernel is compiled for.
    pub(super) fn subgroup_size_of(&self, kernel: &KernelInfo) -> u32 {
        if kernel.for_queries { self.report().query_subgroup } else { self.subgroup_size() }
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

    /// Whether kernels read records of four words as two 64-bit words. This helps on processors, which load every
    /// component separately.
    pub(super) fn reads_wide(&self) -> bool {
        self.report().requirements.shader_int64 && DeviceClass::of(self.report()) == DeviceClass::Cpu
    }

    pub(crate) fn requires_subgroup_size(&self) -> bool {
        let requirements = &self.report().requirements;
        requirements.subgroup_size_control && requirements.sizes_vary()
    }

    /// Functions for acceleration structures and rays, if the device supports ray tracing.
    pub(super) fn acceleration(&self) -> Option<&Acceleration> {
        self.inner.acceleration.as_ref()
    }

    /// The pipelines made so far.
    pub(super) fn pipelines(&self) -> &Pipelines {
        &self.inner.pipelines
    }

    pub(crate) fn pipeline_cache(&self) -> vk::PipelineCache {
        self.inner.pipelines.cache
    }

    pub(crate) fn debug_device(&self) -> Option<&ash::ext::debug_utils::Device> {
        self.inner.debug_device.as_ref()
    }

    pub(crate) fn family(&self) -> u32 {
        self.inner.foundation.family
    }

    pub(super) fn host_queue(&self) -> Option<&dyn HostQueue> {
        self.inner.foundation.queue.as_deref()
    }

    pub(crate) fn timestamp_bits(&self) -> u32 {
        self.inner.foundation.report.requirements.queue_family.map_or(0, |(_, bits)| bits)
    }

    /// A buffer whose first word is `u32::MAX`.
    pub(crate) fn unbounded(&self) -> BufferRef {
        self.inner.constants.unbounded()
    }

    /// A buffer to bind in place of an optional array that is absent.
    pub(crate) fn nothing(&self) -> BufferRef {
        self.inner.constants.nothing()
    }
}

impl Gpu {
    /// Writes the pipelines compiled so far to the file of [`GpuOptions::pipeline_cache`], so that later runs need not compile
    /// them. The last handle does so when it is dropped; call this where that never happens, as in a program that ends by
    /// `std::process::exit`. Without such a file, and if the host provides the cache, there is nothing to do.
    ///
    /// # Errors
    /// [`crate::Error::Io`], or a failed Vulkan call.
    pub fn save_pipelines(&self) -> Result<()> {
        if self.inner.foundation.pipeline_cache.is_some() {
            return Ok(());
        }
        self.inner.pipelines.save(self.device())
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        let Foundation { device, pipeline_cache, ours, .. } = &self.foundation;
        if pipeline_cache.is_none()
            && let Err(e) = self.pipelines.save(device)
        {
            log::info!("compiled kernels are not kept for the next start: {e}");
        }
        // SAFETY: every user of the device holds an `Arc` of it, and a host has waited for what it recorded (see
        // `from_raw`), so nothing is in use any more. Children are destroyed before parents, and the host's objects are
        // left alone.
        unsafe {
            if ours.is_some() {
                let _ = device.device_wait_idle();
            }
            self.kept.destroy(device);
            self.pipelines.destroy(&self.foundation);
        }
    }
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Gpu({}, {:?})", self.report().name, self.binding())
    }
}
