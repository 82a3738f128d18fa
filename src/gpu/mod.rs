//! The Vulkan layer: device, memory, pipelines, and the recorder of commands. The only folder with `unsafe` code apart
//! from the C interface.
#![allow(unsafe_code)]

mod acceleration;
mod arena;
mod buffer_ref;
mod constants;
mod context;
mod debug;
mod descriptors;
mod foundation;
mod heap;
mod host;
mod kept;
mod kernel;
mod ledger;
mod memory;
mod open;
mod pipelines;
mod pool;
mod queue;
mod ray_functions;
mod ray_pipeline;
mod recorder;
mod requirements;
mod submission;
mod submit;
mod target;

pub use acceleration::AccelerationStructure;
pub(crate) use acceleration::Triangles;
pub use arena::Arena;
pub use buffer_ref::BufferRef;
pub(crate) use buffer_ref::USAGE;
pub use context::{Binding, Gpu, GpuOptions};
pub use descriptors::{DescriptorPools, DescriptorRoom};
pub use host::{EnabledFeatures, HostDevice};
pub(crate) use kernel::{Access, Arguments, BufferInfo, Kernel, KernelInfo, Specialization};
pub use memory::{ALIGNMENT, Buffer};
pub use open::list_devices;
pub use queue::HostQueue;
pub(crate) use ray_pipeline::RayPipeline;
pub(crate) use recorder::Groups;
pub use recorder::Recorder;
#[cfg(test)]
pub(crate) use recorder::fold_groups;
pub use requirements::{DeviceKind, DeviceReport, RayTracing, Requirements};
pub(crate) use target::LONGEST_LOOP;
pub use target::{DeviceClass, ScanTarget, SortTarget, Target, TileTarget, WorkgroupLimits};

use crate::error::Error;
use ash::vk;

/// Turns a failed Vulkan call into an [`Error`] that names it.
pub(crate) fn failed(call: &'static str) -> impl FnOnce(vk::Result) -> Error {
    move |result| {
        let hint = match result {
            vk::Result::ERROR_DEVICE_LOST => "; the driver gave up: try smaller jobs, or another device",
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                "; the device's memory is full: free some, or take a smaller job (a larger alpha makes a smaller tree)"
            }
            _ => "",
        };
        Error::Vulkan { call, result, hint: hint.into() }
    }
}
