//! Appends work to a command buffer: dispatches, named barriers, fills, copies, timestamps. Submits nothing, waits for nothing.
//!
//! The recorder knows from reflection which buffers each kernel reads and writes. It checks, as the work is recorded, that no dispatch
//! meets an earlier one's writes (or writes what an earlier one reads) without a barrier between them.

use super::buffer_ref::BufferRef;
use super::context::{Binding, Gpu};
use super::descriptors::{DescriptorPools, DescriptorRoom};
use super::kernel::{Kernel, push_constants, uses};
use crate::error::{Error, Result};
use ash::vk;

/// Most workgroups along one axis of a dispatch.
const MAX_GROUPS: u32 = 65_535;

/// Workgroups of a dispatch.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Groups {
    /// Known to the host.
    Count(u32),
    /// Three words in device memory.
    Indirect(BufferRef),
}

/// Folds a number of workgroups into two dimensions, as `glsl/primitives/dispatch_args.comp` does.
pub(crate) fn fold_groups(groups: u32) -> [u32; 3] {
    if groups > MAX_GROUPS { [32_768, groups.div_ceil(32_768), 1] } else { [groups, 1, 1] }
}

/// One use of a range of a buffer since the last barrier.
struct Use {
    buffer: vk::Buffer,
    begin: u64,
    end: u64,
    writes: bool,
    by: &'static str,
}

/// Where descriptor sets come from.
enum Pools<'a> {
    Own(DescriptorPools),
    Lent(&'a mut DescriptorPools),
}

/// Records into one command buffer.
pub struct Recorder<'a> {
    gpu: &'a Gpu,
    pub(super) commands: vk::CommandBuffer,
    uses: Vec<Use>,
    hazard: Option<String>,
    timestamps: Option<(vk::QueryPool, u32)>,
    /// Names and begin/end slots of the timed stages so far.
    pub(crate) stages: Vec<(String, u32, u32)>,
    next_slot: u32,
    /// Used where buffers go by descriptor.
    pools: Pools<'a>,
    room: DescriptorRoom,
    barriers: Vec<&'static str>,
    /// Leave out the n-th barrier, to see that its absence is noticed.
    drop_barrier: Option<u32>,
}

impl<'a> Recorder<'a> {
    /// A recorder for a command buffer in the recording state. `timestamps`: a reset query pool and its size.
    ///
    /// Recording binds a compute pipeline, compute push constants, and with descriptors set 0 for compute; a host binds its own again after it.
    /// Where the device binds by descriptors, the recorder must be kept until the commands have been executed, since it owns their sets, unless it is lent
    /// pools (see [`Recorder::with_pools`]).
    ///
    /// # Safety
    /// `commands` is in the recording state, outside a render pass, of a family with compute, and belongs to `gpu`'s device. Until it has been executed live all
    /// buffers whose parts are recorded; these are as large as the functions that take them say, and hold what they say: hints and orders that are
    /// numbers of this mesh, a tree over this mesh.
    pub unsafe fn new(gpu: &'a Gpu, commands: vk::CommandBuffer, timestamps: Option<(vk::QueryPool, u32)>) -> Self {
        let (pools, room) = (Pools::Own(DescriptorPools::new(gpu)), DescriptorRoom::default());
        let (uses, stages, barriers) = (Vec::new(), Vec::new(), Vec::new());
        Self { gpu, commands, uses, hazard: None, timestamps, stages, next_slot: 0, pools, room, barriers, drop_barrier: None }
    }

    /// Takes descriptor sets from pools of the caller's instead of its own. They are kept until the commands have been executed; the recorder need not be.
    #[must_use]
    pub fn with_pools(mut self, pools: &'a mut DescriptorPools) -> Self {
        self.pools = Pools::Lent(pools);
        self
    }

    /// The room in descriptor pools that what was recorded takes, rehearsed or not.
    pub fn descriptor_room(&self) -> DescriptorRoom {
        self.room
    }

    /// A recorder without a command buffer: what is recorded compiles the pipelines it needs and is checked for missing barriers, and that is
    /// all. A host rehearses once what it will record every frame, so that nothing is created then; where the device binds by descriptors it also
    /// reserves [`Recorder::descriptor_room`] in pools that it lends.
    pub fn rehearse(gpu: &'a Gpu) -> Self {
        // SAFETY: nothing is recorded into a null command buffer, see `is_rehearsal`.
        unsafe { Self::new(gpu, vk::CommandBuffer::null(), None) }
    }

    pub(super) fn is_rehearsal(&self) -> bool {
        self.commands == vk::CommandBuffer::null()
    }

    /// The stages recorded so far that were timed: name, slot of the timestamp at the begin, slot of that at the end.
    pub fn timed_stages(&self) -> &[(String, u32, u32)] {
        &self.stages
    }

    /// The command buffer, for commands of the host's own between ours. Of its barriers it tells by [`Recorder::host_barrier`].
    pub fn commands(&self) -> vk::CommandBuffer {
        self.commands
    }

    /// The device.
    pub fn gpu(&self) -> &'a Gpu {
        self.gpu
    }

    /// Leaves out the n-th barrier from now on, for tests.
    #[doc(hidden)]
    pub fn drop_barrier(&mut self, n: Option<u32>) {
        self.drop_barrier = n;
    }

    /// Labels of the barriers recorded, for tests.
    #[doc(hidden)]
    pub fn barriers(&self) -> &[&'static str] {
        &self.barriers
    }

    /// Runs a kernel.
    pub(crate) fn dispatch<K: Kernel>(&mut self, arguments: &K, spec: K::Spec, groups: Groups) -> Result<()> {
        let info = K::INFO;
        let pipeline = self.gpu.pipeline::<K>(spec)?;
        let buffers = arguments.buffers();
        if let Groups::Count(0) = groups {
            return Ok(());
        }
        let mut uses = uses(arguments);
        if let Groups::Indirect(words) = groups {
            uses.push((words, false));
        }
        self.touch(&uses, info.name);
        if self.gpu.binding() == Binding::Descriptors && !buffers.is_empty() {
            self.room.sets += 1;
            self.room.buffers += buffers.len() as u32;
        }
        if self.is_rehearsal() {
            return Ok(());
        }
        let device = self.gpu.device();
        let push = push_constants(arguments, self.gpu.binding())?;
        // SAFETY: pipeline, layouts and sets belong to this device; push constants fit the layout made from the same numbers; the
        // caller of `new` vouches for the command buffer.
        unsafe {
            device.cmd_bind_pipeline(self.commands, vk::PipelineBindPoint::COMPUTE, pipeline.handle);
            if self.gpu.binding() == Binding::Descriptors && !buffers.is_empty() {
                let pools = match &mut self.pools {
                    Pools::Own(pools) => pools,
                    Pools::Lent(pools) => pools,
                };
                let set = pools.set(pipeline.set_layout, &buffers, info.name)?;
                device.cmd_bind_descriptor_sets(self.commands, vk::PipelineBindPoint::COMPUTE, pipeline.layout, 0, &[set], &[]);
            }
            device.cmd_push_constants(self.commands, pipeline.layout, vk::ShaderStageFlags::COMPUTE, 0, &push);
            match groups {
                Groups::Count(n) => {
                    let [x, y, z] = fold_groups(n);
                    device.cmd_dispatch(self.commands, x, y, z);
                }
                Groups::Indirect(words) => device.cmd_dispatch_indirect(self.commands, words.buffer, words.offset),
            }
        }
        Ok(())
    }

    /// Makes everything written so far visible to everything after; `label` says by whom and for whom.
    pub fn barrier(&mut self, label: &'static str) {
        let stages = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
        let writes = vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE;
        let reads = vk::AccessFlags::SHADER_READ | vk::AccessFlags::TRANSFER_READ | vk::AccessFlags::INDIRECT_COMMAND_READ;
        self.barrier_between(label, (stages, writes), (stages | vk::PipelineStageFlags::DRAW_INDIRECT, writes | reads));
    }

    /// Says that the host recorded such a barrier into [`Recorder::commands`] itself, or one that does more: from writes (and reads) of compute shaders
    /// and transfers to whatever comes next. Records nothing.
    pub fn host_barrier(&mut self, label: &'static str) {
        self.pass_barrier(label);
    }

    /// What was used before a barrier can be used again; false if this one is to be left out.
    fn pass_barrier(&mut self, label: &'static str) -> bool {
        self.barriers.push(label);
        let passed = self.drop_barrier != Some(self.barriers.len() as u32 - 1);
        if passed {
            self.uses.clear();
        }
        passed
    }

    /// A barrier between these stages and accesses.
    pub(super) fn barrier_between(
        &mut self,
        label: &'static str,
        (source, written): (vk::PipelineStageFlags, vk::AccessFlags),
        (target, used): (vk::PipelineStageFlags, vk::AccessFlags),
    ) {
        if !self.pass_barrier(label) || self.is_rehearsal() {
            return;
        }
        let barrier = vk::MemoryBarrier::default().src_access_mask(written).dst_access_mask(used);
        self.label(label);
        // SAFETY: the caller of `new` vouches for the command buffer.
        unsafe {
            self.gpu.device().cmd_pipeline_barrier(self.commands, source, target, vk::DependencyFlags::empty(), &[barrier], &[], &[]);
        }
    }

    /// Fills a range (a multiple of 4 bytes) with a word.
    pub fn fill(&mut self, range: BufferRef, word: u32) {
        if range.size == 0 {
            return;
        }
        self.touch(&[(range, true)], "fill");
        if self.is_rehearsal() {
            return;
        }
        // SAFETY: ranges are aligned to 4 bytes by construction.
        unsafe { self.gpu.device().cmd_fill_buffer(self.commands, range.buffer, range.offset, range.size.next_multiple_of(4), word) };
    }

    /// Copies the bytes of `from` to the beginning of `to`.
    pub fn copy(&mut self, from: BufferRef, to: BufferRef) {
        if from.size == 0 {
            return;
        }
        self.touch(&[(from, false), (to.part(0, from.size), true)], "copy");
        if self.is_rehearsal() {
            return;
        }
        let region = [vk::BufferCopy { src_offset: from.offset, dst_offset: to.offset, size: from.size }];
        // SAFETY: both ranges lie in their buffers.
        unsafe { self.gpu.device().cmd_copy_buffer(self.commands, from.buffer, to.buffer, &region) };
    }

    /// Records `work` as a stage of that name: labelled, and timed where there is room for its timestamps.
    pub fn stage<T>(&mut self, name: &str, work: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        if self.is_rehearsal() {
            return work(self);
        }
        if let (Some(debug), Ok(text)) = (self.gpu.debug_device(), std::ffi::CString::new(format!("olbvh.{name}"))) {
            // SAFETY: labels are balanced by the end below.
            unsafe { debug.cmd_begin_debug_utils_label(self.commands, &vk::DebugUtilsLabelEXT::default().label_name(&text)) };
        }
        let begin = self.timestamp(vk::PipelineStageFlags::TOP_OF_PIPE);
        let result = work(self);
        let end = self.timestamp(vk::PipelineStageFlags::BOTTOM_OF_PIPE);
        if let (Some(begin), Some(end)) = (begin, end) {
            self.stages.push((name.to_string(), begin, end));
        }
        if let Some(debug) = self.gpu.debug_device() {
            // SAFETY: balances the begin above.
            unsafe { debug.cmd_end_debug_utils_label(self.commands) };
        }
        result
    }

    /// Ends the recording's checks.
    ///
    /// # Errors
    /// [`Error::Invalid`] names two dispatches that need a barrier between them.
    pub fn finish(&mut self) -> Result<()> {
        self.hazard.take().map_or(Ok(()), |h| Err(Error::Invalid(h)))
    }

    fn timestamp(&mut self, stage: vk::PipelineStageFlags) -> Option<u32> {
        let (pool, size) = self.timestamps?;
        if self.next_slot >= size {
            return None;
        }
        let slot = self.next_slot;
        self.next_slot += 1;
        // SAFETY: the slot lies in the pool, which the caller has reset.
        unsafe { self.gpu.device().cmd_write_timestamp(self.commands, stage, pool, slot) };
        Some(slot)
    }

    fn label(&self, label: &'static str) {
        if let (Some(debug), Ok(text)) = (self.gpu.debug_device(), std::ffi::CString::new(label)) {
            // SAFETY: a plain label in a recording command buffer.
            unsafe { debug.cmd_insert_debug_utils_label(self.commands, &vk::DebugUtilsLabelEXT::default().label_name(&text)) };
        }
    }

    /// Notes the uses of one command and looks for earlier ones that they must not overlap.
    pub(super) fn touch(&mut self, ranges: &[(BufferRef, bool)], by: &'static str) {
        let before = self.uses.len();
        for &(range, writes) in ranges {
            let (buffer, begin, end) = (range.buffer, range.offset, range.offset + range.size);
            let clash = |u: &&Use| u.buffer == buffer && u.begin < end && begin < u.end && (u.writes || writes);
            if let (None, Some(earlier)) = (&self.hazard, self.uses[..before].iter().find(clash)) {
                let verb = |w| if w { "writes" } else { "reads" };
                self.hazard =
                    Some(format!("{by} {} what {} {} with no barrier between them", verb(writes), earlier.by, verb(earlier.writes)));
            }
            self.uses.push(Use { buffer, begin, end, writes, by });
        }
    }
}
