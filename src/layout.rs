//! Structs shared by host and device, generated from `glsl/shared/layout.glsl` by reflection.

#![allow(clippy::doc_markdown)]

include!(concat!(env!("OUT_DIR"), "/layout.rs"));
