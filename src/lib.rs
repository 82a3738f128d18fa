//! OLBVH: octree linear bounding volume hierarchies over volumetric meshes (Ströter, Mueller-Roemer, Stork, Fellner 2020), built and
//! queried by Vulkan compute.
//!
//! A tree finds which tetrahedron holds a point, where a ray can meet a mesh, what a voxel touches. Everything runs on the device:
//! construction, point location, volume rendering, slicing, mesh overlap. What decides is computed with integers and correctly rounded operations in a fixed
//! order, so trees and owners are **the same bytes on every device**, and equal to [`mod@reference`], the plain twin in safe Rust.
//!
//! # A picture in ten lines
//! ```no_run
//! use olbvh::{build::{BadCells, DeviceMesh, Tree}, gpu::{Gpu, GpuOptions}, mesh, options::BuildOptions, query};
//! # fn main() -> olbvh::Result<()> {
//! let mesh = mesh::kuhn([32, 32, 32])?;
//! let gpu = Gpu::new(&GpuOptions::default())?;
//! let on_device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip)?;
//! let tree = Tree::build(&gpu, &on_device, &BuildOptions::default())?;
//! let found = query::locate(&on_device, &tree, &[[0.5, 1.5, 2.5]], None, &query::LocateOptions::default(), &|_, _| {})?;
//! println!("the point lies in tetrahedron {}", found.owners[0]);
//! # Ok(()) }
//! ```
//!
//! # Layers
//! Dependencies point one way: [`gpu`] ← [`kernels`] ← [`primitives`] ← [`build`] ← [`query`] ← [`blocks`], [`baseline`] ← conformance, `bench`, `formats` ← `tune` ← program.
//! [`mesh`], [`tree`], [`options`], [`layout`], [`render`] and [`mod@reference`] know no Vulkan.
//!
//! - **Record**: functions named `cmd_*` append to a [`gpu::Recorder`]: the caller's command buffer, the caller's memory, nothing submitted,
//!   waited for or allocated. Counts stay on the device.
//! - **Own**: [`build::Tree::build`], [`query::locate`], [`query::render`] record the same stages, submit, wait, and allocate exactly.
//! - **GLSL**: every kernel of `glsl/` is compiled in three forms from one source, with buffers by address (for processors with records in
//!   64-bit words) and by descriptor; `build.rs` reflects it and generates its Rust side, shared structs included ([`layout`]).
//!
//! # Numerics
//! Cells decide membership, not boxes: a point is quantized by subtraction, multiplication and floor, all correctly rounded and monotone, so
//! a descent never loses a point. Geometry is evaluated in normalised coordinates: `x̂ = floor((x − lo)·2^-e·2^82)·2^-42`, the largest
//! extent in [2^40, 2^41) (a power of two away from the [1, 2) of the definition, so that products of three differences neither overflow
//! nor become denormal, which devices may flush). Quotients that matter go through [`reference::grid::reciprocal`], which uses no division.

// The tests of the C interface share their host with those of `tests/`.
#[cfg(test)]
extern crate self as olbvh;

pub mod baseline;
#[cfg(feature = "cli")]
pub mod bench;
pub mod blocks;
pub mod build;
#[cfg(any(feature = "capi", test))]
mod capi;
pub mod conformance;
pub mod error;
#[cfg(feature = "formats")]
pub mod formats;
pub mod glsl;
pub mod gpu;
pub mod kernels;
pub mod layout;
pub mod mesh;
pub mod options;
pub mod primitives;
pub mod query;
pub mod reference;
pub mod render;
pub mod slicing;
pub mod tree;
#[cfg(feature = "cli")]
pub mod tune;

pub use error::{Error, Result};
