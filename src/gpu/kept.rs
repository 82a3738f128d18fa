//! What submissions leave to the next one: a command buffer, a fence, queries, and memory to read back small results.
//! Making them takes ten times as long as submitting does (NVIDIA: 0.6 ms, and 1.4 ms for the memory).

use super::failed;
use super::heap::Memory;
use crate::error::Result;
use ash::vk;
use std::sync::Mutex;

/// Most timestamps of one submission.
pub(super) const TIMESTAMPS: u32 = 256;

/// The Vulkan objects of a submission.
#[derive(Clone, Copy)]
pub(super) struct Objects {
    pool: vk::CommandPool,
    /// The command buffer.
    pub commands: vk::CommandBuffer,
    /// The fence that is signalled at its end.
    pub fence: vk::Fence,
    /// Queries for timestamps, if the queue has any.
    pub queries: vk::QueryPool,
}

/// What is kept.
#[derive(Default)]
pub(super) struct Kept {
    objects: Mutex<Vec<Objects>>,
    read_back: Mutex<Option<Memory>>,
}

impl Kept {
    /// The objects of an earlier submission, if some are kept.
    pub(super) fn objects(&self) -> Option<Objects> {
        self.objects.lock().ok()?.pop()
    }

    /// Keeps the objects of a submission that has been waited for, or destroys them if they cannot be used again.
    pub(super) fn keep_objects(&self, device: &ash::Device, objects: Objects) {
        if objects.reset(device)
            && let Ok(mut kept) = self.objects.lock()
        {
            return kept.push(objects);
        }
        objects.destroy(device);
    }

    /// The memory of an earlier read-back, if it is kept.
    pub(super) fn read_back(&self) -> Option<Memory> {
        self.read_back.lock().ok()?.take()
    }

    /// Keeps memory for the next read-back.
    pub(super) fn keep_read_back(&self, memory: Memory) {
        if let Ok(mut kept) = self.read_back.lock() {
            *kept = Some(memory);
        }
    }

    /// Destroys everything; nothing of it may be in use.
    pub(super) fn destroy(&self, device: &ash::Device) {
        let objects = self.objects.lock().map(|mut kept| std::mem::take(&mut *kept)).unwrap_or_default();
        objects.iter().for_each(|o| o.destroy(device));
    }
}

impl Objects {
    /// New objects for a queue family; `timed` says whether its queues have timestamps.
    pub(super) fn new(device: &ash::Device, family: u32, timed: bool) -> Result<Self> {
        let null = vk::CommandPool::null();
        let mut made = Self { pool: null, commands: vk::CommandBuffer::null(), fence: vk::Fence::null(), queries: vk::QueryPool::null() };
        made.make(device, family, timed).inspect_err(|_| made.destroy(device))?;
        Ok(made)
    }

    fn make(&mut self, device: &ash::Device, family: u32, timed: bool) -> Result<()> {
        // SAFETY: plain creation on this device; what was made is destroyed by the caller, also if another call fails.
        unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(family).flags(vk::CommandPoolCreateFlags::TRANSIENT);
            self.pool = device.create_command_pool(&info, None).map_err(failed("vkCreateCommandPool"))?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
            self.commands = device.allocate_command_buffers(&info).map_err(failed("vkAllocateCommandBuffers"))?[0];
            if timed {
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

    pub(super) fn destroy(&self, device: &ash::Device) {
        // SAFETY: the submission was never submitted, has been waited for, or is lost with its device.
        unsafe {
            device.destroy_query_pool(self.queries, None);
            device.destroy_fence(self.fence, None);
            device.destroy_command_pool(self.pool, None);
        }
    }
}
