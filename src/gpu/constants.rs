//! Buffers that kernels receive where there is nothing else to bind.

use super::buffer_ref::{BufferRef, USAGE};
use super::foundation::Foundation;
use super::{debug, failed};
use crate::error::{Error, Result};
use ash::vk;

/// A small buffer in its own memory, created first and destroyed last. It holds a word of value `u32::MAX`, used as the
/// device count where the host knows the count, and a part to bind in place of a kernel's optional array.
#[derive(Default)]
pub(super) struct Constants {
    buffer: vk::Buffer,
    memory: vk::DeviceMemory,
    address: u64,
}

/// Size of the buffer in bytes.
const BYTES: u64 = 512;

impl Constants {
    /// Creates the buffer. If that fails, `destroy` frees the parts already made.
    pub fn make(&mut self, foundation: &Foundation, names: Option<&ash::ext::debug_utils::Device>) -> Result<()> {
        let Foundation { instance, physical, device, report, .. } = foundation;
        let addresses = report.requirements.buffer_addresses;
        let mut usage = USAGE;
        let mut flags = vk::MemoryAllocateFlagsInfo::default();
        if addresses {
            usage |= vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
            flags = flags.flags(vk::MemoryAllocateFlags::DEVICE_ADDRESS);
        }
        // SAFETY: plain creation, binding and mapping of one small host-visible buffer; freed in `destroy`.
        unsafe {
            let info = vk::BufferCreateInfo::default().size(BYTES).usage(usage);
            self.buffer = device.create_buffer(&info, None).map_err(failed("vkCreateBuffer"))?;
            let needs = device.get_buffer_memory_requirements(self.buffer);
            let memory = instance.get_physical_device_memory_properties(*physical);
            let wanted = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let find = |wanted| {
                (0..memory.memory_type_count)
                    .find(|&i| needs.memory_type_bits >> i & 1 == 1 && memory.memory_types[i as usize].property_flags.contains(wanted))
            };
            // Every invocation reads the word, so it should lie in device memory, if there is room, and not across a
            // bus.
            let mut allocated = Err(Error::NoDevice("no host-visible memory for buffers".into()));
            for kind in [wanted | vk::MemoryPropertyFlags::DEVICE_LOCAL, wanted].into_iter().filter_map(find) {
                let info = vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(kind).push_next(&mut flags);
                allocated = device.allocate_memory(&info, None).map_err(failed("vkAllocateMemory"));
                if allocated.is_ok() {
                    break;
                }
            }
            self.memory = allocated?;
            device.bind_buffer_memory(self.buffer, self.memory, 0).map_err(failed("vkBindBufferMemory"))?;
            let mapped = device.map_memory(self.memory, 0, vk::WHOLE_SIZE, vk::MemoryMapFlags::empty()).map_err(failed("vkMapMemory"))?;
            mapped.cast::<u32>().write(u32::MAX);
            device.unmap_memory(self.memory);
            debug::name(names, self.buffer, "olbvh.constants");
            if addresses {
                self.address = device.get_buffer_device_address(&vk::BufferDeviceAddressInfo::default().buffer(self.buffer));
            }
        }
        Ok(())
    }

    /// Destroys the handles that exist.
    ///
    /// # Safety
    /// The handles belong to this device, and nothing uses them any more.
    pub unsafe fn destroy(&self, device: &ash::Device) {
        // SAFETY: the caller guarantees that the handles belong to this device and are unused; null handles are
        // ignored.
        unsafe {
            device.destroy_buffer(self.buffer, None);
            device.free_memory(self.memory, None);
        }
    }

    /// A buffer whose first word is `u32::MAX`.
    pub fn unbounded(&self) -> BufferRef {
        self.all().part(0, 16)
    }

    /// A buffer to bind in place of an optional array that is absent.
    pub fn nothing(&self) -> BufferRef {
        self.all().part(256, 16)
    }

    fn all(&self) -> BufferRef {
        BufferRef { buffer: self.buffer, offset: 0, size: BYTES, address: self.address }
    }
}
