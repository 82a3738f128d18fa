//! A submission under way, and the read-back of small results.

use super::buffer_ref::{BufferRef, USAGE};
use super::context::Gpu;
use super::heap::{Kind, Memory};
use super::kept::Objects;
use crate::error::{Error, Result};
use gpu_allocator::MemoryLocation;

/// Bytes of the memory that is kept for reading back small results.
pub(super) const READ_BACK: u64 = 64 << 10;
const READ_BACK_KIND: Kind = Kind { usage: USAGE, location: MemoryLocation::GpuToCpu };

/// A submission under way.
pub(super) struct Submission<'a> {
    gpu: &'a Gpu,
    objects: Objects,
    /// Whether it has been executed; otherwise its objects are not used again.
    done: bool,
}

impl<'a> Submission<'a> {
    /// Takes the objects of an earlier submission, or makes new ones.
    pub(super) fn new(gpu: &'a Gpu) -> Result<Self> {
        let new = || Objects::new(gpu.device(), gpu.family(), gpu.timestamp_bits() > 0);
        let objects = gpu.kept().objects().map_or_else(new, Ok)?;
        Ok(Self { gpu, objects, done: false })
    }

    /// Its Vulkan objects.
    pub(super) fn objects(&self) -> Objects {
        self.objects
    }

    /// Notes that the commands have been executed, and the fence waited for.
    pub(super) fn end(&mut self) {
        self.done = true;
    }
}

impl Drop for Submission<'_> {
    fn drop(&mut self) {
        let (device, objects) = (self.gpu.device(), self.objects);
        if self.done {
            self.gpu.kept().keep_objects(device, objects);
        } else {
            objects.destroy(device);
        }
    }
}

impl Gpu {
    /// Reads back a small range through memory that is kept for this.
    pub(super) fn read_back(&self, part: BufferRef, bytes: &mut [u8]) -> Result<()> {
        let new = || Memory::new(self.heap(), "olbvh.read_back", READ_BACK_KIND, READ_BACK, |_| Ok(()));
        let memory = self.kept().read_back().map_or_else(new, Ok)?;
        let size = bytes.len() as u64;
        let to = BufferRef { buffer: memory.handle, offset: 0, size, address: memory.address };
        self.submit("olbvh.read_back", |r| {
            r.copy(part.part(0, size), to);
            Ok(())
        })?;
        let mapped = memory.mapped().ok_or_else(|| Error::Invalid("download memory is not mapped".into()))?;
        bytes.copy_from_slice(&mapped[..bytes.len()]);
        self.kept().keep_read_back(memory);
        Ok(())
    }
}
