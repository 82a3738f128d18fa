//! Structs shared by host and device, generated from `scene.glsl` and `layout.glsl` in `glsl/shared` by reflection.

#![allow(clippy::doc_markdown)]

/// A 64-bit number from the two words of a struct, the lower word first.
pub(crate) const fn wide([low, high]: [u32; 2]) -> u64 {
    low as u64 | (high as u64) << 32
}

/// Bit `i` of packed words; false beyond their end.
pub fn bit(words: &[u32], i: u32) -> bool {
    words.get((i / 32) as usize).is_some_and(|w| w >> (i % 32) & 1 != 0)
}

include!(concat!(env!("OUT_DIR"), "/layout.rs"));
