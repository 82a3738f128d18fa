//! Exclusive prefix sums of u32 values: reduce, then scan.

use super::Count;
use crate::error::Result;
use crate::gpu::{Arena, BufferRef, Gpu, Groups, LONGEST_LOOP, Recorder};
use crate::kernels::{ScanApply, ScanApplySpec, ScanSpine, ScanSpineSpec, ScanTiles, ScanTilesSpec};

/// Scratch memory of a scan.
#[derive(Clone, Copy, Debug)]
pub struct ScanScratch {
    sums: BufferRef,
    arguments: BufferRef,
}

impl ScanScratch {
    /// Takes the scratch memory for up to `max` values.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small, or for more values than the device's target is made for.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, max: u32) -> Result<Self> {
        let target = gpu.target();
        let tiles = max.div_ceil(target.scan.tile());
        if tiles.div_ceil(target.spine) > LONGEST_LOOP {
            target.check_scale()?;
        }
        Ok(Self { sums: arena.words(u64::from(tiles))?, arguments: arena.words(3)? })
    }
}

/// Writes the sum of `values[..i]` (modulo 2^32) to `scanned[i]`, and the sum of all to the word `total`. `scanned` may
/// be `values`.
///
/// Starts with a barrier, so `values` need none before. A count in device memory must be visible before. Ends without a
/// barrier.
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
    // 1 (tiles): sum of each tile. 2 (spine): one workgroup scans the sums. 3 (apply): scans each tile from its sum on.
    r.dispatch(&ScanTiles { live, values, sums, count: count.max }, ScanTilesSpec { workgroup, rows }, groups)?;
    r.barrier("scan.tiles → scan.spine");
    let all = ScanSpine { live, sums, total, count: count.max, tile: target.tile() };
    // One workgroup for all tiles, wide enough to keep each invocation's loop short.
    r.dispatch(&all, ScanSpineSpec { workgroup: spine, rows }, Groups::Count(1))?;
    r.barrier("scan.spine → scan.apply");
    r.dispatch(
        &ScanApply { live, sums, values, scanned, count: count.max },
        ScanApplySpec { workgroup, rows, in_place: u32::from(values == scanned), serial: u32::from(target.serial) },
        groups,
    )
}
