//! A pool of memory of dropped buffers, for reuse by new buffers.

use super::heap::{Kind, Memory};
use std::sync::Mutex;

/// Smaller buffers are not kept: the allocator serves them from its blocks.
const LEAST: u64 = 256 << 10;

/// Memory of dropped buffers, the most recent last. It is destroyed before the device, see [`super::Gpu`].
pub(super) struct Pool {
    most: u64,
    kept: Mutex<Vec<Memory>>,
}

impl Pool {
    /// A pool of at most `most` bytes.
    pub(super) fn new(most: u64) -> Self {
        Self { most, kept: Mutex::default() }
    }

    /// Takes the smallest buffer that holds `size` bytes and is at most an eighth larger.
    pub(super) fn take(&self, kind: Kind, size: u64) -> Option<Memory> {
        let mut kept = self.kept.lock().ok()?;
        let fits = |m: &Memory| m.kind == kind && (size..=size.saturating_add(size / 8)).contains(&m.size);
        let (i, _) = kept.iter().enumerate().filter(|(_, m)| fits(m)).min_by_key(|(_, m)| m.size)?;
        Some(kept.remove(i))
    }

    /// Keeps memory, and frees the oldest while the pool is too large. Memory that is too small or too large for the
    /// pool is freed immediately.
    pub(super) fn keep(&self, memory: Memory) {
        let Ok(mut kept) = self.kept.lock() else { return };
        if !(LEAST..=self.most).contains(&memory.size) {
            return;
        }
        kept.push(memory);
        while kept.iter().map(|m| m.size).sum::<u64>() > self.most {
            kept.remove(0);
        }
    }

    /// Returns all memory to the driver, and whether there was any.
    pub(super) fn clear(&self) -> bool {
        self.kept.lock().is_ok_and(|mut kept| kept.drain(..).count() > 0)
    }
}
