//! Stable radix sort of u32 keys with u32 values, least significant digit first, by the low bits of the keys only.

use super::{Count, ScanScratch, cmd_exclusive_scan};
use crate::error::{Error, Result};
use crate::gpu::{ALIGNMENT, Arena, BufferRef, Gpu, Groups, Recorder, SortTarget};
use crate::kernels::{
    SortDigitsBallot, SortDigitsBallotSpec, SortHistogramSerial, SortHistogramSerialSpec, SortPlan, SortPlanSpec, SortScatterBallot,
    SortScatterBallotSpec, SortScatterSerial, SortScatterSerialSpec, SortSplitPairs, SortSplitPairsSpec,
};

/// Scratch memory of a sort.
#[derive(Clone, Copy, Debug)]
pub struct SortScratch {
    /// A copy of the pairs: serial tiles keep key and value side by side, others first all keys and then all values.
    pairs: BufferRef,
    values: BufferRef,
    /// Counts per digit and tile: those of a pass of serial tiles, otherwise the chain of a pass.
    table: BufferRef,
    /// The chain of every second pass.
    second: BufferRef,
    /// Pairs of every digit of every pass, and per pass how many tiles have begun.
    totals: BufferRef,
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
        let passes = || (1..=bits.max(1)).map(|b| target.passes(b));
        let widest = passes().map(|(_, digit_bits)| digit_bits).max().unwrap_or(1);
        let totals = passes().map(|(passes, digit_bits)| totals(passes, digit_bits)).max().unwrap_or(1);
        let table = (u64::from(max.div_ceil(target.tile())) | 1) << widest;
        if table > i32::MAX as u64 {
            let message =
                format!("{max} pairs in tiles of {}; shaders number {} counts at most: larger tiles make fewer", target.tile(), i32::MAX);
            return Err(Error::TooLarge(message));
        }
        let half = (4 * u64::from(max)).next_multiple_of(ALIGNMENT);
        let pairs = arena.take(2 * half)?;
        Ok(Self {
            pairs,
            values: pairs.part(half, half),
            table: arena.words(table)?,
            second: arena.words(if target.serial { 0 } else { table })?,
            totals: arena.words(if target.serial { 0 } else { totals })?,
            arguments: arena.words(3)?,
            table_length: arena.words(1)?,
            total: arena.words(1)?,
            scan: ScanScratch::carve(gpu, arena, if target.serial { u32::try_from(table).unwrap_or(u32::MAX) } else { 0 })?,
        })
    }

    /// The places for keys and for values, one after the other.
    fn apart(&self, max: u32) -> (BufferRef, BufferRef) {
        (self.pairs.part(0, 4 * u64::from(max)), self.values.part(0, 4 * u64::from(max)))
    }
}

/// Words of [`SortScratch::totals`].
fn totals(passes: u32, digit_bits: u32) -> u64 {
    u64::from((passes << digit_bits) + passes)
}

/// Pairs to sort by the low `bits` bits of their keys: where they will be, and where they are at first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unsorted {
    pub keys: BufferRef,
    pub values: BufferRef,
    sorted: (BufferRef, BufferRef),
    bits: u32,
    /// Not 0: the last tile begins first.
    #[cfg(test)]
    backwards: u32,
}

impl Unsorted {
    /// Where to write up to `max` pairs so that no copy is needed to have them in `keys` and `values` after the sort:
    /// there, or, if every pass of an odd number moves them from one place to another, in the scratch memory.
    pub fn place(gpu: &Gpu, (keys, values): (BufferRef, BufferRef), bits: u32, max: u32, scratch: &SortScratch) -> Self {
        let (target, bits) = (gpu.target().sort, bits.min(u32::BITS));
        let sorted = (keys, values);
        let elsewhere = !target.serial && bits > 0 && max > 1 && target.passes(bits).0 % 2 == 1;
        let (keys, values) = if elsewhere { scratch.apart(max) } else { sorted };
        Self {
            keys,
            values,
            sorted,
            bits,
            #[cfg(test)]
            backwards: 0,
        }
    }
}

/// Sorts `keys` and `values` in place by the low `bits` bits of the keys, at most 32; pairs with equal keys keep their
/// order. The contents after the true number of pairs, up to `count.max`, become undefined.
///
/// Starts with a barrier, so `keys` and `values` need none before, unless there is nothing to sort (fewer than two
/// pairs, or no bits). A count in device memory must be visible before, and between two sorts with the same scratch memory
/// there must be a barrier. Ends without a barrier; the last writes are those of compute shaders or transfers.
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
    let pairs = Unsorted::place(r.gpu(), (keys, values), bits, count.max, scratch);
    if pairs.keys != keys {
        let bytes = 4 * u64::from(count.max);
        r.barrier("keys → sort.copy");
        r.copy(keys.part(0, bytes), pairs.keys);
        r.copy(values.part(0, bytes), pairs.values);
    }
    cmd_sort(r, &pairs, count, scratch)
}

/// Sorts pairs that were written to their first place, as [`cmd_sort_pairs`] does.
pub(crate) fn cmd_sort(r: &mut Recorder<'_>, pairs: &Unsorted, count: Count, scratch: &SortScratch) -> Result<()> {
    let bits = pairs.bits;
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
    let sort = PairSort { pairs, count, live, passes, digit_bits, bits, groups, table, scratch };
    if target.serial { sort.cmd_serial(r, target) } else { sort.cmd_ballot(r, target) }
}

/// What all passes of a sort have in common.
struct PairSort<'a> {
    pairs: &'a Unsorted,
    count: Count,
    live: BufferRef,
    passes: u32,
    digit_bits: u32,
    bits: u32,
    groups: Groups,
    /// Length of the table of counts.
    table: Count,
    scratch: &'a SortScratch,
}

impl PairSort<'_> {
    /// Position of a pass's digit in the keys, and its mask.
    fn digit(&self, pass: u32) -> (u32, u32) {
        let shift = pass * self.digit_bits;
        (shift, (1 << self.digit_bits.min(self.bits - shift)) - 1)
    }

    /// From counts[digit][tile] to places.
    fn cmd_scan(&self, r: &mut Recorder<'_>) -> Result<()> {
        let SortScratch { table, total, scan, .. } = *self.scratch;
        cmd_exclusive_scan(r, table, table, total, self.table, &scan)?;
        r.barrier("sort.scan → sort.scatter");
        Ok(())
    }

    /// Serial tiles. Even passes write pairs of a key and a value, half as many scattered writes as of keys and values
    /// apart; odd passes read these pairs.
    fn cmd_serial(&self, r: &mut Recorder<'_>, target: SortTarget) -> Result<()> {
        let Self { pairs: &Unsorted { keys, values, .. }, live, passes, digit_bits, groups, .. } = *self;
        let (count, workgroup, rows) = (self.count.max, target.workgroup, target.rows);
        let SortScratch { pairs, table: places, .. } = *self.scratch;
        for pass in 0..passes {
            let (shift, mask) = self.digit(pass);
            let from_pairs = pass % 2;
            r.barrier("keys → sort.histogram");
            let histogram = SortHistogramSerial { live, keys, pairs, counts: places, count, shift, mask };
            r.dispatch(&histogram, SortHistogramSerialSpec { workgroup, rows, digit_bits, from_pairs }, groups)?;
            self.cmd_scan(r)?;
            let scatter = SortScatterSerial { live, keys, values, pairs, places, count, shift, mask };
            r.dispatch(&scatter, SortScatterSerialSpec { workgroup, rows, digit_bits, from_pairs }, groups)?;
        }
        if passes % 2 == 1 {
            r.barrier("sort.scatter → sort.split");
            let split = SortSplitPairs { live, pairs, keys, values, count };
            r.dispatch(&split, SortSplitPairsSpec { workgroup, rows }, groups)?;
        }
        Ok(())
    }

    /// Tiles of whole workgroups. Pairs are read and written once per pass, and their digits are counted once for all.
    fn cmd_ballot(&self, r: &mut Recorder<'_>, target: SortTarget) -> Result<()> {
        let Self { pairs, live, passes, digit_bits, groups, .. } = *self;
        let (count, workgroup, rows) = (self.count.max, target.workgroup, target.rows);
        let max_subgroups = workgroup / r.gpu().subgroup_size().max(1);
        let SortScratch { table, second, .. } = *self.scratch;
        let totals = self.scratch.totals.part(0, 4 * totals(passes, digit_bits));
        let (mut from, mut to) = ((pairs.keys, pairs.values), if passes % 2 == 1 { pairs.sorted } else { self.scratch.apart(count) });
        let (mut chain, mut next_chain) = (table, second);
        let spec = SortScatterBallotSpec { workgroup, rows, digit_bits, max_subgroups, ..Default::default() };
        #[cfg(test)]
        let spec = SortScatterBallotSpec { backwards: pairs.backwards, ..spec };
        r.fill(totals, 0);
        r.barrier("sort.clear → sort.digits");
        let digits = SortDigitsBallot { live, keys: from.0, totals, chain, count, last_mask: self.digit(passes - 1).1 };
        r.dispatch(&digits, SortDigitsBallotSpec { workgroup, rows, digit_bits, passes }, groups)?;
        for pass in 0..passes {
            let (shift, mask) = self.digit(pass);
            let ((keys, values), (sorted_keys, sorted_values)) = (from, to);
            r.barrier("sort.digits → sort.scatter");
            let ticket = (passes << digit_bits) + pass;
            let scatter = SortScatterBallot {
                live,
                keys,
                values,
                totals,
                chain,
                next_chain,
                sorted_keys,
                sorted_values,
                count,
                pass,
                ticket,
                shift,
                mask,
            };
            r.dispatch(&scatter, spec, groups)?;
            std::mem::swap(&mut from, &mut to);
            std::mem::swap(&mut chain, &mut next_chain);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::GpuOptions;
    use crate::gpu::{DeviceClass, WorkgroupLimits};

    /// Tiles that begin in reverse order wait for what no workgroup has counted yet, more of them than a device runs at a
    /// time, and must count it themselves.
    #[test]
    fn tiles_count_for_tiles_that_do_not_begin() {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap();
        let mut target = DeviceClass::Portable.target(&WorkgroupLimits::least(gpu.subgroup_size()));
        (target.sort.workgroup, target.sort.rows, target.sort.digit_bits) = (gpu.subgroup_size(), 16, 7);
        let gpu = gpu.with_target(target).unwrap();
        let (n, bits) = (64 * gpu.target().sort.tile() + 5, 13);
        let keys: Vec<u32> = (0..n).map(|i| i.wrapping_mul(2_654_435_761) >> 19).collect();
        let ids: Vec<u32> = (0..n).collect();
        let mut expected = ids.clone();
        expected.sort_by_key(|&i| keys[i as usize]);
        let carve = |a: &mut Arena| SortScratch::carve(&gpu, a, n, bits);
        let (_memory, scratch) = Arena::reserve(&gpu, "olbvh.test.scratch", carve).unwrap();
        for backwards in [0, 1] {
            let (keys, values) = (gpu.upload("olbvh.test.keys", &keys).unwrap(), gpu.upload("olbvh.test.values", &ids).unwrap());
            let pairs = Unsorted { backwards, ..Unsorted::place(&gpu, (keys.all(), values.all()), bits, n, &scratch) };
            assert!(pairs.keys == keys.all(), "an even number of passes");
            gpu.submit("olbvh.test.sort", |r| cmd_sort(r, &pairs, Count::host(n), &scratch)).unwrap();
            assert!(gpu.download::<u32>(&values, values.all()).unwrap() == expected, "backwards: {backwards}");
        }
    }
}
