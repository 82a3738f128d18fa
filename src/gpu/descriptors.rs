//! Descriptor sets for recordings, where kernels receive their buffers by descriptors.

use super::buffer_ref::BufferRef;
use super::context::Gpu;
use super::failed;
use crate::error::{Error, Result};
use ash::vk;

/// The descriptors that a recording takes; zero where buffers are passed by address.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DescriptorRoom {
    /// Descriptor sets.
    pub sets: u32,
    /// Storage buffers in them.
    pub buffers: u32,
}

/// Size of a pool that is made when the others are full.
const MORE: DescriptorRoom = DescriptorRoom { sets: 256, buffers: 2048 };

/// Descriptor pools that recordings take their sets from. A host keeps them from frame to frame (one `DescriptorPools`
/// per frame in flight), so that recording creates nothing: [`DescriptorPools::reserve`] what a rehearsal counted, pass
/// them to each [`super::Recorder`], and reset them once its commands have been executed.
#[derive(Debug)]
pub struct DescriptorPools {
    gpu: Gpu,
    pools: Vec<vk::DescriptorPool>,
    /// The pool that sets are taken from; those before it are full.
    current: usize,
}

impl DescriptorPools {
    /// Starts without pools. They are made when sets are taken, and kept.
    pub fn new(gpu: &Gpu) -> Self {
        Self { gpu: gpu.clone(), pools: Vec::new(), current: 0 }
    }

    /// The device they belong to.
    pub(super) fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Makes a pool large enough for a recording that counted this room (see [`super::Recorder::descriptor_room`]).
    ///
    /// # Errors
    /// [`Error::Vulkan`] if there is no memory for a pool.
    pub fn reserve(&mut self, room: DescriptorRoom) -> Result<()> {
        if room.sets == 0 {
            return Ok(());
        }
        let sizes = [vk::DescriptorPoolSize { ty: vk::DescriptorType::STORAGE_BUFFER, descriptor_count: room.buffers.max(1) }];
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(room.sets).pool_sizes(&sizes);
        // SAFETY: plain creation; `drop` destroys it.
        let pool = unsafe { self.gpu.device().create_descriptor_pool(&info, None) };
        // Inserted at the current place, so that it is used next even if there are others.
        self.pools.insert(self.current, pool.map_err(failed("vkCreateDescriptorPool"))?);
        Ok(())
    }

    /// Resets all pools, for the next recording.
    ///
    /// # Errors
    /// [`Error::Vulkan`] if the call fails.
    ///
    /// # Safety
    /// Commands recorded with these pools have been executed, or never will be.
    pub unsafe fn reset(&mut self) -> Result<()> {
        for pool in &self.pools {
            // SAFETY: the caller guarantees that no set of the pool is in use.
            unsafe { self.gpu.device().reset_descriptor_pool(*pool, vk::DescriptorPoolResetFlags::empty()) }
                .map_err(failed("vkResetDescriptorPool"))?;
        }
        self.current = 0;
        Ok(())
    }

    /// Makes a set with these buffers.
    pub(super) fn set(
        &mut self,
        layout: vk::DescriptorSetLayout,
        buffers: &[BufferRef],
        kernel: &'static str,
    ) -> Result<vk::DescriptorSet> {
        let limit = u64::from(self.gpu.limits().max_storage_buffer_range);
        if let Some(large) = buffers.iter().find(|b| b.size > limit) {
            return Err(Error::TooLarge(format!(
                "{kernel} needs a storage buffer of {} bytes; the device binds {limit} at most",
                large.size
            )));
        }
        let alignment = self.gpu.limits().min_storage_buffer_offset_alignment.max(1);
        if let Some(odd) = buffers.iter().find(|b| b.size > 0 && b.offset % alignment != 0) {
            let text = format!("{kernel} is given a buffer at offset {}, the device binds multiples of {alignment}", odd.offset);
            return Err(Error::Invalid(text));
        }
        let set = self.take(layout)?;
        // A descriptor needs a buffer and a range even if the kernel does not access it.
        let nothing = self.gpu.nothing();
        let bound = buffers.iter().map(|b| if b.size == 0 { nothing } else { *b });
        let infos: Vec<_> = bound.map(|b| [vk::DescriptorBufferInfo { buffer: b.buffer, offset: b.offset, range: b.size }]).collect();
        let mut writes = Vec::with_capacity(infos.len());
        for (i, info) in (0..).zip(&infos) {
            let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(i);
            writes.push(write.descriptor_type(vk::DescriptorType::STORAGE_BUFFER).buffer_info(info));
        }
        // SAFETY: the set was just allocated, so no command uses it; the caller of the recorder provides valid buffers.
        unsafe { self.gpu.device().update_descriptor_sets(&writes, &[]) };
        Ok(set)
    }

    /// Allocates a set, from a new pool if all others are full.
    fn take(&mut self, layout: vk::DescriptorSetLayout) -> Result<vk::DescriptorSet> {
        let layouts = [layout];
        loop {
            let fresh = self.current == self.pools.len();
            if fresh {
                self.reserve(MORE)?;
            }
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.pools[self.current]).set_layouts(&layouts);
            // SAFETY: pool and layout belong to this device.
            match unsafe { self.gpu.device().allocate_descriptor_sets(&info) } {
                Ok(sets) => return Ok(sets[0]),
                Err(e) if fresh => return Err(failed("vkAllocateDescriptorSets")(e)),
                Err(_) => self.current += 1,
            }
        }
    }
}

impl Drop for DescriptorPools {
    fn drop(&mut self) {
        for pool in self.pools.drain(..) {
            // SAFETY: the commands have been executed (see `Recorder::new` and `Recorder::with_pools`), so no set is in
            // use.
            unsafe { self.gpu.device().destroy_descriptor_pool(pool, None) };
        }
    }
}
