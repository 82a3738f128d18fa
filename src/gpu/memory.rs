//! Buffers from gpu-allocator.

use super::buffer_ref::{BufferRef, USAGE};
use super::context::Gpu;
use super::{debug, failed};
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

/// Offsets of arrays within a buffer are multiples of this: enough for every device's storage-buffer offsets and 16-byte loads.
pub const ALIGNMENT: u64 = 256;

/// Addresses of buffers are multiples of this, whatever the device asks for: kernels load 16 bytes at once.
const LEAST_ALIGNMENT: u64 = 16;

/// A buffer with memory of its own, freed when dropped.
pub struct Buffer {
    gpu: Gpu,
    handle: vk::Buffer,
    allocation: Option<Allocation>,
    /// Bytes counted in the device's ledger.
    claimed: u64,
    size: u64,
    address: u64,
    name: String,
}

impl Buffer {
    /// A device-local buffer of `size` bytes (at least 16 are allocated, so that an empty array has an address).
    ///
    /// # Errors
    /// [`Error::Memory`] names the buffer and its size.
    pub fn new(gpu: &Gpu, name: &str, size: u64) -> Result<Self> {
        Self::with_usage(gpu, name, size, MemoryLocation::GpuOnly, vk::BufferUsageFlags::empty())
    }

    /// A host-visible buffer for transfers.
    pub(crate) fn staging(gpu: &Gpu, name: &str, size: u64, location: MemoryLocation) -> Result<Self> {
        Self::with_usage(gpu, name, size, location, vk::BufferUsageFlags::empty())
    }

    /// A buffer with usage flags beside those of every buffer.
    pub(super) fn with_usage(gpu: &Gpu, name: &str, size: u64, location: MemoryLocation, more: vk::BufferUsageFlags) -> Result<Self> {
        let device = gpu.device();
        let memory_error = |reason: String| Error::Memory { name: name.into(), bytes: size, reason };
        let mut usage = USAGE | more;
        if gpu.has_addresses() {
            usage |= vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        }
        if gpu.acceleration().is_some() {
            usage |= vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        }
        let info = vk::BufferCreateInfo::default().size(size.max(16)).usage(usage);
        // SAFETY: the device is alive as long as `gpu`; on every error path below the handle is destroyed.
        let handle = unsafe { device.create_buffer(&info, None) }.map_err(|e| memory_error(format!("vkCreateBuffer: {e:?}")))?;
        // SAFETY: the handle was just made.
        let mut requirements = unsafe { device.get_buffer_memory_requirements(handle) };
        requirements.alignment = requirements.alignment.max(LEAST_ALIGNMENT);
        let description =
            AllocationCreateDesc { name, requirements, location, linear: true, allocation_scheme: AllocationScheme::GpuAllocatorManaged };
        let mut buffer = Self { gpu: gpu.clone(), handle, allocation: None, claimed: 0, size, address: 0, name: name.into() };
        if let Some(ledger) = gpu.ledger() {
            let full = |used: u64| memory_error(format!("{used} of the {} bytes that may be used are in use", ledger.limit()));
            ledger.claim(requirements.size).map_err(full)?;
            buffer.claimed = requirements.size;
        }
        let allocated = gpu.allocator().lock().map_err(|_| memory_error("the allocator's lock is poisoned".into()));
        buffer.allocation = Some(allocated.and_then(|mut a| a.allocate(&description).map_err(|e| memory_error(e.to_string())))?);
        if let Some(allocation) = &buffer.allocation {
            // SAFETY: fresh memory of the right requirements, bound once.
            unsafe { device.bind_buffer_memory(handle, allocation.memory(), allocation.offset()) }.map_err(failed("vkBindBufferMemory"))?;
        }
        if gpu.has_addresses() {
            // SAFETY: the buffer was made with the address usage and is bound.
            buffer.address = unsafe { device.get_buffer_device_address(&vk::BufferDeviceAddressInfo::default().buffer(handle)) };
        }
        debug::name(gpu.debug_device(), handle, name);
        Ok(buffer)
    }

    /// The whole buffer as an argument.
    pub fn all(&self) -> BufferRef {
        BufferRef { buffer: self.handle, offset: 0, size: self.size, address: self.address }
    }

    /// Bytes asked for.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Name given at creation.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The allocation, if its memory has these properties besides being coherent.
    fn coherent(&self, and: vk::MemoryPropertyFlags) -> Option<&Allocation> {
        let wanted = vk::MemoryPropertyFlags::HOST_COHERENT | and;
        self.allocation.as_ref().filter(|a| a.memory_properties().contains(wanted))
    }

    /// The bytes, where the host sees them as the device does: nothing here flushes a cache.
    pub(crate) fn mapped(&self) -> Option<&[u8]> {
        self.coherent(vk::MemoryPropertyFlags::empty())?.mapped_slice()?.get(..self.size as usize)
    }

    /// As [`Buffer::mapped`], where the host reads it through its caches: without, it is faster to copy it to where it does.
    pub(crate) fn cached(&self) -> Option<&[u8]> {
        self.coherent(vk::MemoryPropertyFlags::HOST_CACHED)?.mapped_slice()?.get(..self.size as usize)
    }

    /// As [`Buffer::mapped`], to write.
    pub(crate) fn mapped_mut(&mut self) -> Option<&mut [u8]> {
        self.coherent(vk::MemoryPropertyFlags::empty())?;
        self.allocation.as_mut()?.mapped_slice_mut()?.get_mut(..self.size as usize)
    }
}

impl Gpu {
    /// A device-local buffer; see [`Buffer::new`].
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn buffer(&self, name: &str, size: u64) -> Result<Buffer> {
        Buffer::new(self, name, size)
    }
}

impl std::fmt::Debug for Buffer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Buffer({}, {} bytes)", self.name, self.size)
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: work on the buffer has ended: submissions of the convenient layer are waited for before anything is dropped.
        unsafe { self.gpu.device().destroy_buffer(self.handle, None) };
        if let Some(ledger) = self.gpu.ledger() {
            ledger.release(self.claimed);
        }
        if let (Some(allocation), Ok(mut allocator)) = (self.allocation.take(), self.gpu.allocator().lock())
            && let Err(e) = allocator.free(allocation)
        {
            log::error!("freeing {}: {e}", self.name);
        }
    }
}
