//! Recording into a host's command buffer and memory, across the border to C: nothing is submitted, waited for or made.
//! The head of the header says what all of it has in common, see `.config/cbindgen.toml`.

mod locate;
mod overlap;
mod render;
mod scene;
mod slice;

#[cfg(test)]
pub(super) use {locate::*, overlap::*, render::*, scene::*, slice::*};

use super::{OlbvhGpu, OlbvhStatus, border, give, handle, handle_mut, put, release};
use crate::error::{Error, Result};
use crate::gpu::{ALIGNMENT, BufferRef, DescriptorPools, Gpu, Recorder};
use crate::mesh::On;
use crate::primitives::Arena;
use crate::query::{Rounds, Scene};
use ash::vk::{self, Handle};
use std::ffi::c_char;

/// A part of a buffer of the host's.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhBuffer {
    /// `VkBuffer`.
    pub buffer: u64,
    /// Bytes from its start.
    pub offset: u64,
    /// Bytes.
    pub size: u64,
    /// Device address of the first byte of the part; 0 where buffer addresses are not enabled.
    pub address: u64,
}

impl OlbvhBuffer {
    fn part(&self) -> BufferRef {
        let Self { offset, size, address, .. } = *self;
        BufferRef { buffer: vk::Buffer::from_raw(self.buffer), offset, size, address }
    }

    /// The part, which must begin where parts of buffers may.
    fn aligned(&self, what: &str) -> Result<BufferRef> {
        if !self.offset.is_multiple_of(ALIGNMENT) {
            return Err(Error::Invalid(format!(
                "{what} at byte {} of their buffer; they must begin at a multiple of {ALIGNMENT}",
                self.offset
            )));
        }
        Ok(self.part())
    }

    /// The part, which must have so many bytes.
    fn holds(&self, bytes: u64, what: &str) -> Result<BufferRef> {
        if self.size < bytes {
            return Err(Error::Invalid(format!("{what} in {} bytes; {bytes} are needed", self.size)));
        }
        Ok(self.part())
    }

    /// The same; `None` of no bytes.
    fn optional(&self, bytes: u64, what: &str) -> Result<Option<BufferRef>> {
        if self.size == 0 { Ok(None) } else { self.holds(bytes, what).map(Some) }
    }

    /// The parts of this memory.
    fn place<T>(self, carve: impl Fn(&mut Arena) -> Result<T>) -> Result<T> {
        carve(&mut Arena::new(self.part()))
    }

    /// The parts of this memory, and how many bytes they take. Of memory that is not there yet offsets count from its beginning.
    fn carve<T>(self, carve: impl Fn(&mut Arena) -> Result<T>) -> Result<(u64, T)> {
        let bytes = Arena::measure(&carve)?;
        let given = if self.size == 0 { Self { size: bytes, ..self } } else { self };
        Ok((bytes, given.place(carve)?))
    }
}

impl From<BufferRef> for OlbvhBuffer {
    fn from(part: BufferRef) -> Self {
        let BufferRef { buffer, offset, size, address } = part;
        Self { buffer: buffer.as_raw(), offset, size, address }
    }
}

/// Values on a mesh.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhField {
    /// A 32-bit float per point, or per tetrahedron.
    pub values: OlbvhBuffer,
    /// 0: per point, linear in a tetrahedron. Else: per tetrahedron.
    pub on_cells: u32,
}

impl OlbvhField {
    fn read(&self, scene: &Scene) -> Result<(BufferRef, On)> {
        let (on, count) = super::on(self.on_cells, &scene.mesh.input);
        Ok((self.values.holds(4 * u64::from(count), "a field")?, on))
    }
}

/// How far a recording goes with work that takes as many dispatches as it takes: a dispatch looks at so much and no more, so that no device is kept
/// busy for long. The status of the query says what is left.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhRounds {
    /// Dispatches, one after the other; what is finished is passed over.
    pub count: u32,
    /// Not 0: go on where an earlier recording of the same ended.
    pub resume: u32,
}

impl From<OlbvhRounds> for Rounds {
    fn from(rounds: OlbvhRounds) -> Self {
        Self { count: rounds.count, resume: rounds.resume != 0 }
    }
}

/// Commands being recorded, and the descriptor sets they use: one per frame in flight.
pub struct OlbvhRecording {
    /// Refers to the two below, which it is dropped before.
    recorder: Option<Recorder<'static>>,
    gpu: *mut Gpu,
    pools: *mut DescriptorPools,
    /// Of the recording that has ended.
    stages: Vec<(String, u32, u32)>,
}

/// A stage that was timed.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhStage {
    /// Such as "build.levels".
    pub name: [c_char; 64],
    /// Query with the time of its begin.
    pub begin: u32,
    /// Query with the time of its end.
    pub end: u32,
}

impl Drop for OlbvhRecording {
    fn drop(&mut self) {
        self.recorder = None;
        // SAFETY: both came from boxes, and the recorder that referred to them is gone.
        drop(unsafe { (Box::from_raw(self.pools), Box::from_raw(self.gpu)) });
    }
}

/// Makes what commands are recorded with: one per frame in flight, used by one thread at a time.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_new(gpu: *const OlbvhGpu, out: *mut *mut OlbvhRecording) -> OlbvhStatus {
    border(|| {
        let gpu = handle(gpu, "gpu")?.0.clone();
        let pools = Box::into_raw(Box::new(DescriptorPools::new(&gpu)));
        give(out, OlbvhRecording { recorder: None, gpu: Box::into_raw(Box::new(gpu)), pools, stages: Vec::new() })
    })
}

/// Lets a recording go, when its commands have been executed; null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_free(recording: *mut OlbvhRecording) {
    release(recording);
}

/// Begins anew. `commands` is a `VkCommandBuffer` in the recording state, outside of a render pass; what was recorded before has been executed. 0
/// rehearses: commands compile what they need, and the end makes room for the descriptor sets they would take, so that recording the same later makes
/// nothing. `queries` is a reset `VkQueryPool` for timestamps of that many queries, or 0; stages are timed as long as there are queries left.
/// The recording binds a compute pipeline, push constants, and set 0 where the device has no buffer addresses.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_begin(recording: *mut OlbvhRecording, commands: u64, queries: u64, query_count: u32) -> OlbvhStatus {
    border(|| {
        let recording = handle_mut(recording, "recording")?;
        recording.recorder = None;
        // SAFETY: both live until the recorder is gone, see `drop`, and nobody else refers to the pools; the host vouches for the commands.
        unsafe {
            (*recording.pools).reset()?;
            let queries = (queries != 0).then(|| (vk::QueryPool::from_raw(queries), query_count));
            let recorder = Recorder::new(&*recording.gpu, vk::CommandBuffer::from_raw(commands), queries);
            recording.recorder = Some(recorder.with_pools(&mut *recording.pools));
        }
        Ok(())
    })
}

/// Ends the recording, the command buffer stays open. Fails where a barrier is missing between two commands, and names them.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_end(recording: *mut OlbvhRecording) -> OlbvhStatus {
    border(|| {
        let recording = handle_mut(recording, "recording")?;
        let mut recorder = recording.recorder.take().ok_or_else(not_begun)?;
        let (rehearsed, room, ended) = (recorder.commands() == vk::CommandBuffer::null(), recorder.descriptor_room(), recorder.finish());
        recording.stages = std::mem::take(&mut recorder.stages);
        drop(recorder);
        if rehearsed {
            // SAFETY: no recorder refers to the pools.
            unsafe { &mut *recording.pools }.reserve(room)?;
        }
        ended
    })
}

/// Tells which queries of a recording that has ended have the times of its `index`th stage; fails behind the last.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_stage(recording: *const OlbvhRecording, index: u32, out: *mut OlbvhStage) -> OlbvhStatus {
    border(|| {
        let stages = &handle(recording, "recording")?.stages;
        let stage = stages.get(index as usize).ok_or_else(|| Error::Invalid(format!("stage {index} of {}", stages.len())))?;
        let mut name = [0; 64];
        name.iter_mut().zip(stage.0.bytes().take(63)).for_each(|(c, b)| *c = b as c_char);
        put(out, OlbvhStage { name, begin: stage.1, end: stage.2 })
    })
}

/// Records a barrier: what was written so far is visible to the compute shaders, transfers and indirect commands that follow.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_cmd_barrier(recording: *mut OlbvhRecording) -> OlbvhStatus {
    recorded(recording, |r| {
        r.barrier("host → host");
        Ok(())
    })
}

/// Says that the host recorded a barrier of its own instead of `olbvh_cmd_barrier`, which does as much or more: the end misses none there. Records nothing.
#[unsafe(no_mangle)]
pub extern "C" fn olbvh_recording_host_barrier(recording: *mut OlbvhRecording) -> OlbvhStatus {
    recorded(recording, |r| {
        r.host_barrier("host → host");
        Ok(())
    })
}

fn not_begun() -> Error {
    Error::Invalid("the recording has not begun".into())
}

/// Appends to a recording that has begun.
fn recorded(recording: *mut OlbvhRecording, work: impl FnOnce(&mut Recorder<'static>) -> Result<()>) -> OlbvhStatus {
    border(|| work(handle_mut(recording, "recording")?.recorder.as_mut().ok_or_else(not_begun)?))
}
