//! Tests that use a device. Rows of `scripts/test` leave out modules by their names.
#![allow(clippy::unwrap_used, reason = "also in helpers of tests")]

use olbvh::gpu::{Binding, Gpu, GpuOptions};

/// Two tests: a check of a device that passes buffers by address, and of one that passes them by descriptors.
macro_rules! both_bindings {
    ($check:ident, $by_address:ident, $by_descriptors:ident) => {
        #[test]
        fn $by_address() {
            crate::with(olbvh::gpu::Binding::Address, $check);
        }

        #[test]
        fn $by_descriptors() {
            crate::with(olbvh::gpu::Binding::Descriptors, $check);
        }
    };
}

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
mod values;

fn with(binding: Binding, check: fn(&Gpu)) {
    let gpu = Gpu::new(&GpuOptions { binding: Some(binding), ..GpuOptions::default() }).unwrap();
    check(&gpu);
    silent(&gpu);
}

/// Validation layers have had nothing to say.
fn silent(gpu: &Gpu) {
    let messages = gpu.validation_messages();
    assert!(messages.is_empty(), "{messages:#?}");
}
