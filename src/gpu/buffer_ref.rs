//! References to parts of buffers.

use crate::error::{Error, Result};
use ash::vk;

/// Usage flags of every buffer that kernels access, on any device. A host's buffers need those of
/// [`super::Gpu::usage`].
pub const USAGE: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
    vk::BufferUsageFlags::STORAGE_BUFFER.as_raw()
        | vk::BufferUsageFlags::TRANSFER_SRC.as_raw()
        | vk::BufferUsageFlags::TRANSFER_DST.as_raw()
        | vk::BufferUsageFlags::INDIRECT_BUFFER.as_raw(),
);

/// A part of a buffer of this crate or of the host, as an argument of kernels. It does not keep the buffer alive: the
/// buffer must live until commands recorded with it have been executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferRef {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    pub(crate) size: u64,
    pub(crate) address: u64,
}

impl BufferRef {
    /// A part of the host's buffer: `size` bytes, starting at `offset`. `address` is the device address of the first
    /// byte, or 0 if the device has no buffer addresses. Memory for an [`crate::gpu::Arena`] begins at a multiple of
    /// [`super::ALIGNMENT`]; what is bound by descriptors, at one of the device's `minStorageBufferOffsetAlignment`.
    ///
    /// # Safety
    /// The buffer belongs to the device that the part is used on, has the usage flags of [`super::Gpu::usage`], and has
    /// this many bytes at that offset and address.
    pub unsafe fn from_raw(buffer: vk::Buffer, offset: u64, size: u64, address: u64) -> Self {
        Self { buffer, offset, size, address }
    }

    /// The buffer.
    pub fn buffer(self) -> vk::Buffer {
        self.buffer
    }

    /// Offset of the part in the buffer, in bytes.
    pub fn offset(self) -> u64 {
        self.offset
    }

    /// Size in bytes.
    pub fn size(self) -> u64 {
        self.size
    }

    /// Device address of the first byte; 0 if the device has no buffer addresses.
    pub fn address(self) -> u64 {
        self.address
    }

    /// The part that starts at `offset` and is `size` bytes long, both within this part; anything beyond is cut off.
    #[must_use]
    pub fn part(self, offset: u64, size: u64) -> Self {
        let offset = offset.min(self.size);
        let size = size.min(self.size - offset);
        let address = if self.address == 0 { 0 } else { self.address + offset };
        Self { buffer: self.buffer, offset: self.offset + offset, size, address }
    }

    /// Rejects a part of fewer bytes. `what` names its content in the error.
    pub(crate) fn check(self, bytes: u64, what: &str) -> Result<()> {
        if self.size >= bytes {
            return Ok(());
        }
        Err(Error::Invalid(format!("{what} in a part of {} bytes; {bytes} are needed", self.size)))
    }

    /// The 4-byte word at index `i`, cut off where this part ends.
    #[must_use]
    pub fn word(self, i: u64) -> Self {
        self.part(i.saturating_mul(4), 4)
    }
}
