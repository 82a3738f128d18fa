//! The self-test: computations with known answers that a device must pass before it is used (a few milliseconds).

use super::{Count, ScanScratch, SortScratch, cmd_exclusive_scan, cmd_sort_pairs};
use crate::error::{Error, Result};
use crate::gpu::{Arena, Gpu, Groups, LONGEST_LOOP};
use crate::kernels::{SelfTest, SelfTestSpec};
use std::fmt::Debug;

/// Pairs to sort and values to scan: several tiles, the last one partial.
const ITEMS: u32 = 9_001;

fn compare<T: Copy + Debug + Default + PartialEq>(device: &str, test: &'static str, expected: &[T], found: &[T]) -> Result<()> {
    let Some(at) = (0..expected.len()).find(|&i| found.get(i) != Some(&expected[i])) else { return Ok(()) };
    let (expected, found) = (expected[at], found.get(at).copied().unwrap_or_default());
    Err(Error::SelfTest { device: device.into(), test, detail: format!("at {at}: expected {expected:?}, found {found:?}") })
}

/// Three floats for each of 64 invocations, none of whose results is denormal. First sums and products in the middle
/// between two floats, then whatever. The third is the rounded product.
fn operands() -> Vec<[f32; 3]> {
    let one_and = |exponent: i32| 1.0 + 2f32.powi(exponent);
    let half = 2f32.powi(-24);
    let ties = [[1.0, half], [one_and(-23), half], [one_and(-6), one_and(-18)], [3.0, one_and(-23)]];
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        // Any sign and mantissa, magnitudes from 2^-8 to 2^8.
        f32::from_bits(state & 0x807f_ffff | (119 + (state >> 24) % 16) << 23)
    };
    let signed = ties.into_iter().flat_map(|[a, b]| [[a, b], [-a, -b], [a, -b], [-a, b]]);
    let others = std::iter::repeat_with(move || [next(), next()]);
    signed.chain(others).map(|[a, b]| [a, b, a * b]).take(64).collect()
}

/// Computes with floats as Rust does, which rounds every result to the nearest float, and ties to the even one.
fn check_floats(device: &str, operands: &[[f32; 3]], found: &[u32]) -> Result<()> {
    type Test = (&'static str, fn([f32; 3]) -> f32);
    let tests: [Test; 5] = [
        ("rounded sum", |[a, b, _]| a + b),
        ("rounded product", |[a, b, _]| a * b),
        ("product less its rounded value", |[a, b, c]| a * b - c),
        ("sum less its first part", |[a, b, _]| (a + b) - a),
        ("floor", |[a, ..]| (a * 64.0).floor()),
    ];
    tests.iter().zip(found.chunks_exact(64)).try_for_each(|((test, of), found)| {
        let expected: Vec<f32> = operands.iter().map(|&triple| of(triple)).collect();
        // As floats: the sign of a zero decides nothing.
        compare(device, test, &expected, &found.iter().copied().map(f32::from_bits).collect::<Vec<_>>())
    })
}

/// Runs the tests; the error describes the first wrong value.
pub(crate) fn self_test(gpu: &Gpu) -> Result<()> {
    let device = gpu.report().name.as_str();
    let keys: Vec<u32> = (0..ITEMS).map(|i| i.wrapping_mul(2_654_435_761) >> 19).collect();
    let ids: Vec<u32> = (0..ITEMS).collect();
    let (key_buffer, id_buffer) = (gpu.upload("olbvh.selftest.keys", &keys)?, gpu.upload("olbvh.selftest.ids", &ids)?);
    let scanned = gpu.buffer("olbvh.selftest.scanned", 4 * u64::from(ITEMS))?;
    let total = gpu.buffer("olbvh.selftest.total", 4)?;
    let lanes = gpu.buffer("olbvh.selftest.lanes", 8 * 4 * 64)?;
    let floats = operands();
    let operands = gpu.upload("olbvh.selftest.operands", &floats)?;
    let carve = |a: &mut Arena| Ok((ScanScratch::carve(gpu, a, ITEMS)?, SortScratch::carve(gpu, a, ITEMS, 13)?));
    let (_memory, (scan, sort)) = Arena::reserve(gpu, "olbvh.selftest.scratch", carve)?;
    let workgroup = 64u32.next_multiple_of(gpu.subgroup_size());
    gpu.submit("olbvh.selftest", |r| {
        let arguments = SelfTest { lanes: lanes.all(), operands: operands.all(), iterations: LONGEST_LOOP };
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
    check_floats(device, &floats, &lanes[192..])?;
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

    fn to_zero(exact: f64) -> f32 {
        let near = exact as f32;
        if f64::from(near).abs() > exact.abs() { f32::from_bits(near.to_bits() - 1) } else { near }
    }

    /// A device that rounds to zero, contracts, or reorders is noticed.
    #[test]
    fn other_ways_to_round_are_noticed() {
        let operands = operands();
        let check = |of: fn([f32; 3]) -> [f32; 5]| {
            let results: Vec<[f32; 5]> = operands.iter().map(|&triple| of(triple)).collect();
            let words: Vec<u32> = (0..5).flat_map(|k| results.iter().map(move |r| r[k].to_bits())).collect();
            check_floats("Some GPU", &operands, &words).map_err(|e| e.to_string())
        };
        assert_eq!(check(|[a, b, c]| [a + b, a * b, a * b - c, (a + b) - a, (a * 64.0).floor()]), Ok(()));
        assert!(operands.iter().all(|[a, b, _]| [a + b, a * b].iter().all(|x| x.is_normal())), "denormals may be flushed");
        let sums = |[a, b, c]: [f32; 3]| [to_zero(f64::from(a) + f64::from(b)), a * b, a * b - c, (a + b) - a, (a * 64.0).floor()];
        assert!(check(sums).is_err_and(|e| e.contains("rounded sum`: at 4: expected 1.0000002, found 1.0000001")));
        let products = |[a, b, c]: [f32; 3]| [a + b, to_zero(f64::from(a) * f64::from(b)), a * b - c, (a + b) - a, (a * 64.0).floor()];
        assert!(check(products).is_err_and(|e| e.contains("rounded product")));
        let fused = |[a, b, c]: [f32; 3]| [a + b, a * b, a.mul_add(b, -c), (a + b) - a, (a * 64.0).floor()];
        assert!(check(fused).is_err_and(|e| e.contains("product less")));
        let reordered = |[a, b, c]: [f32; 3]| [a + b, a * b, a * b - c, b, (a * 64.0).floor()];
        assert!(check(reordered).is_err_and(|e| e.contains("sum less")));
    }
}
