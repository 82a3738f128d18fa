//! Seeded input data.

pub(crate) use crate::mesh::hash as mix;

use crate::named::named;

/// Kinds of sequences of keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Keys {
    /// Well mixed.
    Random,
    /// Ascending.
    Sorted,
    /// Descending.
    Reversed,
    /// All keys equal.
    Equal,
    /// Three different values, so that stability becomes visible.
    Few,
    /// All bits set.
    Ones,
    /// Random, with random bits above those that are sorted.
    Dirty,
}

named!(
    Keys,
    "kind of keys",
    [Random = "random", Sorted = "sorted", Reversed = "reversed", Equal = "equal", Few = "few", Ones = "ones", Dirty = "dirty"]
);

impl Keys {
    /// Makes `n` keys of `bits` bits.
    pub(crate) fn make(self, n: u32, bits: u32) -> Vec<u32> {
        let mask = u32::MAX.checked_shr(32 - bits).unwrap_or(0);
        // Ascending over the whole range of the keys.
        let step = |i: u32| ((u64::from(i) * (u64::from(mask) + 1)) / u64::from(n.max(1))) as u32 & mask;
        let key = |i: u32| match self {
            Self::Random => mix(i ^ n) & mask,
            Self::Sorted => step(i),
            Self::Reversed => step(n - 1 - i),
            Self::Equal => 0x5555_5555 & mask,
            Self::Few => [0, mask / 2, mask][mix(i) as usize % 3],
            Self::Ones => mask,
            Self::Dirty => mix(i),
        };
        (0..n).map(key).collect()
    }
}

/// A seeded pseudo-random sequence.
pub(crate) struct Random(u32);

impl Random {
    pub(crate) fn new(seed: u32) -> Self {
        Self(mix(seed ^ 0x9e37_79b9))
    }

    /// The next 32-bit word.
    pub(crate) fn word(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9);
        mix(self.0)
    }

    /// A number below `n`.
    pub(crate) fn below(&mut self, n: u32) -> u32 {
        ((u64::from(self.word()) * u64::from(n)) >> 32) as u32
    }

    /// A number in [0, 1).
    pub(crate) fn unit(&mut self) -> f32 {
        (self.word() >> 8) as f32 / 16_777_216.0
    }

    /// Shuffles items, reproducibly.
    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i as u32 + 1) as usize);
        }
    }
}
