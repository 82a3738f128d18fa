//! Numbers that decide something are equal on every device, and as exact as is said of them.

use olbvh::grid::reciprocal;

#[test]
fn reciprocals_are_at_most_one_unit_from_the_rounded_ones() {
    let worst = |exponent: u32| (0..1 << 23).map(|mantissa| units_away(f32::from_bits(exponent << 23 | mantissa))).max();
    assert_eq!([1, 127, 252].map(worst), [Some(1); 3]);
}

#[test]
fn reciprocals_of_powers_of_two_are_exact() {
    for x in (-126..=126).map(|n| 2.0_f32.powi(n)) {
        assert_eq!((reciprocal(x), reciprocal(-x)), (1.0 / x, -1.0 / x));
    }
}

/// How many floats lie between the reciprocal of `x` and the correctly rounded one.
fn units_away(x: f32) -> u32 {
    reciprocal(x).to_bits().abs_diff((1.0 / x).to_bits())
}
