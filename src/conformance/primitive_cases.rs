//! The list of cases for primitives.

use super::data::Keys;
use super::primitives::{Live, ScanCase, SortCase, TargetKind};
use super::{Case, Group, Work};
use crate::gpu::DeviceClass;

/// Lengths around subgroups, workgroups and tiles of every target, around powers of two, and primes.
const LENGTHS: [u32; 40] = [
    0, 1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 32, 33, 63, 64, 65, 127, 128, 129, 255, 256, 257, 511, 1023, 1025, 2047, 2049, 4095, 4096,
    4097, 8191, 8192, 8193, 10_007, 65_535, 65_536, 65_537, 100_003,
];
/// A few lengths.
const FEW: [u32; 9] = [0, 1, 33, 255, 4096, 4097, 8193, 65_537, 100_000];
/// Lengths with so many workgroups that these are folded into two dimensions with the narrow target.
const LONG: [u32; 3] = [1_048_576, 1_000_003, 4_194_305];
/// More than 2^26 words.
const LARGE: u32 = (1 << 26) + 12_347;
const TARGETS: [TargetKind; 3] = [TargetKind::Serial, TargetKind::Ballot, TargetKind::Narrow];

fn is_few(n: u32) -> bool {
    FEW.contains(&n)
}

pub(super) fn add(cases: &mut Vec<Case>) {
    let lengths = || LENGTHS.into_iter().chain([100_000]).chain(LONG);
    let group = |n: u32, quick: bool| if quick && n < 1 << 20 { Group::Quick } else { Group::Full };
    for target in TARGETS {
        for n in lengths() {
            scan(cases, group(n, true), ScanCase { n, live: Live::Host, in_place: false, target });
        }
        for live in Live::EVERY {
            for n in [1, 10_000, 100_003] {
                scan(cases, Group::Quick, ScanCase { n, live, in_place: true, target });
            }
        }
    }
    scan(cases, Group::Large, ScanCase { n: LARGE, live: Live::Host, in_place: true, target: TargetKind::Device });
    scan(cases, Group::Large, ScanCase { n: LARGE, live: Live::Below, in_place: true, target: TargetKind::Device });
    for target in TARGETS {
        for bits in 1..=32 {
            sort(
                cases,
                group(bits, matches!(bits, 1 | 3 | 8 | 11 | 21 | 30 | 31 | 32)),
                SortCase { bits, n: 20_011, live: Live::All, keys: Keys::Random, target },
            );
            sort(cases, Group::Full, SortCase { bits, n: 4097, live: Live::Host, keys: Keys::Dirty, target });
        }
        for n in lengths() {
            // Thousands of tiles that wait for each other are sorted on every driver: Mesa 22.3 failed here, and not below.
            let few = if n == LONG[0] && target == TargetKind::Narrow { Group::Quick } else { group(n, is_few(n)) };
            sort(cases, few, SortCase { bits: 21, n, live: Live::Host, keys: Keys::Random, target });
            sort(cases, Group::Full, SortCase { bits: 30, n, live: Live::All, keys: Keys::Random, target });
        }
        for live in Live::EVERY {
            for bits in [15, 30] {
                sort(cases, Group::Quick, SortCase { bits, n: 10_000, live, keys: Keys::Random, target });
            }
        }
        for keys in Keys::EVERY.into_iter().filter(|&keys| keys != Keys::Random) {
            sort(cases, Group::Quick, SortCase { bits: 12, n: 33_333, live: Live::All, keys, target });
            sort(cases, Group::Full, SortCase { bits: 32, n: 100_000, live: Live::Host, keys, target });
        }
    }
    for target in DeviceClass::EVERY.map(TargetKind::Row) {
        for (n, live) in [(100_003, Live::Host), (10_007, Live::Below)] {
            scan(cases, Group::Quick, ScanCase { n, live, in_place: true, target });
            sort(cases, Group::Quick, SortCase { bits: 21, n, live, keys: Keys::Random, target });
            sort(cases, Group::Quick, SortCase { bits: 30, n, live, keys: Keys::Few, target });
        }
    }
    sort(cases, Group::Large, SortCase { bits: 21, n: LARGE, live: Live::Host, keys: Keys::Random, target: TargetKind::Device });
    sort(cases, Group::Large, SortCase { bits: 30, n: LARGE, live: Live::All, keys: Keys::Random, target: TargetKind::Device });
}

fn scan(cases: &mut Vec<Case>, group: Group, case: ScanCase) {
    let place = if case.in_place { "/in-place" } else { "" };
    let name = format!("scan/{}/{}{place}{}", case.n, case.live, case.target.suffix());
    push(cases, name, group, Work::Scan(case));
}

fn sort(cases: &mut Vec<Case>, group: Group, case: SortCase) {
    let keys = if case.keys == Keys::Random { String::new() } else { format!("/{}", case.keys) };
    let name = format!("sort/{}-bits/{}/{}{keys}{}", case.bits, case.n, case.live, case.target.suffix());
    push(cases, name, group, Work::Sort(case));
}

/// Adds a case unless there is one with this name.
pub(super) fn push(cases: &mut Vec<Case>, name: String, group: Group, work: Work) {
    if cases.iter().all(|c| c.name != name) {
        cases.push(Case { name, group, work });
    }
}
