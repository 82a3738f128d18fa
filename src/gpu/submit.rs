//! The convenient side: record, submit, wait; move bytes to the device and back.

use super::buffer_ref::BufferRef;
use super::context::Gpu;
use super::failed;
use super::memory::Buffer;
use super::recorder::Recorder;
use crate::error::{Error, Result};
use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;

/// Bytes that one staging buffer holds; larger transfers go in several.
const STAGING: u64 = 32 << 20;
/// Where memory is limited, one part in so many is for transfers.
const STAGING_SHARE: u64 = 16;
/// Timestamps of one submission.
const TIMESTAMPS: u32 = 256;

/// Device time of a recorded stage.
#[derive(Clone, Debug)]
pub struct StageTime {
    /// Name of the stage.
    pub name: String,
    /// Milliseconds between the timestamps at its begin and end.
    pub milliseconds: f64,
}

impl StageTime {
    /// Milliseconds of these stages together.
    pub fn sum<'a>(stages: impl IntoIterator<Item = &'a Self>) -> f64 {
        stages.into_iter().map(|s| s.milliseconds).sum()
    }
}

/// How long the stages of a submission took.
#[derive(Clone, Debug, Default)]
pub struct StageTimes {
    /// Stages in the order in which they ended; empty where the queue has no timestamps.
    pub stages: Vec<StageTime>,
}

impl StageTimes {
    /// Milliseconds of all stages of that name.
    pub fn milliseconds(&self, name: &str) -> f64 {
        StageTime::sum(self.stages.iter().filter(|s| s.name == name))
    }
}

/// Vulkan objects of one submission, destroyed together.
struct Submission<'a> {
    gpu: &'a Gpu,
    pool: vk::CommandPool,
    fence: vk::Fence,
    queries: vk::QueryPool,
}

impl Drop for Submission<'_> {
    fn drop(&mut self) {
        let device = self.gpu.device();
        // SAFETY: either never submitted, or waited for.
        unsafe {
            device.destroy_query_pool(self.queries, None);
            device.destroy_fence(self.fence, None);
            device.destroy_command_pool(self.pool, None);
        }
    }
}

impl Gpu {
    /// Records work, submits it, and waits until it is done.
    ///
    /// # Safety
    /// Of recorded buffers, what [`Recorder::new`] asks.
    ///
    /// # Errors
    /// Those of `record`, a missing barrier, or a failed Vulkan call.
    pub unsafe fn run<T>(&self, label: &'static str, record: impl FnOnce(&mut Recorder<'_>) -> Result<T>) -> Result<(T, StageTimes)> {
        self.submit(label, record)
    }

    /// The same for work of this crate: its buffers are made for what is recorded, and live where `record` is written.
    pub(crate) fn submit<T>(&self, label: &'static str, record: impl FnOnce(&mut Recorder<'_>) -> Result<T>) -> Result<(T, StageTimes)> {
        let device = self.device();
        let timed = self.timestamp_bits() > 0;
        let mut submission =
            Submission { gpu: self, pool: vk::CommandPool::null(), fence: vk::Fence::null(), queries: vk::QueryPool::null() };
        // SAFETY: objects are made, used and destroyed here, in order; the queue is locked while it is submitted to.
        unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(self.family()).flags(vk::CommandPoolCreateFlags::TRANSIENT);
            submission.pool = device.create_command_pool(&info, None).map_err(failed("vkCreateCommandPool"))?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(submission.pool).command_buffer_count(1);
            let commands = device.allocate_command_buffers(&info).map_err(failed("vkAllocateCommandBuffers"))?[0];
            super::debug::name(self.debug_device(), commands, label);
            let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            device.begin_command_buffer(commands, &begin).map_err(failed("vkBeginCommandBuffer"))?;
            if timed {
                let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(TIMESTAMPS);
                submission.queries = device.create_query_pool(&info, None).map_err(failed("vkCreateQueryPool"))?;
                device.cmd_reset_query_pool(commands, submission.queries, 0, TIMESTAMPS);
            }
            let mut recorder = Recorder::new(self, commands, timed.then_some((submission.queries, TIMESTAMPS)));
            let value = record(&mut recorder)?;
            recorder.finish()?;
            // What the host reads next.
            let barrier = [vk::MemoryBarrier::default()
                .src_access_mask(vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE)
                .dst_access_mask(vk::AccessFlags::HOST_READ)];
            let source = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
            device.cmd_pipeline_barrier(commands, source, vk::PipelineStageFlags::HOST, vk::DependencyFlags::empty(), &barrier, &[], &[]);
            device.end_command_buffer(commands).map_err(failed("vkEndCommandBuffer"))?;
            submission.fence = device.create_fence(&vk::FenceCreateInfo::default(), None).map_err(failed("vkCreateFence"))?;
            let buffers = [commands];
            let submit = [vk::SubmitInfo::default().command_buffers(&buffers)];
            {
                let queue = self.queue()?;
                device.queue_submit(*queue, &submit, submission.fence).map_err(failed("vkQueueSubmit"))?;
            }
            device.wait_for_fences(&[submission.fence], true, u64::MAX).map_err(failed("vkWaitForFences")).map_err(|e| named(e, label))?;
            let stages = if timed { self.read_timestamps(submission.queries, &recorder.stages)? } else { Vec::new() };
            Ok((value, StageTimes { stages }))
        }
    }

    fn read_timestamps(&self, queries: vk::QueryPool, stages: &[(String, u32, u32)]) -> Result<Vec<StageTime>> {
        let used = stages.iter().map(|s| s.2 + 1).max().unwrap_or(0);
        let mut ticks = vec![0u64; used as usize];
        if used > 0 {
            // SAFETY: the queries up to `used` were written by the submission that has ended.
            let read = unsafe { self.device().get_query_pool_results(queries, 0, &mut ticks, vk::QueryResultFlags::TYPE_64) };
            read.map_err(failed("vkGetQueryPoolResults"))?;
        }
        let mask = if self.timestamp_bits() >= 64 { u64::MAX } else { (1 << self.timestamp_bits()) - 1 };
        let period = f64::from(self.limits().timestamp_period) * 1e-6;
        let time = |(name, b, e): &(String, u32, u32)| {
            let span = ticks[*e as usize].wrapping_sub(ticks[*b as usize]) & mask;
            StageTime { name: name.clone(), milliseconds: span as f64 * period }
        };
        Ok(stages.iter().map(time).collect())
    }

    /// A device-local buffer with this content.
    ///
    /// # Errors
    /// [`Error::Memory`], or a failed Vulkan call.
    pub fn upload<T: Pod>(&self, name: &str, data: &[T]) -> Result<Buffer> {
        let mut buffer = Buffer::new(self, name, size_of_val(data) as u64)?;
        self.write(&mut buffer, 0, data)?;
        Ok(buffer)
    }

    /// Bytes that one staging buffer holds here.
    fn staging_bytes(&self) -> u64 {
        self.ledger().map_or(STAGING, |ledger| (ledger.limit() / STAGING_SHARE).clamp(1 << 16, STAGING))
    }

    /// Writes data to a buffer, from byte `at` on.
    pub(crate) fn write<T: Pod>(&self, buffer: &mut Buffer, at: u64, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        if let Some(mapped) = buffer.mapped_mut() {
            mapped[at as usize..at as usize + bytes.len()].copy_from_slice(bytes);
            return Ok(());
        }
        let most = self.staging_bytes();
        let mut staging = Buffer::staging(self, "olbvh.upload.staging", most.min(bytes.len() as u64), MemoryLocation::CpuToGpu)?;
        for (i, chunk) in bytes.chunks(most as usize).enumerate() {
            let mapped = staging.mapped_mut().ok_or_else(|| Error::Invalid("upload memory is not mapped".into()))?;
            mapped[..chunk.len()].copy_from_slice(chunk);
            let (from, to) = (staging.all().part(0, chunk.len() as u64), buffer.all().part(at + i as u64 * most, chunk.len() as u64));
            self.submit("olbvh.upload.staging", |r| {
                r.copy(from, to);
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Reads a part of a buffer back.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a part of another buffer, a failed Vulkan call, or no memory for the transfer.
    pub fn download<T: Pod>(&self, buffer: &Buffer, part: BufferRef) -> Result<Vec<T>> {
        if part.buffer != buffer.all().buffer {
            return Err(Error::Invalid(format!("a part to be read of another buffer than {}", buffer.name())));
        }
        let count = part.size as usize / size_of::<T>();
        let mut data = vec![T::zeroed(); count];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut data);
        if let Some(mapped) = buffer.cached() {
            let at = part.offset as usize;
            bytes.copy_from_slice(&mapped[at..at + bytes.len()]);
            return Ok(data);
        }
        self.download_ref(part, bytes)?;
        Ok(data)
    }

    /// Reads a range of any buffer back through staging memory.
    pub(crate) fn download_ref(&self, part: BufferRef, bytes: &mut [u8]) -> Result<()> {
        let most = self.staging_bytes();
        let staging = Buffer::staging(self, "olbvh.download.staging", most.min(bytes.len() as u64), MemoryLocation::GpuToCpu)?;
        for (i, chunk) in bytes.chunks_mut(most as usize).enumerate() {
            let (from, to) = (part.part(i as u64 * most, chunk.len() as u64), staging.all());
            self.submit("olbvh.download.staging", |r| {
                r.copy(from, to);
                Ok(())
            })?;
            let mapped = staging.mapped().ok_or_else(|| Error::Invalid("download memory is not mapped".into()))?;
            chunk.copy_from_slice(&mapped[..chunk.len()]);
        }
        Ok(())
    }
}

/// Says which submission was lost.
fn named(error: Error, label: &str) -> Error {
    match error {
        Error::Vulkan { call, result, hint } => Error::Vulkan { call, result, hint: format!(" in {label}{hint}") },
        other => other,
    }
}
