//! Buffers, with memory from gpu-allocator.

use super::buffer_ref::{BufferRef, USAGE};
use super::context::Gpu;
use super::pool::{Kind, Memory, Pool};
use super::{debug, failed};
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator};
use std::sync::Mutex;

/// Offsets of arrays within a buffer are multiples of this, which is enough for every device's storage-buffer offsets
/// and for 16-byte loads.
pub const ALIGNMENT: u64 = 256;

/// Addresses of buffers are multiples of this even if the device requires less: kernels load 16 bytes in one access.
const LEAST_ALIGNMENT: u64 = 16;

/// Makes a buffer of `size` bytes in fresh memory, with an address if the device has `addresses`. `claim` receives the
/// bytes that it takes.
pub(super) fn allocate(
    device: &ash::Device,
    allocator: &Mutex<Allocator>,
    addresses: bool,
    name: &str,
    kind: Kind,
    size: u64,
    claim: &mut dyn FnMut(u64) -> Result<()>,
) -> Result<Memory> {
    let memory_error = |reason: String| Error::Memory { name: name.into(), bytes: size, reason };
    let address = if addresses { vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS } else { vk::BufferUsageFlags::empty() };
    let info = vk::BufferCreateInfo::default().size(size).usage(kind.usage | address);
    // SAFETY: plain creation; on the error path below the handle is destroyed.
    let handle = unsafe { device.create_buffer(&info, None) }.map_err(|e| memory_error(format!("vkCreateBuffer: {e:?}")))?;
    let mut memory = Memory { kind, size, handle, allocation: None, address: 0 };
    match bind(device, allocator, addresses, name, &mut memory, claim) {
        Ok(()) => Ok(memory),
        Err(e) => {
            memory.free(device, allocator);
            Err(e)
        }
    }
}

/// Allocates memory for a new buffer and binds it.
fn bind(
    device: &ash::Device,
    allocator: &Mutex<Allocator>,
    addresses: bool,
    name: &str,
    memory: &mut Memory,
    claim: &mut dyn FnMut(u64) -> Result<()>,
) -> Result<()> {
    let (handle, location) = (memory.handle, memory.kind.location);
    let memory_error = |reason: String| Error::Memory { name: name.into(), bytes: memory.size, reason };
    // SAFETY: the handle was just made.
    let mut requirements = unsafe { device.get_buffer_memory_requirements(handle) };
    requirements.alignment = requirements.alignment.max(LEAST_ALIGNMENT);
    claim(requirements.size)?;
    let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
    let description = AllocationCreateDesc { name, requirements, location, linear: true, allocation_scheme };
    let mut allocator = allocator.lock().map_err(|_| memory_error("the allocator's lock is poisoned".into()))?;
    let allocation = allocator.allocate(&description).map_err(|e| memory_error(e.to_string()))?;
    drop(allocator);
    // SAFETY: fresh memory that meets the requirements, bound once.
    let bound = unsafe { device.bind_buffer_memory(handle, allocation.memory(), allocation.offset()) };
    memory.allocation = Some(allocation);
    bound.map_err(failed("vkBindBufferMemory"))?;
    if addresses {
        // SAFETY: the buffer was made with the address usage and is bound.
        memory.address = unsafe { device.get_buffer_device_address(&vk::BufferDeviceAddressInfo::default().buffer(handle)) };
    }
    Ok(())
}

/// A buffer and its memory. When dropped, the memory is freed, or kept for another buffer ([`Gpu::with_pool`]).
pub struct Buffer {
    pub(super) gpu: Gpu,
    memory: Option<Memory>,
    /// Bytes counted in the ledger.
    claimed: u64,
    size: u64,
    name: String,
}

impl Buffer {
    /// A device-local buffer of `size` bytes. At least 16 are allocated, so that an empty array has an address.
    ///
    /// # Errors
    /// [`Error::Memory`] with the buffer's name and size.
    pub fn new(gpu: &Gpu, name: &str, size: u64) -> Result<Self> {
        Self::with_usage(gpu, name, size, MemoryLocation::GpuOnly, vk::BufferUsageFlags::empty())
    }

    /// A host-visible buffer for transfers.
    pub(crate) fn staging(gpu: &Gpu, name: &str, size: u64, location: MemoryLocation) -> Result<Self> {
        Self::with_usage(gpu, name, size, location, vk::BufferUsageFlags::empty())
    }

    /// A buffer with usage flags in addition to those of every buffer.
    pub(super) fn with_usage(gpu: &Gpu, name: &str, size: u64, location: MemoryLocation, more: vk::BufferUsageFlags) -> Result<Self> {
        let mut usage = USAGE | more;
        if gpu.acceleration().is_some() {
            usage |= vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;
        }
        let kind = Kind { usage, location };
        let mut buffer = Self { gpu: gpu.clone(), memory: None, claimed: 0, size, name: name.into() };
        let claimed = &mut buffer.claimed;
        let mut claim = |bytes: u64| {
            let Some(ledger) = gpu.ledger() else { return Ok(()) };
            let reason = |used: u64| format!("{used} of the {} bytes that may be used are in use", ledger.limit());
            ledger.claim(bytes).map_err(|used| Error::Memory { name: name.into(), bytes: size, reason: reason(used) })?;
            *claimed = bytes;
            Ok(())
        };
        let mut fresh = || allocate(gpu.device(), gpu.allocator(), gpu.has_addresses(), name, kind, size.max(16), &mut claim);
        let memory = match gpu.pool().and_then(|pool| pool.take(kind, size)) {
            Some(memory) => memory,
            // Memory kept by the pool may be what the device is short of.
            None => fresh().or_else(|e| if gpu.pool().is_some_and(Pool::clear) { fresh() } else { Err(e) })?,
        };
        debug::name(gpu.debug_device(), memory.handle, name);
        buffer.memory = Some(memory);
        Ok(buffer)
    }

    fn memory(&self) -> &Memory {
        self.memory.as_ref().unwrap_or_else(|| unreachable!("memory is taken in drop only"))
    }

    /// The whole buffer as an argument.
    pub fn all(&self) -> BufferRef {
        let Memory { handle, address, .. } = *self.memory();
        BufferRef { buffer: handle, offset: 0, size: self.size, address }
    }

    /// Requested size in bytes.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Name given at creation.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The allocation, if its memory is host-coherent and has these properties.
    fn coherent(&self, and: vk::MemoryPropertyFlags) -> Option<&Allocation> {
        let wanted = vk::MemoryPropertyFlags::HOST_COHERENT | and;
        self.memory().allocation.as_ref().filter(|a| a.memory_properties().contains(wanted))
    }

    /// The bytes, if the memory is mapped and coherent: nothing here flushes a cache.
    pub(crate) fn mapped(&self) -> Option<&[u8]> {
        self.coherent(vk::MemoryPropertyFlags::empty())?.mapped_slice()?.get(..self.size as usize)
    }

    /// The bytes as [`Buffer::mapped`], if the host reads the memory through its caches. Otherwise a copy to such
    /// memory is faster.
    pub(crate) fn cached(&self) -> Option<&[u8]> {
        self.coherent(vk::MemoryPropertyFlags::HOST_CACHED)?.mapped_slice()?.get(..self.size as usize)
    }

    /// The bytes as [`Buffer::mapped`], for writing.
    pub(crate) fn mapped_mut(&mut self) -> Option<&mut [u8]> {
        self.coherent(vk::MemoryPropertyFlags::empty())?;
        self.memory.as_mut()?.allocation.as_mut()?.mapped_slice_mut()?.get_mut(..self.size as usize)
    }
}

impl Gpu {
    /// A device-local buffer, see [`Buffer::new`].
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
        if let Some(ledger) = self.gpu.ledger() {
            ledger.release(self.claimed);
        }
        if let Some(memory) = self.memory.take() {
            match self.gpu.pool() {
                Some(pool) => pool.keep(memory),
                None => memory.free(self.gpu.device(), self.gpu.allocator()),
            }
        }
    }
}
