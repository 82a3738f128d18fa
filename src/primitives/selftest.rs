//! The self-test: computations with known answers that a device must pass before it is used (a few milliseconds).

use super::{Arena, Count, ScanScratch, SortScratch, cmd_exclusive_scan, cmd_sort_pairs};
use crate::error::{Error, Result};
use crate::gpu::{Gpu, Groups};
use crate::kernels::{LONGEST_LOOP, SelfTest, SelfTestSpec};

/// Pairs to sort and values to scan: several tiles, the last one partial.
const ITEMS: u32 = 9_001;

fn wrong(device: &str, test: &'static str, at: usize, expected: u32, found: u32) -> Error {
    Error::SelfTest { device: device.into(), test, detail: format!("at {at}: expected {expected}, found {found}") }
}

fn compare(device: &str, test: &'static str, expected: &[u32], found: &[u32]) -> Result<()> {
    match (0..expected.len()).find(|&i| found.get(i) != Some(&expected[i])) {
        Some(i) => Err(wrong(device, test, i, expected[i], found.get(i).copied().unwrap_or(0))),
        None => Ok(()),
    }
}

/// Runs the tests; the error describes the first wrong value.
pub(crate) fn self_test(gpu: &Gpu) -> Result<()> {
    let device = gpu.report().name.as_str();
    let keys: Vec<u32> = (0..ITEMS).map(|i| i.wrapping_mul(2_654_435_761) >> 19).collect();
    let ids: Vec<u32> = (0..ITEMS).collect();
    let (key_buffer, id_buffer) = (gpu.upload("olbvh.selftest.keys", &keys)?, gpu.upload("olbvh.selftest.ids", &ids)?);
    let scanned = gpu.buffer("olbvh.selftest.scanned", 4 * u64::from(ITEMS))?;
    let total = gpu.buffer("olbvh.selftest.total", 4)?;
    let lanes = gpu.buffer("olbvh.selftest.lanes", 4 * 4 * 64)?;
    let carve = |a: &mut Arena| Ok((ScanScratch::carve(gpu, a, ITEMS)?, SortScratch::carve(gpu, a, ITEMS, 13)?));
    let (_memory, (scan, sort)) = Arena::reserve(gpu, "olbvh.selftest.scratch", carve)?;
    let workgroup = 64u32.next_multiple_of(gpu.subgroup_size());
    gpu.submit("olbvh.selftest", |r| {
        let arguments = SelfTest { lanes: lanes.all(), iterations: LONGEST_LOOP };
        r.dispatch(&arguments, SelfTestSpec { workgroup, ..Default::default() }, Groups::Count(1))?;
        cmd_exclusive_scan(r, key_buffer.all(), scanned.all(), total.all(), Count::host(ITEMS), &scan)?;
        cmd_sort_pairs(r, key_buffer.all(), id_buffer.all(), 13, Count::host(ITEMS), &sort)
    })?;
    let lanes: Vec<u32> = gpu.download(&lanes, lanes.all())?;
    compare(device, "loop of 32768 iterations", &[LONGEST_LOOP; 64], &lanes[..64])?;
    let size = gpu.subgroup_size();
    let ballots: Vec<u32> = (0..64u32).map(|i| (i % size).div_ceil(2)).collect();
    compare(device, "subgroup ballot", &ballots, &lanes[64..128])?;
    let sums: Vec<u32> = (0..64u32).map(|i| (i - i % size..=i).sum()).collect();
    compare(device, "subgroup sum", &sums, &lanes[128..192])?;
    let mut expected = Vec::with_capacity(ITEMS as usize);
    let mut sum = 0u32;
    for k in &keys {
        expected.push(sum);
        sum = sum.wrapping_add(*k);
    }
    compare(device, "sum of the scan", &[sum], &gpu.download::<u32>(&total, total.all())?)?;
    compare(device, "scan", &expected, &gpu.download::<u32>(&scanned, scanned.all())?)?;
    let mut order = ids;
    order.sort_by_key(|&i| keys[i as usize]);
    compare(device, "sort", &order, &gpu.download::<u32>(&id_buffer, id_buffer.all())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_value_refuses_the_device() {
        assert!(compare("Some GPU", "scan", &[1, 2, 3], &[1, 2, 3]).is_ok());
        let error = compare("Some GPU", "scan", &[1, 2, 3], &[1, 7, 3]).unwrap_err();
        assert!(matches!(error, Error::SelfTest { test: "scan", .. }));
        let text = error.to_string();
        assert!(text.starts_with("device Some GPU failed the self-test `scan`: at 1: expected 2, found 7"), "{text}");
        assert!(compare("Some GPU", "scan", &[1, 2, 3], &[1, 2]).is_err(), "missing values are wrong values");
    }
}
