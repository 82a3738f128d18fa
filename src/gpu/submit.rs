//! Submission for the owning calls: record, submit, wait, and copy bytes to the device and back.

use super::buffer_ref::BufferRef;
use super::context::Gpu;
use super::failed;
use super::kept::{Objects, TIMESTAMPS};
use super::memory::Buffer;
use super::recorder::Recorder;
use super::submission::{READ_BACK, Submission};
use crate::error::{Error, Result};
use crate::times::{StageTime, StageTimes};
use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;

/// Size of a staging buffer in bytes; larger transfers are split.
const STAGING: u64 = 32 << 20;
/// Where memory is limited, a staging buffer takes one part in this many of the limit.
const STAGING_SHARE: u64 = 16;

impl Gpu {
    /// Records work, submits it, and waits until it has been executed.
    ///
    /// # Safety
    /// The requirements of [`Recorder::new`] on recorded buffers.
    ///
    /// # Errors
    /// The errors of `record`, a missing barrier, or a failed Vulkan call.
    pub unsafe fn run<T>(&self, label: &'static str, record: impl FnOnce(&mut Recorder<'_>) -> Result<T>) -> Result<(T, StageTimes)> {
        self.submit(label, record)
    }

    /// Runs work of this crate as [`Gpu::run`] does. It is safe because this crate makes the recorded buffers to fit,
    /// and keeps them alive for the duration of the call.
    pub(crate) fn submit<T>(&self, label: &'static str, record: impl FnOnce(&mut Recorder<'_>) -> Result<T>) -> Result<(T, StageTimes)> {
        let submission = Submission::new(self)?;
        let mut recorder = self.begin(&submission, label)?;
        let value = record(&mut recorder)?;
        let times = self.execute(submission, &recorder, label)?;
        Ok((value, times))
    }

    /// A recorder for the command buffer of a submission.
    fn begin(&self, submission: &Submission<'_>, label: &'static str) -> Result<Recorder<'_>> {
        let (device, timed) = (self.device(), self.timestamp_bits() > 0);
        let Objects { commands, queries, .. } = submission.objects();
        super::debug::name(self.debug_device(), commands, label);
        // SAFETY: objects of this device, which no other submission uses.
        unsafe {
            let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            device.begin_command_buffer(commands, &begin).map_err(failed("vkBeginCommandBuffer"))?;
            if timed {
                device.cmd_reset_query_pool(commands, queries, 0, TIMESTAMPS);
            }
            Ok(Recorder::new(self, commands, timed.then_some((queries, TIMESTAMPS))))
        }
    }

    /// Submits what was recorded, and waits until it has been executed.
    fn execute(&self, mut submission: Submission<'_>, recorder: &Recorder<'_>, label: &str) -> Result<StageTimes> {
        recorder.finish()?;
        let device = self.device();
        let Objects { commands, queries, .. } = submission.objects();
        // SAFETY: objects of this device, which no other submission uses.
        unsafe {
            // Makes the results visible to the host, and to the submissions that follow.
            let barrier = [vk::MemoryBarrier::default()
                .src_access_mask(vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE)
                .dst_access_mask(vk::AccessFlags::HOST_READ | vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE)];
            let source = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
            let target = vk::PipelineStageFlags::HOST | vk::PipelineStageFlags::ALL_COMMANDS;
            device.cmd_pipeline_barrier(commands, source, target, vk::DependencyFlags::empty(), &barrier, &[], &[]);
            device.end_command_buffer(commands).map_err(failed("vkEndCommandBuffer"))?;
        }
        submission.start()?;
        submission.wait().map_err(|e| named(e, label))?;
        self.read_timestamps(queries, recorder.timed_stages())
    }

    fn read_timestamps(&self, queries: vk::QueryPool, stages: &[(String, u32, u32)]) -> Result<StageTimes> {
        let used = stages.iter().map(|s| s.2 + 1).max().unwrap_or(0);
        let mut ticks = vec![0u64; used as usize];
        if used > 0 {
            // SAFETY: the queries below `used` were written by the submission, which has ended.
            let read = unsafe { self.device().get_query_pool_results(queries, 0, &mut ticks, vk::QueryResultFlags::TYPE_64) };
            read.map_err(failed("vkGetQueryPoolResults"))?;
        }
        let mask = if self.timestamp_bits() >= 64 { u64::MAX } else { (1 << self.timestamp_bits()) - 1 };
        let period = f64::from(self.limits().timestamp_period) * 1e-6;
        let mut times = StageTimes { submissions: 1, ..StageTimes::default() };
        for (name, begin, end) in stages {
            let span = ticks[*end as usize].wrapping_sub(ticks[*begin as usize]) & mask;
            times.add_stage(StageTime { name: name.clone(), milliseconds: span as f64 * period });
        }
        Ok(times)
    }

    /// A device-local buffer with this content.
    ///
    /// # Errors
    /// [`Error::Memory`], or a failed Vulkan call.
    pub fn upload<T: Pod>(&self, name: &str, data: &[T]) -> Result<Buffer> {
        let mut buffer = self.buffer(name, size_of_val(data) as u64)?;
        self.write(&mut buffer, 0, data)?;
        Ok(buffer)
    }

    /// Size of a staging buffer of this handle in bytes.
    fn staging_bytes(&self) -> u64 {
        self.ledger().map_or(STAGING, |ledger| (ledger.limit() / STAGING_SHARE).clamp(1 << 16, STAGING))
    }

    /// Writes data to a buffer, starting at byte `at`.
    pub(crate) fn write<T: Pod>(&self, buffer: &mut Buffer, at: u64, data: &[T]) -> Result<()> {
        self.write_bytes(buffer, at, bytemuck::cast_slice(data))
    }

    fn write_bytes(&self, buffer: &mut Buffer, at: u64, bytes: &[u8]) -> Result<()> {
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

    /// Reads back a part of a buffer.
    ///
    /// Writes by a command buffer of the host must be available to `HOST_READ`: mapped memory is read without a copy.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a part that does not lie in the buffer or is no whole number of items, a failed Vulkan
    /// call, or no memory for the transfer.
    pub fn download<T: Pod>(&self, buffer: &Buffer, part: BufferRef) -> Result<Vec<T>> {
        let item = size_of::<T>() as u64;
        self.check_part(buffer, part, item)?;
        let mut data = vec![T::zeroed(); (part.size / item) as usize];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut data);
        if let Some(mapped) = buffer.cached() {
            let at = part.offset as usize;
            bytes.copy_from_slice(&mapped[at..at + bytes.len()]);
        } else {
            self.download_ref(part, bytes)?;
        }
        Ok(data)
    }

    /// Checks that a part lies in a buffer of this device, and is a whole number of items of `item` bytes.
    fn check_part(&self, buffer: &Buffer, part: BufferRef, item: u64) -> Result<()> {
        // The range is checked as well: the part may be of an earlier buffer whose handle the driver gave out again.
        let within = part.offset.checked_add(part.size).is_some_and(|end| end <= buffer.size());
        if part.buffer != buffer.all().buffer || !within || !self.is_same_device(&buffer.gpu) {
            let text = format!("the part to be read does not lie in the buffer `{}`, or that is on another device", buffer.name());
            return Err(Error::Invalid(text));
        }
        if part.size.checked_rem(item) != Some(0) {
            let text = format!("{} bytes of the buffer `{}`, to be read as items of {item}", part.size, buffer.name());
            return Err(Error::Invalid(text));
        }
        Ok(())
    }

    /// Reads back the value at the beginning of a part of a buffer.
    ///
    /// # Errors
    /// As [`Gpu::download`], and [`Error::Invalid`] for a part that is smaller than the value.
    pub fn download_one<T: Pod>(&self, buffer: &Buffer, part: BufferRef) -> Result<T> {
        let bytes = size_of::<T>() as u64;
        let found = if part.size < bytes { Vec::new() } else { self.download::<T>(buffer, part.part(0, bytes))? };
        let too_small = || format!("{} bytes of the buffer `{}`, to be read as a value of {bytes}", part.size, buffer.name());
        found.first().copied().ok_or_else(|| Error::Invalid(too_small()))
    }

    /// Reads back a range of any buffer through staging memory.
    pub(crate) fn download_ref(&self, part: BufferRef, bytes: &mut [u8]) -> Result<()> {
        if bytes.len() as u64 <= READ_BACK {
            return self.read_back(part, bytes);
        }
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

/// Adds the submission's label to an error.
fn named(error: Error, label: &str) -> Error {
    match error {
        Error::Vulkan { call, result, hint } => Error::Vulkan { call, result, hint: format!(" in {label}{hint}") },
        other => other,
    }
}
