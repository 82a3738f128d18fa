//! The C interface for recording into the host's command buffer and memory: nothing is submitted, waited for or
//! allocated. What all recording functions have in common is stated at the head of the header, see
//! `.config/cbindgen.toml`.

mod locate;
mod overlap;
mod render;
mod scene;
mod slice;

#[cfg(test)]
pub(super) use {locate::*, overlap::*, render::*, scene::*, slice::*};

use super::{OlbvhGpu, OlbvhStatus, border, give, handle, handle_mut, place, release};
use crate::error::{Error, Result};
use crate::gpu::{ALIGNMENT, Arena, BufferRef, DescriptorPools, DescriptorRoom, Gpu, Recorder};
use crate::mesh::On;
use crate::query::Rounds;
use ash::vk::{self, Handle};
use std::ffi::c_char;

/// A part of one of the host's buffers.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhBuffer {
    /// `VkBuffer`.
    pub buffer: u64,
    /// Offset of the part from the start of the buffer, in bytes.
    pub offset: u64,
    /// Size of the part in bytes.
    pub size: u64,
    /// Device address of the first byte of the part; 0 where buffer addresses are not enabled.
    pub address: u64,
}

impl OlbvhBuffer {
    fn part(&self) -> BufferRef {
        let Self { offset, size, address, .. } = *self;
        BufferRef { buffer: vk::Buffer::from_raw(self.buffer), offset, size, address }
    }

    /// The part, whose offset must be a multiple of the alignment.
    fn aligned(&self, what: &str) -> Result<BufferRef> {
        if !self.offset.is_multiple_of(ALIGNMENT) {
            return Err(Error::Invalid(format!(
                "{what} at byte {} of their buffer; they must begin at a multiple of {ALIGNMENT}",
                self.offset
            )));
        }
        Ok(self.part())
    }

    /// The part, or `None` if its size is 0.
    fn given(&self) -> Option<BufferRef> {
        (self.size > 0).then(|| self.part())
    }

    /// Carves the parts out of this memory.
    fn place<T>(self, carve: impl Fn(&mut Arena) -> Result<T>) -> Result<T> {
        carve(&mut Arena::new(self.part()))
    }

    /// The number of bytes that the parts take, and the parts. If the memory does not exist yet (size 0), offsets count
    /// from its start.
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

/// A scalar field on a mesh.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct OlbvhField {
    /// One 32-bit float per point or per tetrahedron.
    pub values: OlbvhBuffer,
    /// 0: one value per point, interpolated linearly in a tetrahedron. Otherwise: one value per tetrahedron.
    pub on_cells: u32,
}

impl OlbvhField {
    fn read(&self) -> (BufferRef, On) {
        (self.values.part(), super::on(self.on_cells))
    }
}

/// How many dispatches are recorded for work whose length is not known in advance. Each dispatch does a bounded amount
/// of work, so that the device is never kept busy for long. The status of the query says how much is left.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhRounds {
    /// Number of dispatches, one after the other; they skip what is finished. At least one, unless they continue work or
    /// draw a picture.
    pub count: u32,
    /// Not 0: continue where an earlier recording of the same query ended.
    pub resume: u32,
}

impl From<OlbvhRounds> for Rounds {
    fn from(rounds: OlbvhRounds) -> Self {
        Self { count: rounds.count, resume: rounds.resume != 0 }
    }
}

/// A recording of commands and the descriptor sets that they use: one per frame in flight.
pub struct OlbvhRecording {
    /// Refers to `gpu` and `pools`, and is dropped before them.
    recorder: Option<Recorder<'static>>,
    gpu: *mut Gpu,
    pools: *mut DescriptorPools,
    /// Room of the largest of the pools reserved by rehearsals, which is the first.
    reserved: DescriptorRoom,
    /// Timed stages of the recording that has ended: name, first and last query.
    stages: Vec<(String, u32, u32)>,
}

/// A timed stage of a recording.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct OlbvhStage {
    /// Name of the stage, for example "build.levels"; ends with a zero byte.
    pub name: [c_char; 64],
    /// Index of the query with the time of its start.
    pub begin: u32,
    /// Index of the query with the time of its end.
    pub end: u32,
}

impl Drop for OlbvhRecording {
    fn drop(&mut self) {
        self.recorder = None;
        // SAFETY: both pointers came from `Box::into_raw`, and the recorder that referred to them is gone.
        drop(unsafe { (Box::from_raw(self.pools), Box::from_raw(self.gpu)) });
    }
}

// Several threads may use one of these handles at the same time, and any thread may free it. A recording, which owns what
// its pointers refer to, passes from thread to thread.
const _: () = {
    const fn shared<T: Send + Sync>() {}
    const fn passed<T: Send>() {}
    let _ = (shared::<OlbvhGpu>, shared::<super::OlbvhMesh>, shared::<super::OlbvhTree>, shared::<scene::OlbvhScene>);
    let _ = (passed::<Gpu>, passed::<DescriptorPools>, passed::<Recorder<'static>>);
};

/// Makes a recording: one per frame in flight, used by one thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_recording_new(gpu: *const OlbvhGpu, out: *mut *mut OlbvhRecording) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (gpu, out) = unsafe { (handle(gpu, "gpu")?.0.clone(), place(out)?) };
        let pools = Box::into_raw(Box::new(DescriptorPools::new(&gpu)));
        let (gpu, reserved) = (Box::into_raw(Box::new(gpu)), DescriptorRoom::default());
        give(out, OlbvhRecording { recorder: None, gpu, pools, reserved, stages: Vec::new() });
        Ok(())
    })
}

/// Frees a recording after its commands have been executed; null is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_recording_free(recording: *mut OlbvhRecording) {
    // SAFETY: the caller keeps the rules of `capi`.
    unsafe { release(recording, "recording") };
}

/// Starts a recording and forgets the previous one, whose commands must have been executed. `commands` is a
/// `VkCommandBuffer` in the recording state, outside of a render pass. If it is 0, the recording is a rehearsal:
/// commands compile the pipelines that they need, and the end reserves room for their descriptor sets, so that
/// recording the same commands later creates nothing. `queries` is a reset `VkQueryPool` of `query_count` timestamp
/// queries, or 0; stages are timed as long as queries are left, and not at all if the queue family has no timestamps
/// (`timestampValidBits` 0). The recording binds a compute pipeline, push constants, and descriptor set 0 where the
/// device has no buffer addresses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_recording_begin(
    recording: *mut OlbvhRecording,
    commands: u64,
    queries: u64,
    query_count: u32,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let recording = unsafe { handle_mut(recording, "recording")? };
        recording.recorder = None;
        // SAFETY: both pointers stay valid until the recorder is dropped, see `drop`, and nothing else refers to the
        // pools; the host vouches for the command buffer and the queries.
        unsafe {
            (*recording.pools).reset()?;
            let queries = (queries != 0).then(|| (vk::QueryPool::from_raw(queries), query_count));
            let recorder = Recorder::new(&*recording.gpu, vk::CommandBuffer::from_raw(commands), queries);
            recording.recorder = Some(recorder.with_pools(&mut *recording.pools)?);
        }
        Ok(())
    })
}

/// Ends the recording; the command buffer stays in the recording state. Returns an error that names both commands if a
/// barrier is missing between two of them.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_recording_end(recording: *mut OlbvhRecording) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let recording = unsafe { handle_mut(recording, "recording")? };
        let recorder = recording.recorder.take().ok_or_else(not_begun)?;
        let (rehearsed, room, ended) = (recorder.commands() == vk::CommandBuffer::null(), recorder.descriptor_room(), recorder.finish());
        recording.stages = recorder.timed_stages().to_vec();
        drop(recorder);
        let had = recording.reserved;
        let needed = DescriptorRoom { sets: room.sets.max(had.sets), buffers: room.buffers.max(had.buffers) };
        if rehearsed && needed != had {
            // SAFETY: the recorder, which alone referred to the pools, has been dropped.
            unsafe { &mut *recording.pools }.reserve(needed)?;
            recording.reserved = needed;
        }
        ended
    })
}

/// Reports which queries hold the times of stage `index` (from 0) of a recording that has ended; returns an error if
/// there is no such stage.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_recording_stage(recording: *const OlbvhRecording, index: u32, out: *mut OlbvhStage) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (stages, out) = unsafe { (&handle(recording, "recording")?.stages, place(out)?) };
        let stage = stages.get(index as usize).ok_or_else(|| Error::Invalid(format!("stage {index} of {}", stages.len())))?;
        let mut name = [0; 64];
        name.iter_mut().zip(stage.0.bytes().take(63)).for_each(|(c, b)| *c = b as c_char);
        out.write(OlbvhStage { name, begin: stage.1, end: stage.2 });
        Ok(())
    })
}

/// Records a barrier: what was written so far becomes visible to the compute shaders, transfers and indirect commands
/// that follow.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_cmd_barrier(recording: *mut OlbvhRecording) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        unsafe { begun(recording)? }.barrier("host → host");
        Ok(())
    })
}

/// States that the host itself recorded a barrier at this place, equivalent to `olbvh_cmd_barrier` or stronger, so that
/// `olbvh_recording_end` does not report one missing. Records nothing.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_recording_host_barrier(recording: *mut OlbvhRecording) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        unsafe { begun(recording)? }.host_barrier("host → host");
        Ok(())
    })
}

fn not_begun() -> Error {
    Error::Invalid("the recording has not begun".into())
}

/// The recorder of a recording that has begun.
///
/// # Safety
/// See [`crate::capi`].
unsafe fn begun<'a>(recording: *mut OlbvhRecording) -> Result<&'a mut Recorder<'static>> {
    // SAFETY: the caller keeps the rules of `capi`.
    unsafe { handle_mut(recording, "recording")? }.recorder.as_mut().ok_or_else(not_begun)
}
