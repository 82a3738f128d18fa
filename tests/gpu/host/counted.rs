//! A device that counts the calls that recording must not make.

use ash::vk;
use std::cell::Cell;
use std::ffi::c_void;
use std::sync::OnceLock;

/// The device's own functions. Those that create, allocate, map, submit or wait are counted in `CALLS` on a thread that
/// is `ARMED`.
static TABLE: OnceLock<ash::DeviceFnV1_0> = OnceLock::new();
thread_local! {
    pub static ARMED: Cell<bool> = const { Cell::new(false) };
    pub static CALLS: Cell<u32> = const { Cell::new(0) };
}

macro_rules! counted {
    ($($name:ident($first:ty $(, $arg:ident: $kind:ty)*);)*) => {
        $(unsafe extern "system" fn $name(first: $first $(, $arg: $kind)*) -> vk::Result {
            CALLS.set(CALLS.get() + u32::from(ARMED.get()));
            // SAFETY: the arguments are passed on unchanged.
            unsafe { (TABLE.get().unwrap().$name)(first $(, $arg)*) }
        })*

        /// The device with those functions counted.
        pub fn counting(device: &ash::Device) -> ash::Device {
            let mut table = TABLE.get_or_init(|| device.fp_v1_0().clone()).clone();
            $(table.$name = $name;)*
            let (one, two, three) = (device.fp_v1_1().clone(), device.fp_v1_2().clone(), device.fp_v1_3().clone());
            ash::Device::from_parts_1_3(device.handle(), table, one, two, three)
        }
    };
}

type Callbacks<'a> = *const vk::AllocationCallbacks<'a>;

counted! {
    allocate_memory(vk::Device, info: *const vk::MemoryAllocateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::DeviceMemory);
    create_buffer(vk::Device, info: *const vk::BufferCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::Buffer);
    create_shader_module(vk::Device, info: *const vk::ShaderModuleCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::ShaderModule);
    create_compute_pipelines(vk::Device, cache: vk::PipelineCache, n: u32, info: *const vk::ComputePipelineCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::Pipeline);
    create_pipeline_layout(vk::Device, info: *const vk::PipelineLayoutCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::PipelineLayout);
    create_descriptor_set_layout(vk::Device, info: *const vk::DescriptorSetLayoutCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::DescriptorSetLayout);
    create_descriptor_pool(vk::Device, info: *const vk::DescriptorPoolCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::DescriptorPool);
    create_command_pool(vk::Device, info: *const vk::CommandPoolCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::CommandPool);
    create_query_pool(vk::Device, info: *const vk::QueryPoolCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::QueryPool);
    create_fence(vk::Device, info: *const vk::FenceCreateInfo<'_>, callbacks: Callbacks<'_>, out: *mut vk::Fence);
    map_memory(vk::Device, memory: vk::DeviceMemory, offset: u64, size: u64, flags: vk::MemoryMapFlags, out: *mut *mut c_void);
    wait_for_fences(vk::Device, n: u32, fences: *const vk::Fence, all: vk::Bool32, timeout: u64);
    device_wait_idle(vk::Device);
    queue_wait_idle(vk::Queue);
    queue_submit(vk::Queue, n: u32, info: *const vk::SubmitInfo<'_>, fence: vk::Fence);
}
