//! The C interface to a Vulkan device that the host owns.

use super::{OlbvhGpu, OlbvhStatus, border, give, handle, missing, place};
use crate::error::Error;
use crate::gpu::{EnabledFeatures, Gpu, GpuOptions, HostDevice, HostQueue, Requirements};
use ash::vk::{self, Handle};
use std::ffi::{c_char, c_void};
use std::ptr::null;
use std::sync::{Arc, Mutex};

/// What a host should enable when it creates a device for olbvh.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhHostRequirements {
    /// The queue family that this library would take for itself, preferably one without graphics. Any family with compute
    /// works; a renderer takes one with graphics as well.
    pub queue_family: u32,
    /// Not 0: the device has the feature `bufferDeviceAddress`. Without it, buffers are bound by descriptors.
    pub buffer_addresses: u32,
    /// Not 0: the device has the feature `shaderInt64`.
    pub shader_int64: u32,
    /// Not 0: the device has the features `subgroupSizeControl` and `computeFullSubgroups`, and lets compute shaders
    /// require a subgroup size.
    pub subgroup_size_control: u32,
    /// Number of entries in `extensions`.
    pub extension_count: u32,
    /// Names of the device extensions to enable. The strings are static: they stay valid and must not be freed.
    pub extensions: [*const c_char; 4],
}

/// Reports what to enable on a physical device, before a device is created from it. Handles are cast to `uint64_t`,
/// `vkGetInstanceProcAddr` to a function without arguments. Returns `OLBVH_STATUS_DEVICE` if the physical device does
/// not qualify; `olbvh_last_error` then says what it lacks.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_host_check(
    get_instance_proc_addr: Option<unsafe extern "C" fn()>,
    instance: u64,
    physical_device: u64,
    out: *mut OlbvhHostRequirements,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let out = unsafe { place(out)? };
        let Some(get) = get_instance_proc_addr.filter(|_| instance != 0 && physical_device != 0) else {
            return Err(missing("the loader's function or a handle"));
        };
        // SAFETY: the host passes the loader's function, and handles of an instance that has not been destroyed and of a
        // physical device of it.
        let found = unsafe { Requirements::check(&load(get, instance), vk::PhysicalDevice::from_raw(physical_device)) };
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
        for (name, place) in found.extensions.iter().zip(&mut told.extensions) {
            *place = name.as_ptr();
            told.extension_count += 1;
        }
        out.write(told);
        Ok(())
    })
}

/// Loads the functions of an instance.
///
/// # Safety
/// `get` is the loader's `vkGetInstanceProcAddr`, cast; `instance` is a `VkInstance` that has not been destroyed.
unsafe fn load(get: unsafe extern "C" fn(), instance: u64) -> ash::Instance {
    // SAFETY: the caller promises that `get` is `vkGetInstanceProcAddr` and that the instance has not been destroyed.
    unsafe {
        let get = std::mem::transmute::<unsafe extern "C" fn(), vk::PFN_vkGetInstanceProcAddr>(get);
        ash::Instance::load(&ash::StaticFn { get_instance_proc_addr: get }, vk::Instance::from_raw(instance))
    }
}

/// A Vulkan device that the host owns; olbvh uses it and never destroys it. Handles are cast to `uint64_t`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhHostDevice {
    /// `vkGetInstanceProcAddr`, cast to this type.
    pub get_instance_proc_addr: Option<unsafe extern "C" fn()>,
    /// `VkInstance`, created for Vulkan 1.2 or later.
    pub instance: u64,
    /// `VkPhysicalDevice`.
    pub physical_device: u64,
    /// `VkDevice`.
    pub device: u64,
    /// `VkQueue` of the family `queue_family`, which owning calls submit to (`olbvh_gpu_from_host` with its self-test,
    /// uploads, builds, queries); recording functions do not touch it. Nothing else may use the queue while an owning
    /// call runs, or, with `lock_queue`, while it holds that lock. 0: only recording is possible, and the self-test is
    /// skipped.
    pub queue: u64,
    /// Takes the host's lock of the queue, which the host also takes for its own use of it; may be null. It is called
    /// with `queue_lock` before each submission, on the thread of the owning call, whichever that is. Set both
    /// `lock_queue` and `unlock_queue`, or neither.
    pub lock_queue: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Releases the host's lock of the queue; may be null. It is called with `queue_lock` after each submission.
    pub unlock_queue: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Argument of `lock_queue` and `unlock_queue`.
    pub queue_lock: *mut c_void,
    /// The host's `VkPipelineCache`, which may hold the kernels of earlier runs; not one that needs external
    /// synchronization, since threads compile at the same time. 0: a cache that lasts as long as the `olbvh_gpu`.
    pub pipeline_cache: u64,
    /// Index of a queue family with compute; it needs no other capability.
    pub queue_family: u32,
    /// Not 0: the feature `bufferDeviceAddress` is enabled.
    pub buffer_addresses: u32,
    /// Not 0: the feature `shaderInt64` is enabled, from which only drivers for processors profit.
    pub shader_int64: u32,
    /// Not 0: `VK_EXT_subgroup_size_control` (or Vulkan 1.3) is enabled with `subgroupSizeControl` and
    /// `computeFullSubgroups`. Enable it where subgroup sizes vary. Without it, the driver is trusted to run kernels
    /// with its usual subgroup size, which the self-test checks on opening; Intel devices whose subgroup sizes vary are
    /// refused.
    pub subgroup_size_control: u32,
    /// Not 0: the instance extension `VK_EXT_debug_utils` is enabled.
    pub debug_utils: u32,
}

/// The host's queue with its functions that lock and unlock it. There is no second lock: a thread that holds the host's
/// lock, if that is recursive, would wait for the second one while another thread holds that and waits for the host's.
pub(super) struct LentQueue {
    pub queue: vk::Queue,
    pub lock: [unsafe extern "C" fn(*mut c_void); 2],
    pub argument: *mut c_void,
}

// SAFETY: the queue is used only while the host's lock is held; the host vouches that its functions may be called from
// any thread with `argument`, see `OlbvhHostDevice`.
unsafe impl Send for LentQueue {}
// SAFETY: the queue is used only while the host's lock is held, so shared references cause no concurrent use; for the
// host's functions see `OlbvhHostDevice`.
unsafe impl Sync for LentQueue {}

// SAFETY: the host's lock is held.
unsafe impl HostQueue for LentQueue {
    fn locked(&self, submit: &mut dyn FnMut(vk::Queue)) {
        let [lock, unlock] = self.lock;
        let _held = HostLock::take(lock, unlock, self.argument);
        submit(self.queue);
    }
}

/// The host's lock, while it is held.
struct HostLock(unsafe extern "C" fn(*mut c_void), *mut c_void);

impl HostLock {
    fn take(lock: unsafe extern "C" fn(*mut c_void), unlock: unsafe extern "C" fn(*mut c_void), argument: *mut c_void) -> Self {
        // SAFETY: the host's function, with the argument that it gave for it.
        unsafe { lock(argument) };
        Self(unlock, argument)
    }
}

impl Drop for HostLock {
    fn drop(&mut self) {
        // SAFETY: the host's function, with the argument that it gave for it; `take` has locked.
        unsafe { self.0(self.1) };
    }
}

/// Makes a handle for the host's device, which must outlive everything made from the handle, and so must whatever else
/// `host` refers to: its functions, `queue_lock` and the pipeline cache. Buffers are used by queues of that family alone,
/// with exclusive sharing: a host that reads or writes them on another family transfers their ownership.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_gpu_from_host(host: *const OlbvhHostDevice, out: *mut *mut OlbvhGpu) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (host, out) = unsafe { (handle(host, "host")?, place(out)?) };
        let null = [host.instance, host.physical_device, host.device].contains(&0);
        let Some(get) = host.get_instance_proc_addr.filter(|_| !null) else {
            return Err(missing("a handle of the host's device"));
        };
        let queue = vk::Queue::from_raw(host.queue);
        let queue: Option<Arc<dyn HostQueue>> = match (host.lock_queue, host.unlock_queue) {
            (Some(_), None) | (None, Some(_)) => return Err(missing("one of lock_queue and unlock_queue")),
            _ if host.queue == 0 => None,
            (Some(lock), Some(unlock)) => Some(Arc::new(LentQueue { queue, lock: [lock, unlock], argument: host.queue_lock })),
            (None, None) => Some(Arc::new(Mutex::new(queue))),
        };
        // SAFETY: the host passes the loader's function and handles of one device that has not been destroyed.
        let gpu = unsafe {
            let instance = load(get, host.instance);
            let device = ash::Device::load(instance.fp_v1_0(), vk::Device::from_raw(host.device));
            let lent = HostDevice {
                physical: vk::PhysicalDevice::from_raw(host.physical_device),
                device,
                family: host.queue_family,
                queue,
                allocator: None,
                pipeline_cache: (host.pipeline_cache != 0).then(|| vk::PipelineCache::from_raw(host.pipeline_cache)),
                enabled: EnabledFeatures {
                    buffer_addresses: host.buffer_addresses != 0,
                    shader_int64: host.shader_int64 != 0,
                    subgroup_size_control: host.subgroup_size_control != 0,
                    debug_utils: host.debug_utils != 0,
                    ..EnabledFeatures::default()
                },
                instance,
            };
            Gpu::from_raw(lent, &GpuOptions::default())
        };
        let gpu = gpu.map_err(|error| match error {
            Error::NoDevice(why) => Error::NoDevice(format!("the host's device: {why}")),
            other => other,
        });
        give(out, OlbvhGpu(gpu?));
        Ok(())
    })
}
