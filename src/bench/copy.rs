//! Measurement of how fast the device copies, which limits the stages of a construction.

use super::load::Load;
use super::measure::Spread;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::primitives::cmd_copy;
use serde::Serialize;
use std::time::Instant;

/// Number of words of a copy: far more than caches hold.
const WORDS: u32 = 1 << 26;
/// Number of repetitions of each way of copying.
const REPETITIONS: u32 = 9;

/// Times of copying, by the copy command and by a kernel.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct CopyRate {
    /// Bytes read plus bytes written.
    pub bytes: u64,
    /// Number of repetitions.
    pub repetitions: u32,
    /// Milliseconds of `vkCmdCopyBuffer`.
    pub command_ms: Spread,
    /// Milliseconds of a kernel that copies 16 bytes at a time.
    pub kernel_ms: Spread,
    /// Gigabytes (10^9 bytes) per second, read plus written, from the faster way's median.
    pub gb_per_s: f64,
}

impl CopyRate {
    /// Measures the rate; the copies are first compared with the original.
    ///
    /// # Errors
    /// [`Error::Memory`] if there is not enough memory, or [`Error::Mismatch`] if a copy differs from the original.
    pub fn measure(gpu: &Gpu) -> Result<Self> {
        let load = Load::new(gpu)?;
        let data: Vec<u32> = (0..WORDS).map(|i| i.wrapping_mul(2_654_435_761)).collect();
        let from = gpu.upload("olbvh.bench.original", &data)?;
        let to = gpu.buffer("olbvh.bench.copy", 4 * u64::from(WORDS))?;
        let run = |by_kernel: bool| {
            let begin = Instant::now();
            let ((), time) = gpu.submit("olbvh.bench.copy", |r| {
                r.stage("bench.copy", |r| {
                    if by_kernel {
                        return cmd_copy(r, from.all(), to.all());
                    }
                    r.copy(from.all(), to.all());
                    Ok(())
                })
            })?;
            let wall = begin.elapsed().as_secs_f64() * 1e3;
            Ok::<_, Error>(Some(time.milliseconds("bench.copy")).filter(|ms| *ms > 0.0).unwrap_or(wall))
        };
        let times = |by_kernel: bool| {
            gpu.submit("olbvh.bench.clear", |r| {
                r.fill(to.all(), 0);
                Ok(())
            })?;
            run(by_kernel)?;
            if gpu.download::<u32>(&to, to.all())? != data {
                return Err(Error::Mismatch("a copy in device memory differs from the original".into()));
            }
            let times = (0..REPETITIONS).map(|_| load.run().and_then(|()| run(by_kernel))).collect::<Result<Vec<f64>>>()?;
            Spread::of(times).ok_or_else(|| Error::Invalid("no copy was timed".into()))
        };
        let (command_ms, kernel_ms) = (times(false)?, times(true)?);
        let bytes = 8 * u64::from(WORDS);
        let gb_per_s = bytes as f64 / command_ms.median.min(kernel_ms.median) * 1e-6;
        Ok(Self { bytes, repetitions: REPETITIONS, command_ms, kernel_ms, gb_per_s })
    }
}
