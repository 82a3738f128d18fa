//! Targets: the tuning parameters of the kernels that can be chosen per device, and their limits. The choices are in a
//! table, see [`DeviceClass`].

mod rows;

pub use rows::DeviceClass;

use crate::error::{Error, Result};
use std::borrow::Cow;

/// Most iterations of a loop in a kernel. The self-test runs a loop of this length, since some drivers silently end
/// longer ones.
pub(crate) const LONGEST_LOOP: u32 = 32_768;
/// Most pairs per invocation of a sort by ballots, which keeps them in registers.
const MOST_BALLOT_ROWS: u32 = 64;
/// Shared memory that every supported device has.
const SHARED_BYTES: u32 = 16 << 10;

/// Limits of a workgroup on a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WorkgroupLimits {
    /// Subgroup size that pipelines are compiled for.
    pub subgroup: u32,
    /// Most invocations of a workgroup.
    pub invocations: u32,
    /// Bytes of shared memory.
    pub shared_bytes: u32,
}

impl WorkgroupLimits {
    /// The limits that every supported device has.
    pub fn least(subgroup: u32) -> Self {
        Self { subgroup, invocations: 256, shared_bytes: SHARED_BYTES }
    }
}

/// Workgroup size and items per invocation of kernels in which each takes consecutive items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "formats", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct TileTarget {
    /// Invocations per workgroup; a multiple of the subgroup size.
    pub workgroup: u32,
    /// Consecutive items per invocation.
    pub rows: u32,
}

impl TileTarget {
    /// Items per workgroup.
    pub fn tile(self) -> u32 {
        self.workgroup * self.rows
    }
}

/// The variant of the scan, and its tile size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "formats", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ScanTarget {
    /// `true`: every invocation scans its own `rows` values serially. `false`: a subgroup scans row by row.
    #[cfg_attr(feature = "formats", serde(default))]
    pub serial: bool,
    /// Invocations per workgroup.
    pub workgroup: u32,
    /// Values per invocation.
    pub rows: u32,
}

impl ScanTarget {
    /// Values per workgroup.
    pub fn tile(self) -> u32 {
        self.workgroup * self.rows
    }
}

/// The variant of the radix sort, and its tile size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "formats", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct SortTarget {
    /// `true`: every invocation sorts its own tile of `rows` pairs serially. `false`: a workgroup sorts a tile, with
    /// ranks from ballots.
    pub serial: bool,
    /// Invocations per workgroup.
    pub workgroup: u32,
    /// Pairs per invocation.
    pub rows: u32,
    /// Most bits per digit.
    pub digit_bits: u32,
}

impl SortTarget {
    /// Pairs per tile.
    pub fn tile(self) -> u32 {
        if self.serial { self.rows } else { self.workgroup * self.rows }
    }

    /// Tiles per workgroup.
    pub fn tiles_per_group(self) -> u32 {
        if self.serial { self.workgroup } else { 1 }
    }

    /// Number of passes and bits per digit for keys of `bits` bits.
    pub fn passes(self, bits: u32) -> (u32, u32) {
        let passes = bits.div_ceil(self.digit_bits.max(1)).max(1);
        (passes, bits.div_ceil(passes).max(1))
    }

    /// Bytes of shared memory: a table of digits per subgroup or, in the same place, the keys of the tile and then its
    /// values; and two more tables.
    fn shared_bytes(self, subgroup: u32) -> u32 {
        const OTHERS: u32 = 512 + 8; // totals of subgroups, see workgroup.glsl; two words of the tile
        let (tables, digits) = (self.workgroup / subgroup.max(1), 1 << self.digit_bits);
        if self.serial { 0 } else { 4 * ((tables * digits).max(self.tile()) + 2 * digits) + OTHERS }
    }

    /// Loop iterations of an invocation that clears its digits and counts its pairs, if it does so serially.
    fn iterations(self) -> u32 {
        if self.serial { self.rows + (1 << self.digit_bits) } else { 0 }
    }
}

/// The tuning parameters of the kernels for a device: every specialization constant that changes the time but not the
/// result.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "formats", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Target {
    /// Name in reports.
    pub name: Cow<'static, str>,
    /// Scan.
    pub scan: ScanTarget,
    /// Invocations of the single workgroup that scans the sums of the tiles.
    pub spine: u32,
    /// Radix sort.
    pub sort: SortTarget,
    /// Invocations per workgroup of construction kernels with one item per invocation.
    pub each: u32,
    /// Construction kernels in which an invocation processes a run of consecutive entries.
    pub run: TileTarget,
    /// Invocations per workgroup of queries: location, ray intervals, march, slices, overlap.
    pub query: u32,
}

impl Target {
    /// The nearest target that fits the limits: workgroups of whole subgroups, and digits that fit shared memory.
    pub(super) fn fit(mut self, room: &WorkgroupLimits) -> Self {
        let subgroup = room.subgroup.max(1);
        let most = (room.invocations / subgroup * subgroup).max(subgroup);
        for size in
            [&mut self.scan.workgroup, &mut self.sort.workgroup, &mut self.run.workgroup, &mut self.spine, &mut self.each, &mut self.query]
        {
            *size = size.next_multiple_of(subgroup).min(most);
        }
        // An eighth of the shared memory is left to the driver. Digits matter more than rows.
        let (shared, least) = (room.shared_bytes / 8 * 7, self.sort.rows.min(2));
        while self.sort.digit_bits > 1 && (SortTarget { rows: least, ..self.sort }).shared_bytes(subgroup) > shared {
            self.sort.digit_bits -= 1;
        }
        while self.sort.rows > least && self.sort.shared_bytes(subgroup) > shared {
            self.sort.rows -= 1;
        }
        self
    }

    /// Whether an invocation is better served by work of its own than by that of others nearby: on a processor, which runs
    /// few of them at a time.
    pub fn is_processor(&self) -> bool {
        self.sort.serial
    }

    /// Checks that kernels with these parameters run on a device.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the first parameter that does not fit, and the allowed values.
    pub fn check(&self, room: &WorkgroupLimits) -> Result<()> {
        let WorkgroupLimits { subgroup, invocations, shared_bytes } = *room;
        let wrong = |what: &str| Err(Error::Invalid(format!("target `{}`: {what}", self.name)));
        let workgroups = [
            ("scan.workgroup", self.scan.workgroup),
            ("spine", self.spine),
            ("sort.workgroup", self.sort.workgroup),
            ("each", self.each),
            ("run.workgroup", self.run.workgroup),
            ("query", self.query),
        ];
        for (name, size) in workgroups {
            if size == 0 || size % subgroup.max(1) != 0 || size > invocations {
                return wrong(&format!("{name} is {size}; it must be a multiple of {subgroup}, the subgroup size, up to {invocations}"));
            }
        }
        for (name, rows) in [("scan.rows", self.scan.rows), ("sort.rows", self.sort.rows), ("run.rows", self.run.rows)] {
            if !(1..LONGEST_LOOP).contains(&rows) {
                return wrong(&format!("{name} is {rows}; it must be from 1 to {}", LONGEST_LOOP - 1));
            }
        }
        if !self.sort.serial && self.sort.rows > MOST_BALLOT_ROWS {
            return wrong(&format!("sort.rows is {}; with ballots, it must be from 1 to {MOST_BALLOT_ROWS}", self.sort.rows));
        }
        if !(1..=12).contains(&self.sort.digit_bits) {
            return wrong(&format!("sort.digit_bits is {}; it must be from 1 to 12", self.sort.digit_bits));
        }
        let bytes = self.sort.shared_bytes(subgroup);
        if bytes > shared_bytes {
            return wrong(&format!("the sort takes {bytes} bytes of shared memory of {shared_bytes}; sort.digit_bits must be smaller"));
        }
        let iterations = self.sort.iterations();
        if iterations > LONGEST_LOOP {
            return wrong(&format!("the sort loops {iterations} times, {LONGEST_LOOP} are allowed; sort.rows must be smaller"));
        }
        Ok(())
    }

    /// Checks that problems of every size can be solved with these parameters: tables of counts are indexed by 32 bits,
    /// and one workgroup scans the sums of all tiles.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the first parameter that is too small.
    pub fn check_scale(&self) -> Result<()> {
        let digits = 1u32 << self.sort.digit_bits.min(31);
        let least = [
            ("scan.workgroup × scan.rows × spine", self.scan.tile().saturating_mul(self.spine), 1 << 17),
            ("sort.rows (× sort.workgroup, where it is not serial)", self.sort.tile(), digits),
            ("run.rows", self.run.rows, 12),
        ];
        let small = least.into_iter().find(|(_, value, least)| value < least);
        small.map_or(Ok(()), |(name, value, least)| {
            Err(Error::Invalid(format!("target `{}`: {name} is {value}; for large meshes it must be {least} at least", self.name)))
        })
    }
}
