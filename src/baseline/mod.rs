//! The structures that the paper compares with, built and queried on the same device (SPEC 3.6): an LBVH, which gives
//! the same answers, and the device's ray tracing, which may lose some points.

mod lbvh;
mod overlap;
mod rays;

pub use crate::query::searched::BinaryTree;
pub use lbvh::{Lbvh, LbvhArrays, LbvhScratch, cmd_build_lbvh, cmd_locate_lbvh};
pub use rays::{RayMethod, Rays};
