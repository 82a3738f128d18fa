//! Stable radix sort of u32 keys with u32 values, least significant digit first, by the low bits of the keys only.

use super::{Arena, Count, ScanScratch, cmd_exclusive_scan};
use crate::error::{Error, Result};
use crate::gpu::{BufferRef, Gpu, Groups, Recorder};
use crate::kernels::{
    SortHistogramBallot, SortHistogramBallotSpec, SortHistogramSerial, SortHistogramSerialSpec, SortPlan, SortPlanSpec, SortScatterBallot,
    SortScatterBallotSpec, SortScatterSerial, SortScatterSerialSpec,
};

/// Scratch memory of a sort.
#[derive(Clone, Copy, Debug)]
pub struct SortScratch {
    keys: BufferRef,
    values: BufferRef,
    table: BufferRef,
    arguments: BufferRef,
    table_length: BufferRef,
    total: BufferRef,
    scan: ScanScratch,
}

impl SortScratch {
    /// Takes the scratch memory for up to `max` pairs with keys of up to `bits` bits: a copy of the pairs, and the
    /// tables of counts.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small, [`crate::Error::TooLarge`] for more counts than shaders can
    /// number.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, max: u32, bits: u32) -> Result<Self> {
        let target = gpu.target().sort;
        // Fewer bits may need wider digits, so every number of bits up to `bits` is considered.
        let widest = (1..=bits.max(1)).map(|b| target.passes(b).1).max().unwrap_or(1);
        let table = (u64::from(max.div_ceil(target.tile())) | 1) << widest;
        if table > i32::MAX as u64 {
            let message =
                format!("{max} pairs in tiles of {}; shaders number {} counts at most: larger tiles make fewer", target.tile(), i32::MAX);
            return Err(Error::TooLarge(message));
        }
        Ok(Self {
            keys: arena.words(u64::from(max))?,
            values: arena.words(u64::from(max))?,
            table: arena.words(table)?,
            arguments: arena.words(3)?,
            table_length: arena.words(1)?,
            total: arena.words(1)?,
            scan: ScanScratch::carve(gpu, arena, u32::try_from(table).unwrap_or(u32::MAX))?,
        })
    }
}

/// Sorts `keys` and `values` in place by the low `bits` bits of the keys; pairs with equal keys keep their order. The
/// contents after the true number of pairs, up to `count.max`, become undefined.
///
/// Starts with a barrier, so `keys` and `values` need none before, unless there is nothing to sort (fewer than two
/// pairs, or no bits). A count in device memory must be visible before. Ends without a barrier; the last writes are
/// those of compute shaders or, after an odd number of passes, transfers.
///
/// # Errors
/// [`crate::Error::Vulkan`] if a pipeline cannot be made.
pub fn cmd_sort_pairs(
    r: &mut Recorder<'_>,
    keys: BufferRef,
    values: BufferRef,
    bits: u32,
    count: Count,
    scratch: &SortScratch,
) -> Result<()> {
    if bits == 0 || count.max < 2 {
        return Ok(());
    }
    let (gpu, target) = (r.gpu(), r.gpu().target().sort);
    let (live, (passes, digit_bits)) = (count.word(gpu), target.passes(bits));
    let groups = if count.live.is_some() {
        // Plan: the number of tiles, and from it the length of the table of counts.
        let plan = SortPlan {
            live,
            groups: scratch.arguments,
            table: scratch.table_length,
            count: count.max,
            tile: target.tile(),
            per_group: target.tiles_per_group(),
        };
        r.dispatch(&plan, SortPlanSpec { workgroup: gpu.subgroup_size(), digit_bits, ..Default::default() }, Groups::Count(1))?;
        Groups::Indirect(scratch.arguments)
    } else {
        Groups::Count((count.max.div_ceil(target.tile()) | 1).div_ceil(target.tiles_per_group()))
    };
    let table_max = ((u64::from(count.max.div_ceil(target.tile())) | 1) << digit_bits) as u32;
    let table = match count.live {
        Some(_) => Count::device(table_max, scratch.table_length),
        None => Count::host(table_max),
    };
    let (mut from, mut to) = ((keys, values), (scratch.keys, scratch.values));
    for pass in 0..passes {
        r.barrier("keys → sort.histogram");
        // 1 (histogram): counts[digit][tile]. 2 (scan): places. 3 (scatter): moves the pairs.
        let shift = pass * digit_bits;
        let mask = (1 << digit_bits.min(bits - shift)) - 1;
        let (counts, n) = (scratch.table, count.max);
        let (workgroup, rows) = (target.workgroup, target.rows);
        if target.serial {
            let spec = SortHistogramSerialSpec { workgroup, rows, digit_bits };
            r.dispatch(&SortHistogramSerial { live, keys: from.0, counts, count: n, shift, mask }, spec, groups)?;
        } else {
            let spec = SortHistogramBallotSpec { workgroup, rows, digit_bits };
            r.dispatch(&SortHistogramBallot { live, keys: from.0, counts, count: n, shift, mask }, spec, groups)?;
        }
        cmd_exclusive_scan(r, counts, counts, scratch.total, table, &scratch.scan)?;
        r.barrier("sort.scan → sort.scatter");
        let (sorted_keys, sorted_values) = to;
        if target.serial {
            let spec = SortScatterSerialSpec { workgroup, rows, digit_bits };
            let arguments =
                SortScatterSerial { live, keys: from.0, values: from.1, places: counts, sorted_keys, sorted_values, count: n, shift, mask };
            r.dispatch(&arguments, spec, groups)?;
        } else {
            let spec = SortScatterBallotSpec { workgroup, rows, digit_bits, max_subgroups: workgroup / gpu.subgroup_size().max(1) };
            let arguments =
                SortScatterBallot { live, keys: from.0, values: from.1, places: counts, sorted_keys, sorted_values, count: n, shift, mask };
            r.dispatch(&arguments, spec, groups)?;
        }
        std::mem::swap(&mut from, &mut to);
    }
    if passes % 2 == 1 {
        r.barrier("sort.scatter → sort.copy");
        let bytes = 4 * u64::from(count.max);
        r.copy(scratch.keys.part(0, bytes), keys);
        r.copy(scratch.values.part(0, bytes), values);
    }
    Ok(())
}
