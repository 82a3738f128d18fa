//! A pool of memory of dropped buffers, for reuse by new buffers.

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, Allocator};
use std::sync::{Arc, Mutex};

/// Smaller buffers are not kept: the allocator serves them from its blocks.
const LEAST: u64 = 256 << 10;

/// The properties of a buffer; its memory can be reused only by a buffer with the same ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kind {
    pub usage: vk::BufferUsageFlags,
    pub location: MemoryLocation,
}

/// A Vulkan buffer and its memory.
pub(super) struct Memory {
    pub kind: Kind,
    /// Bytes of the Vulkan buffer.
    pub size: u64,
    pub handle: vk::Buffer,
    pub allocation: Option<Allocation>,
    pub address: u64,
}

impl Memory {
    /// Returns it to the driver.
    pub(super) fn free(self, device: &ash::Device, allocator: &Mutex<Allocator>) {
        // SAFETY: work on the buffer has ended, since owning calls wait for their submissions before anything is
        // dropped.
        unsafe { device.destroy_buffer(self.handle, None) };
        if let (Some(allocation), Ok(mut allocator)) = (self.allocation, allocator.lock())
            && let Err(e) = allocator.free(allocation)
        {
            log::error!("freeing {} bytes: {e}", self.size);
        }
    }
}

/// Memory of dropped buffers, the most recent last. It is destroyed before the device, see [`super::Gpu`].
pub(super) struct Pool {
    device: ash::Device,
    allocator: Arc<Mutex<Allocator>>,
    most: u64,
    kept: Mutex<Vec<Memory>>,
}

impl Pool {
    /// A pool of at most `most` bytes.
    pub(super) fn new(device: ash::Device, allocator: Arc<Mutex<Allocator>>, most: u64) -> Self {
        Self { device, allocator, most, kept: Mutex::default() }
    }

    fn free(&self, memory: Memory) {
        memory.free(&self.device, &self.allocator);
    }

    /// Takes the smallest buffer that holds `size` bytes and is at most an eighth larger.
    pub(super) fn take(&self, kind: Kind, size: u64) -> Option<Memory> {
        let mut kept = self.kept.lock().ok()?;
        let fits = |m: &Memory| m.kind == kind && (size..=size + size / 8).contains(&m.size);
        let (i, _) = kept.iter().enumerate().filter(|(_, m)| fits(m)).min_by_key(|(_, m)| m.size)?;
        Some(kept.remove(i))
    }

    /// Keeps memory, and frees the oldest while the pool is too large. Memory that is too small or too large for the
    /// pool is freed immediately.
    pub(super) fn keep(&self, memory: Memory) {
        let Ok(mut kept) = self.kept.lock() else { return self.free(memory) };
        if !(LEAST..=self.most).contains(&memory.size) {
            return self.free(memory);
        }
        kept.push(memory);
        while kept.iter().map(|m| m.size).sum::<u64>() > self.most {
            self.free(kept.remove(0));
        }
    }

    /// Returns all memory to the driver, and whether there was any.
    pub(super) fn clear(&self) -> bool {
        let Ok(mut kept) = self.kept.lock() else { return false };
        let any = !kept.is_empty();
        kept.drain(..).for_each(|memory| self.free(memory));
        any
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.clear();
    }
}
