//! OLBVH: octree linear bounding volume hierarchies over volumetric meshes (Ströter, Mueller-Roemer, Stork, Fellner
//! 2020), built and queried with Vulkan compute shaders.
//!
//! A tree answers which tetrahedron contains a point, which place of the surface is closest to it, where a ray may meet the
//! mesh, and what a voxel touches. Everything runs on the device: construction, point location, volume rendering, slicing,
//! mesh overlap. All decisions are made with integers and correctly rounded operations in a fixed order, so trees and owners
//! are **the same bytes on every device**, and equal to those of [`mod@reference`], the reference implementation in safe
//! Rust.
//!
//! # A complete example
//! ```no_run
//! use olbvh::{BadCells, BuildOptions, DeviceMesh, Gpu, GpuOptions, Tree, mesh, query};
//! # fn main() -> olbvh::Result<()> {
//! let mesh = mesh::kuhn([32, 32, 32])?;
//! let gpu = Gpu::new(&GpuOptions::default())?;
//! let on_device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip)?;
//! let tree = Tree::build(&gpu, &on_device, &BuildOptions::default())?;
//! let found = query::locate(&tree, &[[0.5, 1.5, 2.5]], None, &query::LocateOptions::default(), query::SILENT)?;
//! println!("the point lies in tetrahedron {}", found.owners[0]);
//! # Ok(()) }
//! ```
//!
//! For thin bodies and for rendering, see [`options::Fineness`] and [`options::BuildOptions::slabs`]; for repeated calls,
//! [`gpu::Gpu::with_pool`].
//!
//! # In your own renderer
//! [`gpu::Gpu::from_raw`] takes your instance, device and queue (types of [`ash`] and [`gpu_allocator`], exported
//! here like [`glam`]). At start-up, ask for the sizes, create buffers, and have them divided. Then record the commands in
//! every frame.
//! ```no_run
//! use olbvh::{build::{PlacedScene, ScenePlan}, gpu::{BufferRef, Gpu, Recorder}, query::*, Result};
//!
//! /// A mesh in your buffers: three floats per point, and four indices per tetrahedron.
//! struct Yours { positions: BufferRef, points: u32, cells: BufferRef, tets: u32 }
//!
//! /// `buffer` makes a buffer of yours of so many bytes.
//! fn place(gpu: &Gpu, mesh: &Yours, buffer: impl Fn(u64) -> BufferRef) -> Result<PlacedScene> {
//!     // Leaves down to level 7. `ScenePlan::like` plans for trees like one that `Tree::build` has made of the mesh at rest.
//!     let plan = ScenePlan::usual(mesh.points, mesh.tets, 7);
//!     let bytes = plan.bytes(gpu)?;
//!     plan.place(gpu, mesh.positions, mesh.cells, buffer(bytes.memory), buffer(bytes.scratch))
//! }
//!
//! /// Records into your command buffer; `r` comes from `Recorder::new(&gpu, commands, None)`, which is unsafe.
//! fn record(r: &mut Recorder, placed: &PlacedScene, first: bool, asked: &PointInput, found: &LocateOutput) -> Result<()> {
//!     // For the compute shaders and transfers of the frame before, which `r` does not see. If a draw of that frame reads
//!     // this memory, its stage needs a barrier of yours.
//!     r.barrier("frame before → mesh");
//!     // Positions must be visible to compute shaders. Either ends with a barrier.
//!     if first { placed.cmd_build(r)? } else { placed.cmd_rebuild(r)? }
//!     cmd_locate(r, &Scene::recorded(placed.mesh, placed.tree), asked, found, &LocateOptions::default())
//! } // then a barrier from compute writes to the reader of `found`, and `Recorder::finish`
//! ```
//! Other memory is divided likewise: [`gpu::Arena::measure`] runs a `carve` function, such as
//! [`query::RenderMemory::carve`], without memory, and an arena over a buffer of that size runs it again.
//!
//! - **Moved points**: after the first frame, [`build::PlacedScene::cmd_rebuild`] spares the search for neighbours, most of
//!   the preparation of a mesh.
//! - **Your scene**: draw what is opaque, copy the depth attachment to a buffer (a `D32_SFLOAT` as it is, with a barrier from
//!   the transfer to compute shaders), and record [`query::cmd_render`] with it ([`query::RenderInput::depth`]) and with the
//!   view of your matrix ([`render::PicturePlan::with_projected`]). Then blend the colours, which are premultiplied sRGB values, over
//!   your picture: `color.rgb + (1 − color.a)·yours`, where yours are sRGB values as well: after tone mapping, and through a
//!   view whose format is `UNORM`, not `SRGB`. If you draw more behind it, [`query::cmd_depths`] writes to that buffer how
//!   far what became opaque is away, such as an iso-surface.
//! - **Frames in flight**: whatever is written in every frame needs its own memory per frame in flight, or a barrier
//!   between frames. So do descriptor pools on devices without buffer addresses. Data that does not change (cells,
//!   fields) can be shared.
//! - **Queues**: a [`gpu::Gpu`] records for one queue family. Semaphores and timelines are yours: recording submits
//!   nothing. Only the owning calls ([`build::DeviceMesh::upload`], [`build::Tree::build`], [`query::locate`] …) and
//!   [`gpu::Gpu::run`], which runs what you record, submit, under the queue's lock, and wait for a fence.
//! - **Threads**: whatever is kept (devices, buffers, meshes, trees, plans) is [`Send`] and [`Sync`]. Command buffers are not
//!   shared: a [`gpu::Recorder`] is used by one thread at a time.
//! - **A lost device** is reported as an [`Error::Vulkan`] with its `vk::Result`, by the call that waited. Drop
//!   everything and start again with a new device.
//!
//! # Layers
//! Dependencies point one way. Without Vulkan: [`layout`], [`grid`], [`mesh`], [`options`] ← [`tree`], [`render`],
//! [`slicing`] ← [`mod@reference`]. With it: [`gpu`], [`kernels`] and [`primitives`], one layer, because opening a
//! device runs the self-test, which uses kernels ← [`build`] ← [`query`] ← [`blocks`], [`baseline`], [`conformance`],
//! the C interface ← `bench` ← `tune` ← program. `tests/rules.rs` has the whole order and holds the code to it.
//!
//! - **Recording functions**, named `cmd_*`, append to a [`gpu::Recorder`]: the command buffer and the memory are the
//!   caller's, and nothing is submitted, waited for or allocated. Counts stay on the device.
//! - **Owning calls** ([`build::Tree::build`], [`query::locate`], [`query::render`] …) record the same stages, submit
//!   them, wait, and allocate exactly what is needed.
//! - **GLSL**: every kernel of `glsl/` is compiled in three forms from one source: with buffers by address, in a
//!   variant that accesses records as 64-bit words, and with buffers by descriptor. `build.rs` reflects the kernels and
//!   generates their Rust side, shared structs included ([`layout`]).
//!
//! # Numerics
//! Grid cells decide membership, not floating-point boxes: a point is quantized by subtraction, multiplication and
//! floor, which are correctly rounded and monotone, so a descent never loses a point. Geometry is evaluated in
//! normalised coordinates `x̂ = floor((x − lo)·2^-e·2^82)·2^-42` (SPEC 2.1). The largest extent lies in [2^40, 2^41),
//! so products of three differences neither overflow nor become denormal, which devices may flush. Quotients that
//! affect a result are computed with [`grid::reciprocal`], which uses no division.

// The tests of the C interface use the same host code as those of `tests/`.
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
pub mod grid;
pub mod kernels;
pub mod layout;
pub mod mesh;
mod named;
pub mod options;
pub mod primitives;
pub mod query;
pub mod reference;
pub mod render;
pub mod slicing;
pub mod times;
pub mod tree;
#[cfg(feature = "cli")]
pub mod tune;

/// The versions whose types appear in the interface for host applications.
pub use {ash, glam, gpu_allocator};

pub use build::{BadCells, DeviceMesh, Tree};
pub use error::{Error, Result};
pub use gpu::{Gpu, GpuOptions};
pub use mesh::Mesh;
pub use options::{Assign, BuildOptions, Fineness, Lists};

/// The results of owning calls can be sent to and shared by any thread.
const _: () = {
    const fn shared<T: Send + Sync>() {}
    shared::<gpu::Gpu>();
    shared::<gpu::Buffer>();
    shared::<build::DeviceMesh>();
    shared::<build::Tree>();
};
