//! Reduce, exclusive scan and stable radix sort on the device, as functions that append to a recorder.

#[cfg(feature = "cli")]
mod copy;
mod fill;
mod reduce;
mod scan;
mod selftest;
mod sort;

#[cfg(feature = "cli")]
pub(crate) use copy::cmd_copy;
pub(crate) use fill::cmd_fill;
pub use reduce::{REDUCE_SCRATCH, Reduction, cmd_reduce};
pub use scan::{ScanScratch, cmd_exclusive_scan};
pub(crate) use selftest::self_test;
pub use sort::{SortScratch, cmd_sort_pairs};
pub(crate) use sort::{Unsorted, cmd_sort};

use crate::error::{Error, Result};
use crate::gpu::{ALIGNMENT, Buffer, BufferRef, Gpu, Groups, Recorder};
use crate::kernels::{DispatchArgs, DispatchArgsSpec};

/// A number of items: an upper limit known to the host, and optionally the true number in a word of device memory.
#[derive(Clone, Copy, Debug)]
pub struct Count {
    /// No more items than this are accessed, whatever the word holds.
    pub max: u32,
    /// The word with the true number.
    pub live: Option<BufferRef>,
    /// Number of leading items that dispatches leave out, of a number in device memory.
    skip: u32,
}

impl Count {
    /// A number known to the host.
    pub fn host(n: u32) -> Self {
        Self { max: n, live: None, skip: 0 }
    }

    /// A number in device memory, at most `max`.
    pub fn device(max: u32, live: BufferRef) -> Self {
        Self { max, live: Some(live), skip: 0 }
    }

    /// The items after the first `skip`.
    #[must_use]
    pub(crate) fn behind(self, skip: u32) -> Self {
        Self { skip, ..self }
    }

    /// The word that kernels read the number from.
    pub(crate) fn word(&self, gpu: &Gpu) -> BufferRef {
        self.live.unwrap_or_else(|| gpu.unbounded())
    }

    /// Workgroups for `per_group` items each, followed by a barrier with this label. If the number is in device memory,
    /// a kernel first writes the workgroups to `arguments` (12 bytes); the number must be visible before.
    pub(crate) fn groups(&self, r: &mut Recorder<'_>, per_group: u32, arguments: BufferRef, label: &'static str) -> Result<Groups> {
        let groups = self.arguments(r, per_group, arguments)?;
        r.barrier(label);
        Ok(groups)
    }

    /// Workgroups as [`Count::groups`] gives them; the caller records the barrier.
    pub(crate) fn arguments(&self, r: &mut Recorder<'_>, per_group: u32, arguments: BufferRef) -> Result<Groups> {
        let Some(live) = self.live else { return Ok(Groups::Count(self.max.div_ceil(per_group))) };
        let words = arguments.part(0, 12);
        let spec = DispatchArgsSpec { workgroup: r.gpu().subgroup_size(), ..Default::default() };
        r.dispatch(&DispatchArgs { live, groups: words, count: self.max, per_group, skip: self.skip }, spec, Groups::Count(1))?;
        Ok(Groups::Indirect(words))
    }
}

/// Hands out aligned parts of a buffer. Without a buffer it only measures the bytes needed.
#[derive(Debug)]
pub struct Arena {
    memory: Option<BufferRef>,
    used: u64,
}

impl Arena {
    /// An arena over this memory.
    pub fn new(memory: BufferRef) -> Self {
        Self { memory: Some(memory), used: 0 }
    }

    /// Bytes that `carve` takes from an arena.
    pub fn measure<T>(carve: impl FnOnce(&mut Self) -> Result<T>) -> Result<u64> {
        let mut arena = Self { memory: None, used: 0 };
        carve(&mut arena)?;
        Ok(arena.used)
    }

    /// A buffer of exactly the size that `carve` takes, and its parts.
    ///
    /// # Errors
    /// [`Error::Memory`], or those of `carve`.
    pub fn reserve<T>(gpu: &Gpu, name: &str, carve: impl Fn(&mut Self) -> Result<T>) -> Result<(Buffer, T)> {
        let buffer = gpu.buffer(name, Self::measure(&carve)?)?;
        let parts = carve(&mut Self::new(buffer.all()))?;
        Ok((buffer, parts))
    }

    /// Takes the next `bytes` bytes, aligned for every use.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the memory is too small, or its offset in its buffer is not a multiple of [`ALIGNMENT`].
    pub fn take(&mut self, bytes: u64) -> Result<BufferRef> {
        let begin = self.used;
        let end = begin.saturating_add(bytes.max(16));
        self.used = end.checked_next_multiple_of(ALIGNMENT).unwrap_or(u64::MAX / ALIGNMENT * ALIGNMENT);
        match self.memory {
            Some(memory) if !memory.offset.is_multiple_of(ALIGNMENT) => {
                Err(Error::Invalid(format!("memory at byte {} of its buffer; it must begin at a multiple of {ALIGNMENT}", memory.offset)))
            }
            None => Ok(BufferRef { buffer: ash::vk::Buffer::null(), offset: begin, size: bytes.max(16), address: 0 }),
            Some(memory) if end <= memory.size => Ok(memory.part(begin, bytes.max(16))),
            Some(memory) => Err(Error::Invalid(format!("{} bytes of memory are too few: at least {} are needed", memory.size, self.used))),
        }
    }

    /// Takes the next `n` words.
    ///
    /// # Errors
    /// Those of [`Arena::take`].
    pub fn words(&mut self, n: u64) -> Result<BufferRef> {
        self.take(n.saturating_mul(4))
    }
}
