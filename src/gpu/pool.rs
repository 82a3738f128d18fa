//! Memory of dropped buffers that waits for the next ones.

use super::context::Gpu;
use super::memory::Memory;
use ash::vk;
use gpu_allocator::MemoryLocation;
use std::sync::Mutex;

/// Buffers below this are not worth keeping: the allocator has blocks for them.
const LEAST: u64 = 256 << 10;

/// What a buffer was made for: another can only take its place if that is the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kind {
    pub usage: vk::BufferUsageFlags,
    pub location: MemoryLocation,
}

/// Memory of dropped buffers, the latest last.
pub(super) struct Pool {
    /// A handle without pool, which frees what is kept.
    gpu: Gpu,
    most: u64,
    kept: Mutex<Vec<Memory>>,
}

impl Pool {
    /// Of at most so many bytes.
    pub(super) fn new(gpu: Gpu, most: u64) -> Self {
        Self { gpu, most, kept: Mutex::default() }
    }

    /// The smallest that holds `size` bytes without much to spare.
    pub(super) fn take(&self, kind: Kind, size: u64) -> Option<Memory> {
        let mut kept = self.kept.lock().ok()?;
        let fits = |m: &Memory| m.kind == kind && (size..=size + size / 8).contains(&m.size);
        let (i, _) = kept.iter().enumerate().filter(|(_, m)| fits(m)).min_by_key(|(_, m)| m.size)?;
        Some(kept.remove(i))
    }

    /// Keeps memory, in place of what has waited longest where that is too much, or gives it back.
    pub(super) fn keep(&self, memory: Memory) {
        let Ok(mut kept) = self.kept.lock() else { return memory.free(&self.gpu) };
        if !(LEAST..=self.most).contains(&memory.size) {
            return memory.free(&self.gpu);
        }
        kept.push(memory);
        while kept.iter().map(|m| m.size).sum::<u64>() > self.most {
            kept.remove(0).free(&self.gpu);
        }
    }

    /// Gives all of it back to the driver; whether there was any.
    pub(super) fn clear(&self) -> bool {
        let Ok(mut kept) = self.kept.lock() else { return false };
        let any = !kept.is_empty();
        kept.drain(..).for_each(|memory| memory.free(&self.gpu));
        any
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.clear();
    }
}
