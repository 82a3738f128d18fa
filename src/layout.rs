//! Structs and constants shared by host and device, and how their words are read. The structs are generated from
//! `scene.glsl`, `layout.glsl` and `state.glsl` in `glsl/shared` by reflection, the constants from all files of `glsl`.

#![allow(clippy::doc_markdown)]

pub use constants::kernel::NONE;

/// The constants of the kernels.
#[allow(dead_code, clippy::unreadable_literal, clippy::excessive_precision)] // as GLSL writes them, and all of them
pub(crate) mod constants {
    include!(concat!(env!("OUT_DIR"), "/constants.rs"));
}

/// A 64-bit number from the two words of a struct, the lower word first.
pub(crate) const fn wide([low, high]: [u32; 2]) -> u64 {
    low as u64 | (high as u64) << 32
}

/// Bit `i` of packed words; false beyond their end.
pub fn bit(words: &[u32], i: u32) -> bool {
    words.get((i / 32) as usize).is_some_and(|w| w >> (i % 32) & 1 != 0)
}

/// Indices of the set bits of packed words, ascending.
pub(crate) fn set_bits(words: Vec<u32>) -> Vec<u32> {
    let of_word = |(w, mut bits): (u32, u32)| {
        std::iter::from_fn(move || {
            let bit = (bits != 0).then(|| bits.trailing_zeros())?;
            bits &= bits - 1;
            Some(32 * w + bit)
        })
    };
    (0..).zip(words).flat_map(of_word).collect()
}

include!(concat!(env!("OUT_DIR"), "/layout.rs"));
