//! Tests that use a device. Rows of `scripts/test` leave out modules by their names.
#![allow(clippy::unwrap_used, reason = "also in helpers of tests")]

mod baseline;
mod blocks;
mod budget;
mod depth;
mod device;
mod faces;
mod frames;
mod glsl;
mod host;
mod lent;
mod limits;
mod lists;
mod memory;
mod mixed;
mod moved;
#[path = "../not_run/mod.rs"]
mod not_run;
mod overlap;
mod parts;
mod pictures;
mod points;
mod rays;
mod record;
mod recorder;
mod rounds;
mod slice;
#[path = "../submit/mod.rs"]
mod submit;
mod targets;
