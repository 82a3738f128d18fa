//! The program, as a user runs it.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, reason = "also in helpers of tests")]

mod bench;
mod locate;
mod pictures;
mod program;
mod render;
mod slice_overlap;
mod tune;
