//! The interface between the subcommands and the Vulkan device or CPU that computes.

mod cpu;
mod gpu;
mod shapes;

pub use shapes::{Origin, Shapes};

use crate::common::{Common, Failure, Outcome};
use olbvh::blocks::{Cost, LocateRequest, OverlapRequest, Picture, RenderRequest, SliceRequest};
use olbvh::error::Result;
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{Bounds, Fault, Mesh};
use olbvh::options::BuildOptions;
use olbvh::query::{AllOwners, LocateOptions, Located, Nearest, Overlapped, Sliced};
use olbvh::reference::boundary::Counts;
use olbvh::slicing::Band;
use olbvh::tree::TreeBytes;

/// Receives progress: how much of how much is done.
pub type OnProgress<'a> = &'a (dyn Fn(u64, u64) -> Result<()> + Sync);

/// Receives the bands of a stack of slices.
pub type Sink<'a> = &'a mut dyn FnMut(Band) -> Result<()>;

/// Builds and queries trees.
pub trait Engine {
    /// The name of the engine in results.
    fn name(&self) -> String;
    /// The target of its kernels and where it comes from; `None` if it has no kernels.
    fn target(&self) -> Option<&Shapes>;
    /// Marks the boundary, builds the tree, and reports the properties of both.
    fn summary(&self, mesh: &Mesh, options: &BuildOptions) -> Result<Summary>;
    /// Builds a tree over a mesh and finds the owner and barycentric coordinates of each point.
    fn locate(&self, asked: &LocateRequest<'_>, how: &LocateOptions, report: OnProgress<'_>) -> Result<(Located, Cost)>;
    /// Builds a tree over a mesh and finds every tetrahedron that contains each point.
    fn locate_all(&self, asked: &LocateRequest<'_>, tolerance: f32, report: OnProgress<'_>) -> Result<(AllOwners, Cost)>;
    /// Builds a tree over a mesh and finds the place of its surface that is closest to each point, at most `within` away.
    fn nearest(&self, asked: &LocateRequest<'_>, within: f32, report: OnProgress<'_>) -> Result<(Nearest, Cost)>;
    /// Builds a tree over each of two meshes and finds where they overlap.
    fn overlap(&self, asked: &OverlapRequest<'_>, report: OnProgress<'_>) -> Result<(Overlapped, Cost)>;
    /// Builds a tree over a mesh and draws a field.
    fn render(&self, asked: &RenderRequest<'_>, report: OnProgress<'_>) -> Result<(Picture, Cost)>;
    /// Builds a tree over a mesh and slices it, band by band into `sink`.
    fn slice(&self, asked: &SliceRequest<'_>, report: OnProgress<'_>, sink: Sink<'_>) -> Result<(Sliced, Cost)>;
}

/// Figures about a mesh and its tree.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Number of tetrahedra of each kind.
    pub counts: Counts,
    /// Invalid tetrahedra of the mesh, with the reason.
    pub bad: Vec<(u32, Fault)>,
    /// Bounds of the valid tetrahedra, relative to the mesh's origin.
    pub bounds: Bounds,
    /// Whether cells of the tree are smaller where there are more tetrahedra.
    pub graded: bool,
    /// Level of the leaves.
    pub level: u32,
    /// Level that alpha or the options ask for.
    pub wanted: u32,
    /// Number of entries.
    pub entries: u64,
    /// Number of nodes.
    pub nodes: u64,
    /// Number of leaves.
    pub leaves: u64,
    /// Bytes of each array.
    pub memory: TreeBytes,
    /// Bytes by the paper's formula.
    pub paper_bytes: u64,
    /// Bytes of the neighbour table, which belongs to the mesh, not to the tree.
    pub neighbour_bytes: u64,
    /// Milliseconds to find neighbours and boundary.
    pub topology_ms: f64,
    /// Milliseconds to build the tree.
    pub build_ms: f64,
    /// Milliseconds of each stage, in order; empty where stages are not timed.
    pub stages: Vec<(String, f64)>,
}

/// Opens the Vulkan device that `--device` names, for measurements, with its target.
pub fn device(common: &Common) -> Outcome<(Gpu, Shapes)> {
    if common.means_cpu() {
        return Err(Failure::Usage("--device cpu: only Vulkan devices are measured".into()));
    }
    let (gpu, shapes) = gpu::Device::open(common, None)?.into_parts();
    // Measurements are repeated, so the pool keeps the memory of one repetition for the next.
    Ok((gpu.with_pool(gpu.report().memory / 4), shapes))
}

/// The target of the kernels on the device that `--device` names.
pub fn shapes(common: &Common) -> Outcome<Shapes> {
    let gpu = Gpu::new(&GpuOptions { device: common.device.clone(), trust: true, ..GpuOptions::default() })?;
    Shapes::of(common, gpu.report())
}

/// Opens the engine that `--device` names; without the option, the best Vulkan device. Each query may use `memory`
/// bytes of it; `None`: all it has.
pub fn open(common: &Common, memory: Option<u64>) -> Outcome<Box<dyn Engine>> {
    if !common.means_cpu() {
        return Ok(Box::new(gpu::Device::open(common, memory)?));
    }
    if memory.is_some() {
        return Err(Failure::Usage(
            "--memory: a limit of device memory; --device cpu works in the host's memory, on the whole mesh".into(),
        ));
    }
    if common.target.is_some() {
        return Err(Failure::Usage("--target: tuning parameters of kernels, which --device cpu does not have".into()));
    }
    Ok(Box::new(cpu::Cpu))
}
