//! Work that tests and benchmarks submit.

#![allow(unsafe_code, reason = "every one of them keeps its buffers to the end, in the sizes that are asked for")]

use olbvh::Result;
use olbvh::gpu::{Gpu, Recorder};
use olbvh::times::StageTimes;

/// Records work, submits it, and waits until it is done.
pub fn submit<T>(gpu: &Gpu, label: &'static str, record: impl FnOnce(&mut Recorder<'_>) -> Result<T>) -> Result<(T, StageTimes)> {
    // SAFETY: see above.
    unsafe { gpu.run(label, record) }
}
