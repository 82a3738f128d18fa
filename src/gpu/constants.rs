//! Buffers that kernels receive where there is nothing else to bind.

use super::buffer_ref::{BufferRef, USAGE};
use super::debug;
use super::heap::{Heap, Kind, Memory};
use crate::error::{Error, Result};
use gpu_allocator::MemoryLocation;
use std::sync::Arc;

/// A small buffer that lives as long as the device. It holds a word of value `u32::MAX`, used as the device count where
/// the host knows the count, and a part to bind in place of a kernel's optional array.
pub(super) struct Constants(Memory);

/// Name of the buffer.
const NAME: &str = "olbvh.constants";
/// Size of the buffer in bytes.
const BYTES: u64 = 512;

impl Constants {
    /// Makes the buffer.
    pub fn new(heap: &Arc<Heap>, names: Option<&ash::ext::debug_utils::Device>) -> Result<Self> {
        // Every invocation reads the word, so it should lie in device memory, if there is room, and not across a bus.
        let kind = Kind { usage: USAGE, location: MemoryLocation::CpuToGpu };
        let mut memory = Memory::new(heap, NAME, kind, BYTES, |_| Ok(()))?;
        debug::name(names, memory.handle, NAME);
        let word = memory.mapped_mut().and_then(|bytes| bytes.first_chunk_mut::<4>());
        *word.ok_or_else(|| Error::NoDevice("no host-visible, coherent memory for buffers".into()))? = u32::MAX.to_ne_bytes();
        Ok(Self(memory))
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
        let Memory { handle, address, .. } = self.0;
        BufferRef { buffer: handle, offset: 0, size: BYTES, address }
    }
}
