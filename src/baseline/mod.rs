//! The structures that the paper compares with, built and queried on the same device (SPEC 3.6): the LBVH with the same answers, and the device's
//! own ray tracing with what it does not lose.

mod lbvh;
mod overlap;
mod rays;

pub use lbvh::{Lbvh, LbvhArrays, LbvhScratch, cmd_build_lbvh, cmd_locate_lbvh};
pub use rays::{RayMethod, Rays};
