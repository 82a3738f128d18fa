//! The kernels' Rust side, generated from `glsl/` by `build.rs`.

use crate::gpu::{Access, Arguments, BufferInfo, BufferRef, Kernel, KernelInfo, Specialization};

fn put(out: &mut [u8], at: usize, bytes: &[u8]) {
    out[at..at + bytes.len()].copy_from_slice(bytes);
}

mod generated {
    #![allow(clippy::all, clippy::pedantic, unused_variables)]
    use super::{Access, Arguments, BufferInfo, BufferRef, Kernel, KernelInfo, Specialization, put};
    include!(concat!(env!("OUT_DIR"), "/kernels.rs"));
}
pub(crate) use generated::*;

/// Most buffers that a kernel binds. A constant, so that not every kernel is linked for it.
pub(crate) const MOST_BUFFERS: usize = {
    let (mut most, mut i) = (0, 0);
    while i < ALL.len() {
        most = if ALL[i].buffers.len() > most { ALL[i].buffers.len() } else { most };
        i += 1;
    }
    most
};

/// Every kernel's name with the names of its buffers, for tests.
#[doc(hidden)]
pub fn interfaces() -> impl Iterator<Item = (&'static str, Vec<&'static str>)> {
    ALL.iter().map(|k| (k.name, k.buffers.iter().map(|b| b.name).collect()))
}
