//! Exclusive prefix sums of u32 values: reduce, then scan.

use super::{Arena, Count};
use crate::error::Result;
use crate::gpu::{BufferRef, Gpu, Groups, Recorder};
use crate::kernels::{ScanApply, ScanApplySpec, ScanSpine, ScanSpineSpec, ScanTiles, ScanTilesSpec};

/// Scratch memory of a scan.
#[derive(Clone, Copy, Debug)]
pub struct ScanScratch {
    sums: BufferRef,
    arguments: BufferRef,
}

impl ScanScratch {
    /// For up to `max` values.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, max: u32) -> Result<Self> {
        let tiles = max.div_ceil(gpu.target().scan.tile());
        Ok(Self { sums: arena.words(u64::from(tiles))?, arguments: arena.words(3)? })
    }
}

/// Writes to `scanned[i]` the sum of `values[..i]` (modulo 2^32) and to the word `total` the sum of all. `scanned` may be `values`.
///
/// Begins with a barrier, so `values` need none before; a count in device memory must be visible already. Ends without one.
///
/// # Errors
/// [`crate::Error::Vulkan`] if a pipeline cannot be made.
pub fn cmd_exclusive_scan(
    r: &mut Recorder<'_>,
    values: BufferRef,
    scanned: BufferRef,
    total: BufferRef,
    count: Count,
    scratch: &ScanScratch,
) -> Result<()> {
    let (live, target, spine) = (count.word(r.gpu()), r.gpu().target().scan, r.gpu().target().spine);
    let (workgroup, rows, sums) = (target.workgroup, target.rows, scratch.sums);
    let groups = count.groups(r, target.tile(), scratch.arguments, "values → scan.tiles")?;
    // 1 — tiles: sum of each · 2 — spine: one workgroup scans the sums · 3 — apply: each tile again, from its sum.
    r.dispatch(&ScanTiles { live, values, sums, count: count.max }, ScanTilesSpec { workgroup, rows }, groups)?;
    r.barrier("scan.tiles → scan.spine");
    let all = ScanSpine { live, sums, total, count: count.max, tile: target.tile() };
    // One workgroup for all tiles: wide, so that no invocation loops for long.
    r.dispatch(&all, ScanSpineSpec { workgroup: spine, rows }, Groups::Count(1))?;
    r.barrier("scan.spine → scan.apply");
    r.dispatch(&ScanApply { live, sums, values, scanned, count: count.max }, ScanApplySpec { workgroup, rows }, groups)
}
