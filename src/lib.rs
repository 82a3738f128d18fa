//! OLBVH: octree linear bounding volume hierarchies over volumetric meshes (Ströter, Mueller-Roemer, Stork, Fellner 2020), built and
//! queried by Vulkan compute.
//!
//! A tree finds which tetrahedron holds a point, where a ray can meet a mesh, what a voxel touches. Everything runs on the device:
//! construction, point location, volume rendering, slicing, mesh overlap. What decides is computed with integers and correctly rounded operations in a fixed
//! order, so trees and owners are **the same bytes on every device**, and equal to [`mod@reference`], the plain twin in safe Rust.
//!
//! # An answer in ten lines
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
//! Thin bodies and pictures want [`options::Fineness`]; many points, [`query::Path`]; what is repeated, [`gpu::Gpu::with_pool`].
//!
//! # In a renderer of your own
//! [`gpu::Gpu::from_raw`] takes your instance, device and queue (types of [`ash`] and [`gpu_allocator`], as exported here). Then, once:
//! sizes ([`primitives::Arena::measure`] runs a `carve` without memory), one buffer, and the same `carve` over it. Every frame: record.
//! ```no_run
//! use olbvh::{build::*, gpu::{Buffer, BufferRef, Gpu, Recorder}, options::BuildOptions, primitives::Arena, query::*, Result};
//!
//! struct Frame { input: MeshInput, arrays: MeshArrays, scratch: MeshScratch, tree: TreeMemory, build_scratch: BuildScratch, memory: Buffer }
//!
//! /// `positions`: three floats per point; `cells`: four indices per tetrahedron. Either buffer is yours.
//! fn plan(gpu: &Gpu, (positions, points): (BufferRef, u32), (cells, tets): (BufferRef, u32)) -> Result<Frame> {
//!     let capacity = Capacity::usual(tets, 7); // down to level 7, or what `Tree::build` chose for the mesh at rest
//!     let carve = |a: &mut Arena| {
//!         let (arrays, scratch) = (MeshArrays::carve(a, points, tets)?, MeshScratch::carve(a, tets)?);
//!         let tree = TreeMemory::carve(a, &capacity, &BuildOptions::default())?;
//!         Ok((arrays, scratch, tree, BuildScratch::carve(gpu, a, tets, &capacity, &BuildOptions::default())?))
//!     };
//!     let memory = gpu.buffer("olbvh.frame.memory", Arena::measure(carve)?)?;
//!     let (arrays, scratch, tree, build_scratch) = carve(&mut Arena::new(memory.all()))?;
//!     let input = MeshInput { positions, stride: 3, points, cells, tets };
//!     Ok(Frame { input, arrays, scratch, tree, build_scratch, memory })
//! }
//!
//! /// Into your command buffer, after `// SAFETY: …` and `Recorder::new(&gpu, commands, None)`.
//! fn record(r: &mut Recorder, frame: &Frame, asked: &PointInput, found: &LocateOutput) -> Result<()> {
//!     cmd_prepare_mesh(r, &frame.input, &frame.arrays, &frame.scratch)?; // positions must be visible to compute shaders
//!     r.barrier("mesh → tree");
//!     let mesh = MeshView { input: frame.input, arrays: frame.arrays };
//!     cmd_build(r, &mesh, &frame.tree, &BuildOptions::default(), &frame.build_scratch)?; // ends with a barrier
//!     let scene = Scene { mesh, tree: frame.tree, longest_leaf: frame.input.tets };
//!     cmd_locate(r, &scene, asked, found, &LocateOptions::default())
//! } // then your barrier from compute writes to whatever reads `found`, and `Recorder::finish`
//! ```
//! - **Frames in flight** need memory of their own each (or a barrier between them), as all that is written every frame; so do descriptor pools where
//!   there are no buffer addresses. What does not change (cells, fields) is shared.
//! - **Queues**: a [`gpu::Gpu`] records for one family. Semaphores and timelines are yours: recording submits nothing. Only the owning calls
//!   ([`build::DeviceMesh::upload`], [`build::Tree::build`], [`query::locate`] …) submit, under the queue's lock, and wait for a fence.
//! - **Threads**: everything is [`Send`] and [`Sync`]; a [`gpu::Recorder`] belongs to one thread.
//! - **A lost device** is an [`Error::Vulkan`] with its `vk::Result`, from the call that waited; drop everything and begin with a new device.
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

/// What a host hands over is made of these versions' types.
pub use {ash, gpu_allocator};

pub use error::{Error, Result};

/// What owning calls give goes to any thread.
const _: () = {
    const fn shared<T: Send + Sync>() {}
    shared::<gpu::Gpu>();
    shared::<gpu::Buffer>();
    shared::<build::DeviceMesh>();
    shared::<build::Tree>();
};
