//! A device that counts its live objects, and whose functions fail on request.

use ash::vk;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::ffi::c_void;
use std::sync::{Mutex, OnceLock};

/// The device's own functions.
static TABLE: OnceLock<ash::DeviceFnV1_0> = OnceLock::new();
/// The number of objects made and not destroyed, by device.
static LIVE: Mutex<BTreeMap<vk::Device, i64>> = Mutex::new(BTreeMap::new());
thread_local! {
    /// The function that fails on this thread, and how many calls of it succeed before.
    pub static FAILING: Cell<(&'static str, u32)> = const { Cell::new(("", 0)) };
}

/// The number of live objects of a watched device.
pub fn live(device: &ash::Device) -> i64 {
    LIVE.lock().unwrap().get(&device.handle()).copied().unwrap_or(0)
}

fn count(device: vk::Device, by: i64) {
    *LIVE.lock().unwrap().entry(device).or_insert(0) += by;
}

fn fails(name: &str) -> bool {
    let (failing, left) = FAILING.get();
    if failing == name && left > 0 {
        FAILING.set((failing, left - 1));
    }
    failing == name && left == 0
}

macro_rules! watched {
    ($($name:ident($($arg:ident: $kind:ty),*), $made:literal;)* & $($end:ident($handle:ty);)*) => {
        $(unsafe extern "system" fn $name(device: vk::Device $(, $arg: $kind)*) -> vk::Result {
            if fails(stringify!($name)) {
                return vk::Result::ERROR_OUT_OF_HOST_MEMORY;
            }
            // SAFETY: the arguments are passed on unchanged.
            let result = unsafe { (TABLE.get().unwrap().$name)(device $(, $arg)*) };
            count(device, if result == vk::Result::SUCCESS { $made } else { 0 });
            result
        })*
        $(unsafe extern "system" fn $end(device: vk::Device, handle: $handle, callbacks: Callbacks<'_>) {
            count(device, -i64::from(handle != <$handle>::null()));
            // SAFETY: as above.
            unsafe { (TABLE.get().unwrap().$end)(device, handle, callbacks) }
        })*

        /// The device with those functions watched.
        pub fn watching(device: &ash::Device) -> ash::Device {
            let mut table = TABLE.get_or_init(|| device.fp_v1_0().clone()).clone();
            $(table.$name = $name;)*
            $(table.$end = $end;)*
            let (one, two, three) = (device.fp_v1_1().clone(), device.fp_v1_2().clone(), device.fp_v1_3().clone());
            ash::Device::from_parts_1_3(device.handle(), table, one, two, three)
        }

        /// The functions that can be made to fail.
        pub const FALLIBLE: &[&str] = &[$(stringify!($name)),*];
    };
}

type Callbacks<'a> = *const vk::AllocationCallbacks<'a>;

watched! {
    allocate_memory(info: *const vk::MemoryAllocateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::DeviceMemory), 1;
    bind_buffer_memory(buffer: vk::Buffer, memory: vk::DeviceMemory, offset: u64), 0;
    map_memory(memory: vk::DeviceMemory, offset: u64, size: u64, flags: vk::MemoryMapFlags, out: *mut *mut c_void), 0;
    create_buffer(info: *const vk::BufferCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::Buffer), 1;
    create_pipeline_cache(info: *const vk::PipelineCacheCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::PipelineCache), 1;
    create_shader_module(info: *const vk::ShaderModuleCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::ShaderModule), 1;
    create_compute_pipelines(cache: vk::PipelineCache, n: u32, info: *const vk::ComputePipelineCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::Pipeline), 1;
    create_pipeline_layout(info: *const vk::PipelineLayoutCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::PipelineLayout), 1;
    create_descriptor_set_layout(info: *const vk::DescriptorSetLayoutCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::DescriptorSetLayout), 1;
    create_descriptor_pool(info: *const vk::DescriptorPoolCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::DescriptorPool), 1;
    create_command_pool(info: *const vk::CommandPoolCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::CommandPool), 1;
    create_query_pool(info: *const vk::QueryPoolCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::QueryPool), 1;
    create_fence(info: *const vk::FenceCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::Fence), 1;
    &
    free_memory(vk::DeviceMemory);
    destroy_buffer(vk::Buffer);
    destroy_pipeline_cache(vk::PipelineCache);
    destroy_shader_module(vk::ShaderModule);
    destroy_pipeline(vk::Pipeline);
    destroy_pipeline_layout(vk::PipelineLayout);
    destroy_descriptor_set_layout(vk::DescriptorSetLayout);
    destroy_descriptor_pool(vk::DescriptorPool);
    destroy_command_pool(vk::CommandPool);
    destroy_query_pool(vk::QueryPool);
    destroy_fence(vk::Fence);
}
