//! References to parts of buffers.

use ash::vk;

/// Usage of every buffer that kernels touch, whatever the device; the host's need what [`super::Gpu::usage`] says.
pub const USAGE: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
    vk::BufferUsageFlags::STORAGE_BUFFER.as_raw()
        | vk::BufferUsageFlags::TRANSFER_SRC.as_raw()
        | vk::BufferUsageFlags::TRANSFER_DST.as_raw()
        | vk::BufferUsageFlags::INDIRECT_BUFFER.as_raw(),
);

/// A part of a buffer, ours or the host's: what kernels get as an argument. It does not keep the buffer: that must live until commands that were recorded
/// with it have been executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferRef {
    pub(crate) buffer: vk::Buffer,
    pub(crate) offset: u64,
    pub(crate) size: u64,
    pub(crate) address: u64,
}

impl BufferRef {
    /// A part of a buffer of the host's, `size` bytes from `offset` on. `address`: device address of the first byte, 0 where the device has no buffer addresses.
    ///
    /// # Safety
    /// The buffer belongs to the device that the part is used on, has the usage of [`super::Gpu::usage`], and so many bytes, at
    /// that address.
    pub unsafe fn from_raw(buffer: vk::Buffer, offset: u64, size: u64, address: u64) -> Self {
        Self { buffer, offset, size, address }
    }

    /// The buffer.
    pub fn buffer(self) -> vk::Buffer {
        self.buffer
    }

    /// Bytes from the buffer's start.
    pub fn offset(self) -> u64 {
        self.offset
    }

    /// Bytes.
    pub fn size(self) -> u64 {
        self.size
    }

    /// Device address of the first byte; 0 where the device has no buffer addresses.
    pub fn address(self) -> u64 {
        self.address
    }

    /// The part from `offset`, `size` bytes long, both within this part; what is not is cut off.
    #[must_use]
    pub fn part(self, offset: u64, size: u64) -> Self {
        debug_assert!(offset + size <= self.size, "part {offset}+{size} of {}", self.size);
        let offset = offset.min(self.size);
        let size = size.min(self.size - offset);
        let address = if self.address == 0 { 0 } else { self.address + offset };
        Self { buffer: self.buffer, offset: self.offset + offset, size, address }
    }

    /// The 4-byte word at index `i`.
    #[must_use]
    pub fn word(self, i: u64) -> Self {
        self.part(4 * i, 4)
    }
}
