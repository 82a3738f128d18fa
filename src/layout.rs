//! Structs shared by host and device, generated from `glsl/shared/layout.glsl` by reflection.

#![allow(clippy::doc_markdown)]

/// A 64-bit number from the two words of a struct, the lower word first.
pub(crate) const fn wide([low, high]: [u32; 2]) -> u64 {
    low as u64 | (high as u64) << 32
}

include!(concat!(env!("OUT_DIR"), "/layout.rs"));
