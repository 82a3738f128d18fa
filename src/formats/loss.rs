//! What single precision loses of the values of an array.

use super::scalar::Scalar;
use crate::error::Result;

/// Values whose range is less than this part of the largest are equal but for rounding in double precision.
const NOISE: f64 = 1e-12;

/// Most components of an array that becomes fields.
pub(crate) const MOST_COMPONENTS: usize = 9;

/// What is known of the values in the file, from which an array was rounded.
#[derive(Clone, Copy, Default)]
pub(crate) struct Loss {
    /// They are whole numbers.
    pub whole: bool,
    /// A bit for each component that has several values in the file, which rounding makes one.
    pub collapsed: u16,
}

impl Loss {
    /// What was lost of values of a type. Only where a component has become constant, `exact` reads them again.
    pub fn of(scalar: Option<Scalar>, components: usize, values: &[f32], exact: impl FnOnce() -> Result<Vec<f64>>) -> Result<Self> {
        let whole = scalar.is_some_and(|scalar| !scalar.is_float());
        let is_exact = scalar.is_none_or(|scalar| scalar == Scalar::F32 || scalar.size() < 4);
        let collapsed =
            if is_exact || constant(components, values).next().is_none() { 0 } else { Self::collapsed(components, values, &exact()?) };
        Ok(Self { whole, collapsed })
    }

    /// The components that are constant among `values` and not among those that they were rounded from.
    pub fn collapsed(components: usize, values: &[f32], exact: &[f64]) -> u16 {
        let several = |&c: &usize| {
            let finite = exact.iter().copied().skip(c).step_by(components).filter(|&v| (v as f32).is_finite());
            let (lo, hi) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)));
            hi - lo > NOISE * lo.abs().max(hi.abs())
        };
        constant(components, values).filter(several).fold(0, |bits, c| bits | 1 << c)
    }

    /// Takes in what was lost of another piece of the array.
    pub fn add(&mut self, other: Self) {
        self.whole |= other.whole;
        self.collapsed |= other.collapsed;
    }
}

/// The components that have one value.
fn constant(components: usize, values: &[f32]) -> impl Iterator<Item = usize> {
    let read = if values.len() > components && components <= MOST_COMPONENTS { components } else { 0 };
    (0..read).filter(move |&c| {
        let mut finite = values.iter().skip(c).step_by(components).filter(|v| v.is_finite());
        let first = finite.next();
        finite.all(|value| Some(value) == first)
    })
}
