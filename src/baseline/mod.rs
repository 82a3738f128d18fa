//! The structures that the paper compares with, built and queried on the same device, with the same answers (SPEC 3.6).

mod lbvh;

pub use lbvh::Lbvh;
