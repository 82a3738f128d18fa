//! Appends work to a command buffer: dispatches, named barriers, fills, copies, timestamps. Submits nothing and waits
//! for nothing.
//!
//! The recorder knows from reflection which buffers each kernel reads and writes. While recording it checks that no
//! command reads or writes what an earlier one wrote, or writes what an earlier one read, without a barrier between
//! them. It sees its own commands only, not those of other recordings or of the host.

use super::buffer_ref::BufferRef;
use super::context::{Binding, Gpu};
use super::descriptors::{DescriptorPools, DescriptorRoom};
use super::kernel::{Arguments, Kernel, Specialization, push_constants, uses};
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

/// Folds a number of workgroups into two dimensions, as `glsl/shared/groups.glsl` does.
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
///
/// What holds for all `cmd_*` functions, unless one says otherwise: it reads its input in compute shaders, uses its
/// memory in compute shaders and transfers, writes its results in compute shaders, and records no barrier before or after
/// itself. So before anything reads the results or uses the memory again, record [`Recorder::barrier`], or a barrier of
/// your own. [`Recorder::finish`] names two commands of this recorder that lack one between them.
///
/// A function that returns an error may have recorded a part of its work: do not submit the command buffer then, but
/// reset it and start the recording again.
pub struct Recorder<'a> {
    gpu: &'a Gpu,
    pub(super) commands: vk::CommandBuffer,
    uses: Vec<Use>,
    /// The first thing wrong with what was recorded.
    fault: Option<String>,
    timestamps: Option<(vk::QueryPool, u32)>,
    /// Names of the timed stages so far, with the timestamp slots of start and end.
    stages: Vec<(String, u32, u32)>,
    next_slot: u32,
    /// Used where buffers are bound by descriptors.
    pools: Pools<'a>,
    room: DescriptorRoom,
    barriers: Vec<&'static str>,
    /// The barrier to leave out, for tests that its absence is detected.
    drop_barrier: Option<u32>,
}

/// So that the compiler refuses a recorder that outlives its [`Gpu`]: its own pools use the device when they are dropped.
impl Drop for Recorder<'_> {
    fn drop(&mut self) {}
}

impl<'a> Recorder<'a> {
    /// A recorder for a command buffer in the recording state. `timestamps` is a reset query pool and its size; without
    /// effect if the queue family has no timestamps.
    ///
    /// Recording binds a compute pipeline, sets push constants and, with descriptors, binds set 0 for compute; the host
    /// must bind its own again afterwards. Where the device binds buffers by descriptors, the recorder must be kept
    /// until the commands have been executed, since it owns their descriptor sets, unless it borrows pools (see
    /// [`Recorder::with_pools`]).
    ///
    /// # Safety
    /// - `commands` is in the recording state, outside a render pass, from a command pool of `gpu`'s queue family, and
    ///   belongs to `gpu`'s device.
    /// - `timestamps` is a pool of timestamp queries of this device, of at least that size. All are reset, and nothing
    ///   else uses them until the commands have been executed.
    /// - Until then, all buffers whose parts are recorded live. Where the device binds buffers by descriptors, the
    ///   recorder is kept as well, or else the pools lent to it, which are not reset before.
    /// - Buffers are as large as the recording functions require, and their contents are valid: hints and orders are
    ///   numbers of this mesh, and a tree is one over this mesh. Scratch memory was carved with the target of `gpu`.
    /// - A barrier lies between all that other recordings and the host's own commands do with a buffer, and what these
    ///   commands do with it. That includes a recording of the same frame, submitted before. The recorder sees its own
    ///   commands only, so [`Recorder::finish`] cannot name a barrier that is missing there.
    pub unsafe fn new(gpu: &'a Gpu, commands: vk::CommandBuffer, timestamps: Option<(vk::QueryPool, u32)>) -> Self {
        let timestamps = timestamps.filter(|_| gpu.timestamp_bits() > 0);
        let (pools, room) = (Pools::Own(DescriptorPools::new(gpu)), DescriptorRoom::default());
        let (uses, stages, barriers) = (Vec::new(), Vec::new(), Vec::new());
        Self { gpu, commands, uses, fault: None, timestamps, stages, next_slot: 0, pools, room, barriers, drop_barrier: None }
    }

    /// Takes descriptor sets from the caller's pools instead of the recorder's own. The pools must be kept until the
    /// commands have been executed; the recorder need not be.
    ///
    /// # Errors
    /// [`Error::Invalid`] for pools of another device, or if something was recorded before whose descriptor sets come
    /// from the recorder's own pools.
    pub fn with_pools(mut self, pools: &'a mut DescriptorPools) -> Result<Self> {
        if !pools.gpu().is_same_device(self.gpu) {
            return Err(Error::Invalid("descriptor pools of another device".into()));
        }
        if self.room != DescriptorRoom::default() {
            return Err(Error::Invalid("descriptor pools are lent after something was recorded; lend them first".into()));
        }
        self.pools = Pools::Lent(pools);
        Ok(self)
    }

    /// The descriptors that everything recorded so far takes, also in a rehearsal.
    pub fn descriptor_room(&self) -> DescriptorRoom {
        self.room
    }

    /// A recorder without a command buffer. Recording only compiles the pipelines that are needed, and checks for
    /// missing barriers. A host rehearses once what it will record in every frame, so that nothing is created then.
    /// Where the device binds buffers by descriptors, the host also reserves [`Recorder::descriptor_room`] in the pools
    /// that it provides.
    pub fn rehearse(gpu: &'a Gpu) -> Self {
        // SAFETY: with a null command buffer nothing is recorded, see `is_rehearsal`.
        unsafe { Self::new(gpu, vk::CommandBuffer::null(), None) }
    }

    pub(super) fn is_rehearsal(&self) -> bool {
        self.commands == vk::CommandBuffer::null()
    }

    /// The timed stages recorded so far: name, slot of the timestamp at the start, slot of the timestamp at the end.
    pub fn timed_stages(&self) -> &[(String, u32, u32)] {
        &self.stages
    }

    /// The command buffer, into which the host may record its own commands in between. It reports its own barriers with
    /// [`Recorder::host_barrier`]. Null in a rehearsal, in which nothing is recorded.
    pub fn commands(&self) -> vk::CommandBuffer {
        self.commands
    }

    /// The device.
    pub fn gpu(&self) -> &'a Gpu {
        self.gpu
    }

    /// From now on leaves out the n-th barrier, for tests.
    #[doc(hidden)]
    pub fn drop_barrier(&mut self, n: Option<u32>) {
        self.drop_barrier = n;
    }

    /// Labels of the barriers recorded so far, for tests.
    #[doc(hidden)]
    pub fn barriers(&self) -> &[&'static str] {
        &self.barriers
    }

    /// Records a dispatch of a kernel.
    pub(crate) fn dispatch<K: Kernel>(&mut self, arguments: &K, spec: K::Spec, groups: Groups) -> Result<()> {
        self.dispatch_with(arguments, spec.values(), groups)
    }

    /// The same with specialization constants as pairs (id, value): one function for all kernels.
    fn dispatch_with(&mut self, arguments: &dyn Arguments, constants: Vec<(u32, u32)>, groups: Groups) -> Result<()> {
        let info = arguments.info();
        let pipeline = self.gpu.pipeline(info, constants)?;
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
        // SAFETY: pipeline, layouts and sets belong to this device; the push constants fit the layout, which was made
        // from the same numbers; the caller of `new` guarantees a valid command buffer.
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
            if !push.is_empty() {
                device.cmd_push_constants(self.commands, pipeline.layout, vk::ShaderStageFlags::COMPUTE, 0, &push);
            }
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

    /// Makes what compute shaders and transfers wrote visible to the compute shaders, transfers and indirect commands that
    /// follow, and lets these wait for what such commands read. No other stage is covered: before a draw or the host
    /// reads results, and before memory that a draw reads is written again, record a barrier of your own, and report it
    /// with [`Recorder::host_barrier`]. `label` names the writer and the reader.
    pub fn barrier(&mut self, label: &'static str) {
        let stages = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
        let writes = vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE;
        let reads = vk::AccessFlags::SHADER_READ | vk::AccessFlags::TRANSFER_READ | vk::AccessFlags::INDIRECT_COMMAND_READ;
        self.barrier_between(label, (stages, writes), (stages | vk::PipelineStageFlags::DRAW_INDIRECT, writes | reads));
    }

    /// Notes that the host recorded such a barrier into [`Recorder::commands`] itself, or a stronger one: from writes
    /// (and reads) of compute shaders and transfers to all following commands. Records nothing.
    pub fn host_barrier(&mut self, label: &'static str) {
        self.pass_barrier(label);
    }

    /// Clears the uses noted before a barrier. Returns false if this barrier is to be left out.
    fn pass_barrier(&mut self, label: &'static str) -> bool {
        self.barriers.push(label);
        let passed = self.drop_barrier != Some(self.barriers.len() as u32 - 1);
        if passed {
            self.uses.clear();
        }
        passed
    }

    /// Records a barrier between these stages and accesses.
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
        // SAFETY: the caller of `new` guarantees a valid command buffer.
        unsafe {
            self.gpu.device().cmd_pipeline_barrier(self.commands, source, target, vk::DependencyFlags::empty(), &[barrier], &[], &[]);
        }
    }

    /// Notes that a command cannot be recorded, or that the commands would not do what they should.
    fn fault(&mut self, text: impl FnOnce() -> String) {
        self.fault.get_or_insert_with(text);
    }

    /// Fills a range with a word. An offset in the buffer or a size that is not a multiple of 4 bytes is an error of
    /// [`Recorder::finish`].
    pub fn fill(&mut self, range: BufferRef, word: u32) {
        if range.size == 0 {
            return;
        }
        if !range.offset.is_multiple_of(4) || !range.size.is_multiple_of(4) {
            let at = range.offset;
            return self.fault(|| format!("fill of {} bytes at byte {at} of a buffer; both must be multiples of 4", range.size));
        }
        self.touch(&[(range, true)], "fill");
        if self.is_rehearsal() {
            return;
        }
        // SAFETY: the range lies in its buffer, and consists of whole words.
        unsafe { self.gpu.device().cmd_fill_buffer(self.commands, range.buffer, range.offset, range.size, word) };
    }

    /// Copies the bytes of `from` to the start of `to`. It is an error of [`Recorder::finish`] if `to` is smaller, or
    /// if the bytes overlap those that they are copied to.
    pub fn copy(&mut self, from: BufferRef, to: BufferRef) {
        if from.size == 0 {
            return;
        }
        if to.size < from.size {
            return self.fault(|| format!("copy of {} bytes to a place of {}", from.size, to.size));
        }
        if from.buffer == to.buffer && from.offset.abs_diff(to.offset) < from.size {
            let [a, b] = [from.offset, to.offset];
            return self.fault(|| format!("copy of {} bytes from byte {a} of a buffer to byte {b}, which overlap", from.size));
        }
        self.touch(&[(from, false), (to.part(0, from.size), true)], "copy");
        if self.is_rehearsal() {
            return;
        }
        let region = [vk::BufferCopy { src_offset: from.offset, dst_offset: to.offset, size: from.size }];
        // SAFETY: both ranges lie in their buffers, and do not overlap.
        unsafe { self.gpu.device().cmd_copy_buffer(self.commands, from.buffer, to.buffer, &region) };
    }

    /// Records `work` as a named stage: labelled for debuggers, and timed while timestamp slots are left.
    pub fn stage<T>(&mut self, name: &str, work: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        if self.is_rehearsal() {
            return work(self);
        }
        let begin = self.begin_stage(name);
        let result = work(self);
        self.end_stage(name, begin);
        result
    }

    /// Records the start of a stage, and returns the slot of its timestamp. Both timestamps are at the bottom: a stage
    /// begins when all before it has ended, so that no time counts twice.
    fn begin_stage(&mut self, name: &str) -> Option<u32> {
        if let Some(debug) = self.gpu.debug_device() {
            let text = std::ffi::CString::new(format!("olbvh.{}", name.replace('\0', " "))).unwrap_or_default();
            // SAFETY: the label is ended by `end_stage`.
            unsafe { debug.cmd_begin_debug_utils_label(self.commands, &vk::DebugUtilsLabelEXT::default().label_name(&text)) };
        }
        self.timestamp()
    }

    fn end_stage(&mut self, name: &str, begin: Option<u32>) {
        if let (Some(begin), Some(end)) = (begin, self.timestamp()) {
            self.stages.push((name.to_string(), begin, end));
        }
        if let Some(debug) = self.gpu.debug_device() {
            // SAFETY: ends the label begun by `begin_stage`.
            unsafe { debug.cmd_end_debug_utils_label(self.commands) };
        }
    }

    /// Ends the recording and reports the result of its checks.
    ///
    /// # Errors
    /// [`Error::Invalid`] with two commands of this recorder that need a barrier between them, or with a fill or copy
    /// that cannot be recorded.
    pub fn finish(&self) -> Result<()> {
        self.fault.clone().map_or(Ok(()), |fault| Err(Error::Invalid(fault)))
    }

    fn timestamp(&mut self) -> Option<u32> {
        let (pool, size) = self.timestamps?;
        if self.next_slot >= size {
            return None;
        }
        let slot = self.next_slot;
        self.next_slot += 1;
        // SAFETY: the slot lies in the pool, which the caller has reset.
        unsafe { self.gpu.device().cmd_write_timestamp(self.commands, vk::PipelineStageFlags::BOTTOM_OF_PIPE, pool, slot) };
        Some(slot)
    }

    fn label(&self, label: &'static str) {
        if let Some(debug) = self.gpu.debug_device()
            && let Ok(text) = std::ffi::CString::new(label)
        {
            // SAFETY: a plain label in a recording command buffer.
            unsafe { debug.cmd_insert_debug_utils_label(self.commands, &vk::DebugUtilsLabelEXT::default().label_name(&text)) };
        }
    }

    /// Notes the ranges that one command uses, and checks them for conflicts with earlier commands.
    pub(super) fn touch(&mut self, ranges: &[(BufferRef, bool)], by: &'static str) {
        let before = self.uses.len();
        for &(range, writes) in ranges {
            let (buffer, begin, end) = (range.buffer, range.offset, range.offset + range.size);
            let clash = |u: &&Use| u.buffer == buffer && u.begin < end && begin < u.end && (u.writes || writes);
            if let (None, Some(earlier)) = (&self.fault, self.uses[..before].iter().find(clash)) {
                let verb = |w| if w { "writes" } else { "reads" };
                self.fault =
                    Some(format!("{by} {} what {} {} with no barrier between them", verb(writes), earlier.by, verb(earlier.writes)));
            }
            self.uses.push(Use { buffer, begin, end, writes, by });
        }
    }
}
