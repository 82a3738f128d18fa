//! The seam between the subcommands and what computes.

mod cpu;
mod gpu;
mod shapes;

pub use shapes::{Origin, Shapes};

use crate::common::{Common, Failure, Outcome};
use olbvh::blocks::{InBlocks, Meshes, Points, Stack, View};
use olbvh::error::Result;
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{Field, Mesh};
use olbvh::options::BuildOptions;
use olbvh::reference::boundary::{Counts, Fault};
use olbvh::reference::overlap::Overlap;
use olbvh::reference::volume::Picture;
use olbvh::render::Bounds;
use olbvh::slicing::Band;
use olbvh::tree::TreeBytes;

/// So much of so much is done.
pub type Report<'a> = &'a (dyn Fn(u64, u64) + Sync);

/// Takes the bands of a stack of slices.
pub type Sink<'a> = &'a mut dyn FnMut(Band) -> Result<()>;

/// Something that builds trees. Bytes of device memory, where a question takes them, are the most that may be used; without, all there are.
pub trait Engine {
    /// What it is called in results.
    fn name(&self) -> String;
    /// The shapes of its kernels, and where they come from; nothing without kernels.
    fn target(&self) -> Option<&Shapes>;
    /// Marks the boundary, builds the tree, and tells what they are like.
    fn summary(&self, mesh: &Mesh, options: &BuildOptions) -> Result<Summary>;
    /// Builds a tree over a mesh and finds owner, barycentric coordinates and value of each point.
    fn locate(&self, asked: &Points<'_>, memory: Option<u64>, field: Option<&Field>, report: Report<'_>) -> Result<InBlocks<Vec<Located>>>;
    /// The same, but finds every tetrahedron that contains each point.
    fn locate_all(&self, asked: &Points<'_>, memory: Option<u64>, report: Report<'_>) -> Result<InBlocks<Vec<Vec<u32>>>>;
    /// Builds a tree over each of two meshes and finds out where they overlap.
    fn overlap(&self, asked: &Meshes<'_>, memory: Option<u64>, report: Report<'_>) -> Result<InBlocks<Overlap>>;
    /// Builds a tree over a mesh and draws a field.
    fn render(&self, asked: &View<'_>, memory: Option<u64>, report: Report<'_>) -> Result<InBlocks<Drawn>>;
    /// Builds a tree over a mesh and slices it, band by band into `sink`.
    fn slice(&self, asked: &Stack<'_>, memory: Option<u64>, report: Report<'_>, sink: Sink<'_>) -> Result<InBlocks>;
}

/// A picture and what was found out for it.
pub struct Drawn {
    /// The picture.
    pub picture: Picture,
    /// The field's values at the ends of the transfer function.
    pub range: [f32; 2],
    /// Distance of two samples.
    pub step: f32,
}

/// Where a point lies.
#[derive(Clone, Copy, Debug)]
pub struct Located {
    /// Tetrahedron of the mesh, or `u32::MAX`.
    pub owner: u32,
    /// Barycentric coordinates in it, 0 outside the mesh.
    pub bary: [f32; 4],
    /// The field's value, NaN outside the mesh or without field.
    pub value: f32,
}

/// A mesh and its tree in figures.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Cells by kind.
    pub counts: Counts,
    /// Bad cells, as tetrahedra of the mesh.
    pub bad: Vec<(u32, Fault)>,
    /// Bounds of the valid cells, relative to the mesh's origin.
    pub bounds: Bounds,
    /// Level of the leaves.
    pub level: u32,
    /// The level that alpha asks for, or the options.
    pub wanted: u32,
    /// Entries.
    pub entries: u64,
    /// Nodes.
    pub nodes: u64,
    /// Leaves.
    pub leaves: u64,
    /// Bytes of each array.
    pub memory: TreeBytes,
    /// Bytes as the paper counts them.
    pub paper_bytes: u64,
    /// Bytes of the neighbour table, which is the mesh's, not the tree's.
    pub neighbour_bytes: u64,
    /// Milliseconds for neighbours and boundary.
    pub topology_ms: f64,
    /// Milliseconds for the tree.
    pub build_ms: f64,
    /// Milliseconds of each stage, in order; empty where stages are not timed.
    pub stages: Vec<(String, f64)>,
}

/// The Vulkan device that `--device` names, for measurements.
pub fn device(common: &Common) -> Outcome<Gpu> {
    if common.means_cpu() {
        return Err(Failure::Usage("--device cpu: only Vulkan devices are measured".into()));
    }
    let device = gpu::Device::open(common)?;
    let gpu = device.gpu();
    // What is measured is repeated: the memory of one repetition waits for the next.
    Ok(gpu.with_pool(gpu.report().memory / 4))
}

/// The shapes that kernels have on the device that `--device` names.
pub fn shapes(common: &Common) -> Outcome<Shapes> {
    let gpu = Gpu::new(&GpuOptions { device: common.device.clone(), trust: true, ..GpuOptions::default() })?;
    Shapes::of(common, gpu.report())
}

/// The engine that `--device` names: the best Vulkan device without one.
pub fn open(common: &Common) -> Outcome<Box<dyn Engine>> {
    if !common.means_cpu() {
        return Ok(Box::new(gpu::Device::open(common)?));
    }
    if common.target.is_some() && std::env::var_os("OLBVH_TARGET").is_none() {
        return Err(Failure::Usage("--target shapes the kernels of Vulkan devices; --device cpu has none".into()));
    }
    Ok(Box::new(cpu::Cpu))
}
