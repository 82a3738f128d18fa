//! Work that keeps a device busy between measurements.

use crate::error::Result;
use crate::gpu::{Buffer, DeviceKind, Gpu, Recorder};
use crate::primitives::cmd_copy;
use std::cell::Cell;
use std::time::Instant;

/// Words that are copied at a time: few, so that caches hold them, and the rate follows the clock of the cores.
const WORDS: u32 = 1 << 20;
/// Milliseconds of work at a time.
const MILLISECONDS: f64 = 10.0;
/// How much slower than the fastest the last load may have been.
const TOLERANCE: f64 = 1.05;
/// Most loads before one repetition, after some seconds of which a device that does not settle is taken as it is.
const MOST: u32 = 300;

/// A load for a device that lowers its clock when it has little to do. Measurements of a millisecond, with pauses in
/// which the host prepares the next one, would else show a clock that no application sees.
pub(crate) struct Load {
    busy: Option<Busy>,
}

struct Busy {
    gpu: Gpu,
    from: Buffer,
    to: Buffer,
    copies: u32,
    /// Milliseconds per copy of the fastest load so far.
    fastest: Cell<f64>,
}

impl Load {
    /// No load, for processors: their clock does not depend on us alone.
    pub(crate) fn none() -> Self {
        Self { busy: None }
    }

    /// The load for a device, which is brought to its full clock.
    pub(crate) fn new(gpu: &Gpu) -> Result<Self> {
        if gpu.report().kind == DeviceKind::Cpu {
            return Ok(Self::none());
        }
        let bytes = 4 * u64::from(WORDS);
        let (from, to) = (gpu.buffer("olbvh.bench.load", bytes)?, gpu.buffer("olbvh.bench.load", bytes)?);
        let mut busy = Busy { gpu: gpu.clone(), from, to, copies: 64, fastest: Cell::new(f64::INFINITY) };
        // Clocks take a second to rise.
        let start = Instant::now();
        while start.elapsed().as_secs_f64() < 2.0 {
            busy.copies = (MILLISECONDS / busy.copy()?).clamp(1.0, 1e4) as u32;
        }
        Ok(Self { busy: Some(busy) })
    }

    /// Keeps the device busy until it is about as fast as it has ever been.
    pub(crate) fn run(&self) -> Result<()> {
        let Some(busy) = &self.busy else { return Ok(()) };
        for _ in 0..MOST {
            if busy.copy()? <= TOLERANCE * busy.fastest.get() {
                break;
            }
        }
        Ok(())
    }
}

impl Busy {
    /// Copies for a moment, and returns the milliseconds per copy.
    fn copy(&self) -> Result<f64> {
        let begin = Instant::now();
        let copy = |r: &mut Recorder<'_>| {
            (0..self.copies).try_for_each(|_| {
                r.barrier("load → load");
                cmd_copy(r, self.from.all(), self.to.all())
            })
        };
        let ((), time) = self.gpu.submit("olbvh.bench.load", |r| r.stage("bench.load", copy))?;
        let on_device = Some(time.milliseconds("bench.load")).filter(|&ms| ms > 0.0);
        let each = on_device.unwrap_or(begin.elapsed().as_secs_f64() * 1e3).max(1e-3) / f64::from(self.copies);
        self.fastest.set(self.fastest.get().min(each));
        Ok(each)
    }
}
