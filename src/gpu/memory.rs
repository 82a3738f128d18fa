//! Buffers of a device handle, which counts or keeps their memory.

use super::buffer_ref::{BufferRef, USAGE};
use super::context::Gpu;
use super::debug;
use super::heap::{Kind, Memory};
use super::pool::Pool;
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;

/// Offsets of arrays within a buffer are multiples of this, which is enough for every device's storage-buffer offsets
/// and for 16-byte loads.
pub const ALIGNMENT: u64 = 256;

/// A buffer and its memory. When dropped, the memory is freed, or kept for another buffer ([`Gpu::with_pool`]).
pub struct Buffer {
    // Declared before `gpu`, so that it is freed before the device is destroyed.
    memory: Option<Memory>,
    pub(super) gpu: Gpu,
    /// Bytes counted in the ledger.
    claimed: u64,
    size: u64,
    name: String,
}

impl Buffer {
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
        let mut fresh = || Memory::new(gpu.heap(), name, kind, size.max(16), &mut claim);
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

    /// The bytes, see [`Memory::mapped`].
    pub(crate) fn mapped(&self) -> Option<&[u8]> {
        self.memory().mapped()?.get(..self.size as usize)
    }

    /// The bytes, see [`Memory::cached`].
    pub(crate) fn cached(&self) -> Option<&[u8]> {
        self.memory().cached()?.get(..self.size as usize)
    }

    /// The bytes, see [`Memory::mapped_mut`].
    pub(crate) fn mapped_mut(&mut self) -> Option<&mut [u8]> {
        self.memory.as_mut()?.mapped_mut()?.get_mut(..self.size as usize)
    }
}

impl Gpu {
    /// A device-local buffer of `size` bytes. At least 16 are allocated, so that an empty array has an address.
    ///
    /// # Errors
    /// [`Error::Memory`] with the buffer's name and size, [`Error::Vulkan`] if the memory cannot be bound.
    pub fn buffer(&self, name: &str, size: u64) -> Result<Buffer> {
        Buffer::with_usage(self, name, size, MemoryLocation::GpuOnly, vk::BufferUsageFlags::empty())
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
        if let (Some(pool), Some(memory)) = (self.gpu.pool(), self.memory.take()) {
            pool.keep(memory);
        }
    }
}
