//! Where the memory of buffers comes from: gpu-allocator, the host's or one of this crate.

use super::failed;
use super::foundation::Foundation;
use super::requirements::DeviceReport;
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use std::sync::{Arc, Mutex, PoisonError};

/// Addresses of buffers are multiples of this even if the device requires less: kernels load 16 bytes in one access.
const LEAST_ALIGNMENT: u64 = 16;

/// A device and its memory allocator.
pub(super) struct Heap {
    device: ash::Device,
    pub allocator: Arc<Mutex<Allocator>>,
    /// Whether buffers have addresses.
    addresses: bool,
    largest_buffer: u64,
    largest_allocation: u64,
}

/// The properties of a buffer; its memory can be reused only by a buffer with the same ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kind {
    /// Usage flags, but for the one for addresses.
    pub usage: vk::BufferUsageFlags,
    pub location: MemoryLocation,
}

/// A Vulkan buffer and its memory. When dropped, both are returned to the driver.
pub(super) struct Memory {
    heap: Arc<Heap>,
    pub kind: Kind,
    /// Bytes of the Vulkan buffer.
    pub size: u64,
    pub handle: vk::Buffer,
    pub allocation: Option<Allocation>,
    pub address: u64,
}

impl Heap {
    /// The heap of a device, with the host's allocator if there is one.
    pub fn new(foundation: &Foundation) -> Result<Arc<Self>> {
        let DeviceReport { largest_buffer, largest_allocation, ref requirements, .. } = foundation.report;
        let addresses = requirements.buffer_addresses;
        let allocator = foundation.allocator.clone().map_or_else(|| make_allocator(foundation, addresses), Ok)?;
        Ok(Arc::new(Self { device: foundation.device.clone(), allocator, addresses, largest_buffer, largest_allocation }))
    }
}

/// Makes an allocator owned by this crate.
fn make_allocator(foundation: &Foundation, addresses: bool) -> Result<Arc<Mutex<Allocator>>> {
    let made = Allocator::new(&AllocatorCreateDesc {
        instance: foundation.instance.clone(),
        device: foundation.device.clone(),
        physical_device: foundation.physical,
        debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
        buffer_device_address: addresses,
        // Small blocks, since every block counts in full against the device's memory.
        allocation_sizes: gpu_allocator::AllocationSizes::new(16 << 20, 4 << 20),
    });
    let made = made.map_err(|e| Error::Memory { name: "olbvh.allocator".into(), bytes: 0, reason: e.to_string() })?;
    Ok(Arc::new(Mutex::new(made)))
}

impl Memory {
    /// Makes a buffer of `size` bytes in fresh memory. `claim` receives the bytes that it takes.
    pub fn new(heap: &Arc<Heap>, name: &str, kind: Kind, size: u64, claim: impl FnOnce(u64) -> Result<()>) -> Result<Self> {
        let error = |reason: String| Error::Memory { name: name.into(), bytes: size, reason };
        if size > heap.largest_buffer {
            return Err(error(format!("a buffer of this device holds {} bytes at most", heap.largest_buffer)));
        }
        let address = if heap.addresses { vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS } else { vk::BufferUsageFlags::empty() };
        let info = vk::BufferCreateInfo::default().size(size).usage(kind.usage | address);
        // SAFETY: plain creation; the handle is destroyed when `memory` is dropped.
        let handle = unsafe { heap.device.create_buffer(&info, None) }.map_err(|e| error(format!("vkCreateBuffer: {e:?}")))?;
        let mut memory = Self { heap: heap.clone(), kind, size, handle, allocation: None, address: 0 };
        // SAFETY: the handle was just made.
        let mut requirements = unsafe { heap.device.get_buffer_memory_requirements(handle) };
        requirements.alignment = requirements.alignment.max(LEAST_ALIGNMENT);
        claim(requirements.size)?;
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let description = AllocationCreateDesc { name, requirements, location: kind.location, linear: true, allocation_scheme };
        // A panic of the host elsewhere leaves the allocator as it was between two calls.
        let mut allocator = heap.allocator.lock().unwrap_or_else(PoisonError::into_inner);
        let promised = heap.largest_allocation;
        let beyond = if size > promised { format!("; the device promises {promised} bytes at once, no more") } else { String::new() };
        let allocation = allocator.allocate(&description).map_err(|e| error(format!("{e}{beyond}")))?;
        drop(allocator);
        // SAFETY: fresh memory that meets the requirements, bound once.
        let bound = unsafe { heap.device.bind_buffer_memory(handle, allocation.memory(), allocation.offset()) };
        memory.allocation = Some(allocation);
        bound.map_err(failed("vkBindBufferMemory"))?;
        if heap.addresses {
            // SAFETY: the buffer was made with the address usage and is bound.
            memory.address = unsafe { heap.device.get_buffer_device_address(&vk::BufferDeviceAddressInfo::default().buffer(handle)) };
        }
        Ok(memory)
    }

    /// The allocation, if its memory is host-coherent and has these properties.
    fn coherent(&self, and: vk::MemoryPropertyFlags) -> Option<&Allocation> {
        let wanted = vk::MemoryPropertyFlags::HOST_COHERENT | and;
        self.allocation.as_ref().filter(|a| a.memory_properties().contains(wanted))
    }

    /// The bytes, if the memory is mapped and coherent: nothing here flushes a cache.
    pub fn mapped(&self) -> Option<&[u8]> {
        self.coherent(vk::MemoryPropertyFlags::empty())?.mapped_slice()
    }

    /// The bytes as [`Memory::mapped`], if the host reads the memory through its caches. Otherwise a copy to such memory
    /// is faster.
    pub fn cached(&self) -> Option<&[u8]> {
        self.coherent(vk::MemoryPropertyFlags::HOST_CACHED)?.mapped_slice()
    }

    /// The bytes as [`Memory::mapped`], for writing.
    pub fn mapped_mut(&mut self) -> Option<&mut [u8]> {
        self.coherent(vk::MemoryPropertyFlags::empty())?;
        self.allocation.as_mut()?.mapped_slice_mut()
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        // SAFETY: work on the buffer has ended: owning calls wait for their submissions before anything is dropped, and
        // whoever records for themselves keeps memory until then (`Recorder::new`). The device outlives all memory (see
        // `Gpu` and `Inner`).
        unsafe { self.heap.device.destroy_buffer(self.handle, None) };
        if let Some(allocation) = self.allocation.take()
            && let Err(e) = self.heap.allocator.lock().unwrap_or_else(PoisonError::into_inner).free(allocation)
        {
            log::error!("freeing {} bytes: {e}", self.size);
        }
    }
}
