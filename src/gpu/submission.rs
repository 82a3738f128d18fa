//! A submission under way, and the read-back of small results.

use super::buffer_ref::{BufferRef, USAGE};
use super::context::Gpu;
use super::failed;
use super::heap::{Kind, Memory};
use super::kept::Objects;
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use std::time::Duration;

/// Bytes of the memory that is kept for reading back small results.
pub(super) const READ_BACK: u64 = 64 << 10;
const READ_BACK_KIND: Kind = Kind { usage: USAGE, location: MemoryLocation::GpuToCpu };

/// After how many failed waits, 10 ms apart, a warning is given.
const WARNED: u64 = 100;

/// A submission under way.
pub(super) struct Submission<'a> {
    gpu: &'a Gpu,
    objects: Objects,
    state: State,
}

/// How far a submission has come.
enum State {
    /// It is being recorded.
    Open,
    /// The device has it.
    Running,
    /// It has been executed, so that its objects can be used again.
    Done,
}

impl<'a> Submission<'a> {
    /// Takes the objects of an earlier submission, or makes new ones.
    pub(super) fn new(gpu: &'a Gpu) -> Result<Self> {
        let new = || Objects::new(gpu.device(), gpu.family(), gpu.timestamp_bits() > 0);
        let objects = gpu.kept().objects().map_or_else(new, Ok)?;
        Ok(Self { gpu, objects, state: State::Open })
    }

    /// Its Vulkan objects.
    pub(super) fn objects(&self) -> Objects {
        self.objects
    }

    /// Submits the commands, under the queue's lock.
    pub(super) fn start(&mut self) -> Result<()> {
        let Some(queue) = self.gpu.host_queue() else {
            return Err(Error::Invalid("the host lent no queue: only the cmd_* functions can be used".into()));
        };
        let (device, Objects { commands, fence, .. }) = (self.gpu.device(), self.objects);
        let (commands, mut result) = ([commands], None);
        let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
        queue.locked(&mut |queue| {
            // A second call, which would submit the commands again while they run, does nothing.
            result.get_or_insert_with(|| {
                // SAFETY: commands, fence and queue belong to this device; the implementor of `HostQueue` holds the lock.
                let submitted = unsafe { device.queue_submit(queue, &submit, fence) };
                self.state = if submitted.is_ok() { State::Running } else { State::Open };
                submitted
            });
        });
        result.unwrap_or(Err(vk::Result::ERROR_UNKNOWN)).map_err(failed("vkQueueSubmit"))
    }

    /// Waits until the commands have been executed, or the device is lost. When out of memory, a driver may stop waiting
    /// while the work still runs, and neither its objects nor the caller's buffers may be freed then: so this waits on.
    pub(super) fn wait(&mut self) -> Result<()> {
        for tried in 1u64.. {
            // SAFETY: the fence belongs to this device, and was submitted.
            match unsafe { self.gpu.device().wait_for_fences(&[self.objects.fence], true, u64::MAX) } {
                Ok(()) => {
                    self.state = State::Done;
                    break;
                }
                Err(vk::Result::ERROR_DEVICE_LOST) => {
                    self.state = State::Open;
                    return Err(failed("vkWaitForFences")(vk::Result::ERROR_DEVICE_LOST));
                }
                Err(other) if tried % WARNED == 0 => log::warn!("vkWaitForFences fails with {other:?}; waiting on, since the device works"),
                Err(_) => {}
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        Ok(())
    }
}

impl Drop for Submission<'_> {
    fn drop(&mut self) {
        if matches!(self.state, State::Running) {
            // The host's lock panicked once it had submitted.
            let _ = self.wait();
        }
        let (device, objects) = (self.gpu.device(), self.objects);
        if matches!(self.state, State::Done) {
            self.gpu.kept().keep_objects(device, objects);
        } else {
            objects.destroy(device);
        }
    }
}

impl Gpu {
    /// Reads back a small range through memory that is kept for this.
    pub(super) fn read_back(&self, part: BufferRef, bytes: &mut [u8]) -> Result<()> {
        let new = || Memory::new(self.heap(), "olbvh.read_back", READ_BACK_KIND, READ_BACK, |_| Ok(()));
        let memory = self.kept().read_back().map_or_else(new, Ok)?;
        let size = bytes.len() as u64;
        let to = BufferRef { buffer: memory.handle, offset: 0, size, address: memory.address };
        self.submit("olbvh.read_back", |r| {
            r.copy(part.part(0, size), to);
            Ok(())
        })?;
        let mapped = memory.mapped().ok_or_else(|| Error::Invalid("download memory is not mapped".into()))?;
        bytes.copy_from_slice(&mapped[..bytes.len()]);
        self.kept().keep_read_back(memory);
        Ok(())
    }
}
