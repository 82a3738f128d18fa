//! Exclusive scan and stable radix sort on the device, as functions that append to a recorder.

#[cfg(feature = "cli")]
mod copy;
mod fill;
mod scan;
mod selftest;
mod sort;

#[cfg(feature = "cli")]
pub(crate) use copy::cmd_copy;
pub(crate) use fill::cmd_fill;
pub use scan::{ScanScratch, cmd_exclusive_scan};
pub(crate) use selftest::self_test;
pub use sort::{SortScratch, cmd_sort_pairs};
pub(crate) use sort::{Unsorted, cmd_sort};

use crate::error::Result;
use crate::gpu::{BufferRef, Gpu, Groups, Recorder};
use crate::kernels::{DispatchArgs, DispatchArgsSpec};

/// A number of items: an upper limit known to the host, and optionally the true number in a word of device memory.
#[derive(Clone, Copy, Debug)]
pub struct Count {
    /// No more items than this are accessed, whatever the word holds.
    pub max: u32,
    /// The word with the true number.
    pub live: Option<BufferRef>,
    /// Number of leading items that dispatches leave out, of a number in device memory.
    skip: u32,
}

impl Count {
    /// A number known to the host.
    pub fn host(n: u32) -> Self {
        Self { max: n, live: None, skip: 0 }
    }

    /// A number in device memory, at most `max`.
    pub fn device(max: u32, live: BufferRef) -> Self {
        Self { max, live: Some(live), skip: 0 }
    }

    /// The items after the first `skip`.
    #[must_use]
    pub(crate) fn behind(self, skip: u32) -> Self {
        Self { skip, ..self }
    }

    /// The word that kernels read the number from.
    pub(crate) fn word(&self, gpu: &Gpu) -> BufferRef {
        self.live.unwrap_or_else(|| gpu.unbounded())
    }

    /// Workgroups for `per_group` items each, followed by a barrier with this label. If the number is in device memory,
    /// a kernel first writes the workgroups to `arguments` (12 bytes); the number must be visible before.
    pub(crate) fn groups(&self, r: &mut Recorder<'_>, per_group: u32, arguments: BufferRef, label: &'static str) -> Result<Groups> {
        let groups = self.arguments(r, per_group, arguments)?;
        r.barrier(label);
        Ok(groups)
    }

    /// Workgroups as [`Count::groups`] gives them; the caller records the barrier.
    pub(crate) fn arguments(&self, r: &mut Recorder<'_>, per_group: u32, arguments: BufferRef) -> Result<Groups> {
        let Some(live) = self.live else { return Ok(Groups::Count(self.max.div_ceil(per_group))) };
        let words = arguments.part(0, 12);
        let spec = DispatchArgsSpec { workgroup: r.gpu().subgroup_size(), ..Default::default() };
        r.dispatch(&DispatchArgs { live, groups: words, count: self.max, per_group, skip: self.skip }, spec, Groups::Count(1))?;
        Ok(Groups::Indirect(words))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{Arena, GpuOptions, fold_groups};

    /// Numbers of workgroups that the device writes are folded like those of the host, also beyond the limit of an axis.
    #[test]
    fn many_workgroups_are_folded() {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap();
        for n in [0, 1, 65_535, 65_536, 65_537, 70_000, 98_305, 1 << 24] {
            let live = gpu.upload("olbvh.test.live", &[n]).unwrap();
            let (buffer, groups) = Arena::reserve(&gpu, "olbvh.test.groups", |a| a.words(3)).unwrap();
            let count = Count::device(u32::MAX, live.all());
            gpu.submit("olbvh.test.groups", |r| count.arguments(r, 1, groups).map(drop)).unwrap();
            let written: Vec<u32> = gpu.download(&buffer, groups.part(0, 12)).unwrap();
            assert_eq!(written, fold_groups(n.max(1)), "{n} workgroups");
        }
    }
}
