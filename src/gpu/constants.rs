//! Buffers that kernels receive where there is nothing else to bind.

use super::buffer_ref::{BufferRef, USAGE};
use super::debug;
use super::foundation::Foundation;
use super::memory::allocate;
use super::pool::{Kind, Memory};
use crate::error::{Error, Result};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocator;
use std::sync::Mutex;

/// A small buffer, created first and destroyed last. It holds a word of value `u32::MAX`, used as the device count where
/// the host knows the count, and a part to bind in place of a kernel's optional array.
#[derive(Default)]
pub(super) struct Constants(Option<Memory>);

/// Name of the buffer.
const NAME: &str = "olbvh.constants";
/// Size of the buffer in bytes.
const BYTES: u64 = 512;

impl Constants {
    /// Creates the buffer; `free` frees it, also after an error.
    pub fn make(
        &mut self,
        foundation: &Foundation,
        allocator: &Mutex<Allocator>,
        names: Option<&ash::ext::debug_utils::Device>,
    ) -> Result<()> {
        let (device, addresses) = (&foundation.device, foundation.report.requirements.buffer_addresses);
        // Every invocation reads the word, so it should lie in device memory, if there is room, and not across a bus.
        let kind = Kind { usage: USAGE, location: MemoryLocation::CpuToGpu };
        let memory = self.0.insert(allocate(device, allocator, addresses, NAME, kind, BYTES, &mut |_| Ok(()))?);
        debug::name(names, memory.handle, NAME);
        let mapped = memory.allocation.as_mut().and_then(|a| a.mapped_slice_mut());
        let word = mapped.and_then(|bytes| bytes.first_chunk_mut::<4>());
        *word.ok_or_else(|| Error::NoDevice("no host-visible memory for buffers".into()))? = u32::MAX.to_ne_bytes();
        Ok(())
    }

    /// Frees the buffer, which nothing uses any more.
    pub fn free(&mut self, device: &ash::Device, allocator: &Mutex<Allocator>) {
        if let Some(memory) = self.0.take() {
            memory.free(device, allocator);
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
        let Memory { handle, address, .. } = self.0.as_ref().unwrap_or_else(|| unreachable!("freed in drop only"));
        BufferRef { buffer: *handle, offset: 0, size: BYTES, address: *address }
    }
}
