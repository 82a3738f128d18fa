//! What submissions leave to the next one: a command buffer, a fence, queries, and memory to read back small results.
//! Making them takes ten times as long as submitting does (NVIDIA: 0.6 ms, and 1.4 ms for the memory).

use super::buffer_ref::{BufferRef, USAGE};
use super::context::Gpu;
use super::failed;
use super::heap::{Kind, Memory};
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use std::sync::Mutex;

/// Most timestamps of one submission.
pub(super) const TIMESTAMPS: u32 = 256;
/// Bytes of the memory that is kept for reading back small results.
pub(super) const READ_BACK: u64 = 64 << 10;
const READ_BACK_KIND: Kind = Kind { usage: USAGE, location: MemoryLocation::GpuToCpu };

/// The Vulkan objects of a submission.
#[derive(Clone, Copy)]
struct Objects {
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    queries: vk::QueryPool,
}

/// What is kept.
#[derive(Default)]
pub(super) struct Kept {
    objects: Mutex<Vec<Objects>>,
    read_back: Mutex<Option<Memory>>,
}

impl Kept {
    /// Destroys everything; nothing of it may be in use.
    pub(super) fn destroy(&self, device: &ash::Device) {
        let objects = self.objects.lock().map(|mut kept| std::mem::take(&mut *kept)).unwrap_or_default();
        objects.iter().for_each(|o| o.destroy(device));
    }
}

impl Objects {
    fn new(gpu: &Gpu) -> Result<Self> {
        let (device, null) = (gpu.device(), vk::CommandPool::null());
        let mut made = Self { pool: null, commands: vk::CommandBuffer::null(), fence: vk::Fence::null(), queries: vk::QueryPool::null() };
        made.make(gpu).inspect_err(|_| made.destroy(device))?;
        Ok(made)
    }

    fn make(&mut self, gpu: &Gpu) -> Result<()> {
        let device = gpu.device();
        // SAFETY: plain creation on this device; what was made is destroyed by the caller, also if another call fails.
        unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.family()).flags(vk::CommandPoolCreateFlags::TRANSIENT);
            self.pool = device.create_command_pool(&info, None).map_err(failed("vkCreateCommandPool"))?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
            self.commands = device.allocate_command_buffers(&info).map_err(failed("vkAllocateCommandBuffers"))?[0];
            if gpu.timestamp_bits() > 0 {
                let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(TIMESTAMPS);
                self.queries = device.create_query_pool(&info, None).map_err(failed("vkCreateQueryPool"))?;
            }
            self.fence = device.create_fence(&vk::FenceCreateInfo::default(), None).map_err(failed("vkCreateFence"))?;
        }
        Ok(())
    }

    /// Makes the objects ready for another submission; false if they cannot be.
    fn reset(&self, device: &ash::Device) -> bool {
        // SAFETY: the submission has been waited for.
        unsafe {
            device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()).is_ok() && device.reset_fences(&[self.fence]).is_ok()
        }
    }

    fn destroy(&self, device: &ash::Device) {
        // SAFETY: the submission was never submitted, or has been waited for.
        unsafe {
            device.destroy_query_pool(self.queries, None);
            device.destroy_fence(self.fence, None);
            device.destroy_command_pool(self.pool, None);
        }
    }
}

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
        let kept = gpu.kept().objects.lock().ok().and_then(|mut kept| kept.pop());
        let objects = kept.map_or_else(|| Objects::new(gpu), Ok)?;
        Ok(Self { gpu, objects, done: false })
    }

    /// The command buffer, the fence, and the queries for timestamps, if there are any.
    pub(super) fn handles(&self) -> (vk::CommandBuffer, vk::Fence, vk::QueryPool) {
        (self.objects.commands, self.objects.fence, self.objects.queries)
    }

    /// Notes that the commands have been executed, and the fence waited for.
    pub(super) fn end(&mut self) {
        self.done = true;
    }
}

impl Drop for Submission<'_> {
    fn drop(&mut self) {
        let (device, objects) = (self.gpu.device(), self.objects);
        if self.done
            && objects.reset(device)
            && let Ok(mut kept) = self.gpu.kept().objects.lock()
        {
            return kept.push(objects);
        }
        objects.destroy(device);
    }
}

impl Gpu {
    /// Reads back a small range through memory that is kept for this.
    pub(super) fn read_back(&self, part: BufferRef, bytes: &mut [u8]) -> Result<()> {
        let kept = self.kept().read_back.lock().ok().and_then(|mut kept| kept.take());
        let memory = kept.map_or_else(|| Memory::new(self.heap(), "olbvh.read_back", READ_BACK_KIND, READ_BACK, |_| Ok(())), Ok)?;
        let size = bytes.len() as u64;
        let to = BufferRef { buffer: memory.handle, offset: 0, size, address: memory.address };
        self.submit("olbvh.read_back", |r| {
            r.copy(part.part(0, size), to);
            Ok(())
        })?;
        let mapped = memory.mapped().ok_or_else(|| Error::Invalid("download memory is not mapped".into()))?;
        bytes.copy_from_slice(&mapped[..bytes.len()]);
        if let Ok(mut kept) = self.kept().read_back.lock() {
            *kept = Some(memory);
        }
        Ok(())
    }
}
