//! Cases that compare scan and sort with their definitions.

use super::buffers::{FILL, Guarded};
use super::data::Keys;
use super::failure::{Verdict, compare};
use crate::gpu::{Arena, DeviceClass, Gpu, ScanTarget, SortTarget, Target, TileTarget, WorkgroupLimits};
use crate::named::named;
use crate::primitives::{Count, ScanScratch, SortScratch, cmd_exclusive_scan, cmd_sort_pairs};

/// The target with which a case runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum TargetKind {
    /// The target that the device or the caller chose.
    Device,
    /// Serial tiles, as on processors.
    Serial,
    /// Tiles of a workgroup, ranked by ballots, as on GPUs.
    Ballot,
    /// Ballots with tiny tiles and digits, which make many tiles and many passes.
    Narrow,
    /// A given row of the table, whatever the device is.
    Row(DeviceClass),
}

impl TargetKind {
    /// Part of the names of cases; empty for [`Self::Device`].
    pub(crate) fn suffix(self) -> String {
        match self {
            Self::Device => "",
            Self::Serial => "/serial",
            Self::Ballot => "/ballot",
            Self::Narrow => "/narrow",
            Self::Row(row) => return format!("/row-{row}"),
        }
        .into()
    }

    /// The target on a device with these limits; `None`: the device's own.
    pub(crate) fn target(self, room: &WorkgroupLimits) -> Option<Target> {
        let subgroup = room.subgroup;
        match self {
            Self::Device => None,
            Self::Serial => Some(DeviceClass::Cpu.target(room)),
            Self::Ballot => Some(DeviceClass::Portable.target(room)),
            Self::Narrow => Some(Target {
                name: "narrow".into(),
                scan: ScanTarget { serial: false, workgroup: 2 * subgroup, rows: 3 },
                sort: SortTarget { serial: false, workgroup: 2 * subgroup, rows: 5, digit_bits: 3 },
                spine: 64u32.next_multiple_of(subgroup),
                each: 2 * subgroup,
                query: subgroup,
                run: TileTarget { workgroup: subgroup, rows: 3 },
            }),
            Self::Row(row) => Some(row.target(room)),
        }
    }
}

/// Where the number of items is stored, and how it compares with the length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Live {
    /// Known on the host.
    Host,
    /// Stored on the device: all items.
    All,
    /// Stored on the device: fewer items.
    Below,
    /// Stored on the device: none.
    Zero,
    /// Stored on the device: more than there is room for; only those that fit count.
    Above,
}

named!(
    Live,
    "kind of count",
    [Host = "host", All = "indirect", Below = "indirect-below", Zero = "indirect-zero", Above = "indirect-above"]
);

impl Live {
    /// The number stored on the device, and the number of items that it means.
    fn numbers(self, n: u32) -> (u32, u32) {
        match self {
            Self::Host | Self::All => (n, n),
            Self::Below => (n - n / 3, n - n / 3),
            Self::Zero => (0, 0),
            Self::Above => (n.saturating_add(100_001), n),
        }
    }

    /// The count for up to `n` items, the memory that holds it, and the number of items that it means.
    fn count(self, gpu: &Gpu, n: u32) -> Verdict<(Count, Guarded, usize)> {
        let (word, items) = self.numbers(n);
        let memory = Guarded::new(gpu, "olbvh.conformance.count", &[word], 1)?;
        let count = if self == Self::Host { Count::host(n) } else { Count::device(n, memory.all()) };
        Ok((count, memory, items as usize))
    }
}

/// An exclusive scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanCase {
    pub n: u32,
    pub live: Live,
    /// Whether the output overwrites the input.
    pub in_place: bool,
    pub target: TargetKind,
}

/// A sort.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SortCase {
    pub bits: u32,
    pub n: u32,
    pub live: Live,
    pub keys: Keys,
    pub target: TargetKind,
}

pub(crate) fn scan(gpu: &Gpu, case: ScanCase) -> Verdict {
    let data = Keys::Random.make(case.n, 32);
    let (count, _word, items) = case.live.count(gpu, case.n)?;
    let values = Guarded::new(gpu, "olbvh.conformance.values", &data, 0)?;
    let output = Guarded::new(gpu, "olbvh.conformance.scanned", &[], if case.in_place { 0 } else { data.len() })?;
    let scanned = if case.in_place { &values } else { &output };
    let total = Guarded::new(gpu, "olbvh.conformance.total", &[], 1)?;
    let carve = |a: &mut Arena| ScanScratch::carve(gpu, a, case.n);
    let memory = Guarded::scratch(gpu, "olbvh.conformance.scratch", Arena::measure(carve)?)?;
    let scratch = carve(&mut Arena::new(memory.all()))?;
    gpu.submit("olbvh.conformance.scan", |r| cmd_exclusive_scan(r, values.all(), scanned.all(), total.all(), count, &scratch))?;
    let mut sum = 0u32;
    let mut expected = Vec::with_capacity(data.len());
    for v in &data[..items] {
        expected.push(sum);
        sum = sum.wrapping_add(*v);
    }
    // Items beyond the count must be left unchanged.
    expected.extend(data[items..].iter().map(|&v| if case.in_place { v } else { FILL }));
    let stage = "primitives.scan";
    memory.check_guard(gpu, stage)?;
    compare(stage, "scanned", &expected, &scanned.read(gpu, stage)?)?;
    if !case.in_place {
        compare(stage, "values", &data, &values.read(gpu, stage)?)?;
    }
    compare(stage, "total", &[sum], &total.read(gpu, stage)?)
}

pub(crate) fn sort(gpu: &Gpu, case: SortCase) -> Verdict {
    let data = case.keys.make(case.n, case.bits);
    let ids: Vec<u32> = (0..case.n).collect();
    let (count, _word, items) = case.live.count(gpu, case.n)?;
    let keys = Guarded::new(gpu, "olbvh.conformance.keys", &data, 0)?;
    let values = Guarded::new(gpu, "olbvh.conformance.ids", &ids, 0)?;
    let carve = |a: &mut Arena| SortScratch::carve(gpu, a, case.n, case.bits);
    let memory = Guarded::scratch(gpu, "olbvh.conformance.scratch", Arena::measure(carve)?)?;
    let scratch = carve(&mut Arena::new(memory.all()))?;
    gpu.submit("olbvh.conformance.sort", |r| cmd_sort_pairs(r, keys.all(), values.all(), case.bits, count, &scratch))?;
    let mask = u32::MAX.checked_shr(32 - case.bits).unwrap_or(0);
    let mut order = ids;
    order.truncate(items);
    order.sort_by_key(|&i| data[i as usize] & mask);
    let expected: Vec<u32> = order.iter().map(|&i| data[i as usize]).collect();
    let stage = "primitives.sort";
    memory.check_guard(gpu, stage)?;
    // The order of pairs beyond the count is unspecified.
    compare(stage, "keys", &expected, &keys.read(gpu, stage)?[..items])?;
    compare(stage, "values", &order, &values.read(gpu, stage)?[..items])
}
