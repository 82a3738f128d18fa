//! Stable radix sort of (key, value) pairs. Twin of `glsl/primitives/sort_*`.

use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Bits of the widest digit. Its 2^11 counters per chunk stay in the first-level cache.
const DIGIT_BITS: u32 = 11;

/// Sorts the pairs by the low `bits` bits of their keys; pairs with equal keys keep their order. Both arrays have the
/// same length, at most 2^32 − 1.
pub fn sort_pairs(keys: Vec<u32>, values: Vec<u32>, bits: u32) -> (Vec<u32>, Vec<u32>) {
    let passes = bits.min(32).div_ceil(DIGIT_BITS);
    if passes == 0 || keys.len() < 2 {
        return (keys, values);
    }
    let width = bits.min(32).div_ceil(passes);
    // Shared, so that chunks can scatter simultaneously; each element is written by one chunk only.
    let shared = |v: Vec<u32>| v.into_par_iter().map(AtomicU32::new).collect::<Vec<_>>();
    let plain = |v: Vec<AtomicU32>| v.into_par_iter().map(AtomicU32::into_inner).collect();
    let blank = |n: usize| (0..n).into_par_iter().map(|_| AtomicU32::new(0)).collect::<Vec<_>>();
    let (n_keys, n_values) = (keys.len(), values.len());
    let mut from = (shared(keys), shared(values));
    let mut to = (blank(n_keys), blank(n_values));
    for pass in 0..passes {
        scatter(&from, &to, pass * width, width);
        std::mem::swap(&mut from, &mut to);
    }
    drop(to);
    (plain(from.0), plain(from.1))
}

type Pairs = (Vec<AtomicU32>, Vec<AtomicU32>);

fn scatter(from: &Pairs, to: &Pairs, shift: u32, width: u32) {
    let mask = (1u32 << width) - 1;
    let digit = |key: &AtomicU32| (key.load(Relaxed) >> shift & mask) as usize;
    let chunk = from.0.len().div_ceil(8 * rayon::current_num_threads()).max(1 << 14);
    let count = |keys: &[AtomicU32]| {
        let mut counts = vec![0u32; 1 << width];
        for key in keys {
            counts[digit(key)] += 1;
        }
        counts
    };
    let mut offsets: Vec<Vec<u32>> = from.0.par_chunks(chunk).map(count).collect();
    let mut sum = 0u32;
    for d in 0..1 << width {
        for chunk in &mut offsets {
            let count = chunk[d];
            chunk[d] = sum;
            sum += count;
        }
    }
    let chunks = from.0.par_chunks(chunk).zip(from.1.par_chunks(chunk)).zip(&mut offsets);
    chunks.for_each(|((keys, values), offsets)| {
        for (key, value) in keys.iter().zip(values) {
            let place = &mut offsets[digit(key)];
            to.0[*place as usize].store(key.load(Relaxed), Relaxed);
            to.1[*place as usize].store(value.load(Relaxed), Relaxed);
            *place += 1;
        }
    });
}

#[cfg(test)]
mod tests {
    use super::sort_pairs;

    #[test]
    fn sorts_stably_at_every_length_and_width() {
        for n in [0usize, 1, 2, 1000, 16_384, 16_385, 100_000] {
            for bits in [0, 1, 3, 11, 12, 21, 30, 32] {
                let key = |i: usize| (i as u32).wrapping_mul(0x9e37_79b9).rotate_left(7) & u32::MAX.checked_shr(32 - bits).unwrap_or(0);
                let keys: Vec<u32> = (0..n).map(key).collect();
                let values: Vec<u32> = (0..n as u32).collect();
                let mut expected: Vec<(u32, u32)> = keys.iter().copied().zip(values.iter().copied()).collect();
                expected.sort_by_key(|p| p.0);
                let (k, v) = sort_pairs(keys, values, bits);
                assert_eq!(expected, k.into_iter().zip(v).collect::<Vec<_>>(), "{n} pairs, {bits} bits");
            }
        }
    }
}
