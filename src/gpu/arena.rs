//! Parts of one allocation.

use super::{ALIGNMENT, Buffer, BufferRef, Gpu};
use crate::error::{Error, Result};
use ash::vk;

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
            None => Ok(BufferRef { buffer: vk::Buffer::null(), offset: begin, size: bytes.max(16), address: 0 }),
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
