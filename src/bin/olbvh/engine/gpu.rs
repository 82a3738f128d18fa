//! The engine that computes on a Vulkan device.

use super::{Engine, OnProgress, Shapes, Sink, Summary};
use crate::common::{Common, Outcome};
use olbvh::blocks::{self, Cost, LocateRequest, OverlapRequest, Picture, RenderRequest, SliceRequest};
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::error::Result;
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{Mesh, fault_of};
use olbvh::options::BuildOptions;
use olbvh::query::{AllOwners, LocateOptions, Located, Nearest, Overlapped, Sliced};
use olbvh::reference::boundary::Counts;
use std::path::PathBuf;

/// An opened device.
pub struct Device {
    gpu: Gpu,
    /// The target of its kernels, and where it comes from.
    shapes: Shapes,
    /// Maximum number of bytes of device memory for a query.
    memory: u64,
}

impl Device {
    /// Opens the device that `--device` names, or the best one, with the target that applies. Compiled pipelines are
    /// kept in the user's cache folder. Without a limit of `memory`, queries may use that of the device.
    pub fn open(common: &Common, memory: Option<u64>) -> Outcome<Self> {
        // The device is trusted here, because the self-test follows with the target that it will have.
        let options = GpuOptions { device: common.device.clone(), pipeline_cache: cache_folder(), trust: true, ..GpuOptions::default() };
        let gpu = Gpu::new(&options)?;
        let shapes = Shapes::of(common, gpu.report())?;
        let gpu = gpu.with_target(shapes.target.clone())?;
        gpu.self_test()?;
        let memory = memory.unwrap_or(gpu.report().memory);
        Ok(Self { gpu, shapes, memory })
    }

    /// A handle for one query, which counts its memory.
    fn limited(&self) -> Gpu {
        self.gpu.with_memory(self.memory)
    }

    /// The device, and the target of its kernels with its origin.
    pub fn into_parts(self) -> (Gpu, Shapes) {
        (self.gpu, self.shapes)
    }
}

/// The user's cache folder of this program.
fn cache_folder() -> Option<PathBuf> {
    let folder =
        std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from).or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")))?;
    Some(folder.join("olbvh"))
}

impl Engine for Device {
    fn name(&self) -> String {
        self.gpu.report().name.clone()
    }

    fn target(&self) -> Option<&Shapes> {
        Some(&self.shapes)
    }

    fn summary(&self, mesh: &Mesh, options: &BuildOptions) -> Result<Summary> {
        let device = DeviceMesh::upload(&self.gpu, mesh, BadCells::Skip)?;
        let tree = Tree::build(&self.gpu, &device, options)?;
        let (cells, built) = (device.status(), tree.status());
        let bad = if cells.bad == 0 { Vec::new() } else { device.bad_cells()? };
        Ok(Summary {
            counts: Counts {
                cells: device.input().tets,
                bad: cells.bad,
                boundary: cells.boundary,
                negative: cells.negative,
                flat: cells.zero_volume,
                crowded: cells.crowded,
                branched: cells.branched,
            },
            bad: bad.into_iter().filter_map(|t| Some((t, fault_of(mesh, t)?))).collect(),
            bounds: tree.grid().into(),
            graded: tree.grid().graded != 0,
            level: built.level,
            wanted: built.wanted_level,
            entries: u64::from(built.entries),
            nodes: u64::from(built.nodes),
            leaves: u64::from(built.leaves),
            memory: tree.sizes(),
            paper_bytes: tree.sizes().paper(),
            neighbour_bytes: device.neighbour_bytes(),
            topology_ms: device.times().total(),
            build_ms: tree.times().total(),
            stages: device.times().stages.iter().chain(&tree.times().stages).map(|s| (s.name.clone(), s.milliseconds)).collect(),
        })
    }

    fn locate(&self, asked: &LocateRequest<'_>, how: &LocateOptions, report: OnProgress<'_>) -> Result<(Located, Cost)> {
        blocks::locate(&self.limited(), asked, how, report)
    }

    fn locate_all(&self, asked: &LocateRequest<'_>, tolerance: f32, report: OnProgress<'_>) -> Result<(AllOwners, Cost)> {
        blocks::locate_all(&self.limited(), asked, tolerance, report)
    }

    fn nearest(&self, asked: &LocateRequest<'_>, within: f32, report: OnProgress<'_>) -> Result<(Nearest, Cost)> {
        blocks::nearest(&self.limited(), asked, within, report)
    }

    fn overlap(&self, asked: &OverlapRequest<'_>, report: OnProgress<'_>) -> Result<(Overlapped, Cost)> {
        blocks::overlap(&self.limited(), asked, report)
    }

    fn render(&self, asked: &RenderRequest<'_>, report: OnProgress<'_>) -> Result<(Picture, Cost)> {
        blocks::render(&self.limited(), asked, report)
    }

    fn slice(&self, asked: &SliceRequest<'_>, report: OnProgress<'_>, sink: Sink<'_>) -> Result<(Sliced, Cost)> {
        blocks::slice(&self.limited(), asked, report, sink)
    }
}
