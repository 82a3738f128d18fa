//! The engine that computes on a Vulkan device.

use super::{Engine, OnProgress, Shapes, Sink, Summary};
use crate::common::{Common, Outcome};
use olbvh::blocks::{self, InBlocks, LocateRequest, OverlapRequest, Picture, RenderRequest, SliceRequest};
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::error::Result;
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{Mesh, fault_of};
use olbvh::options::BuildOptions;
use olbvh::query::{AllOwners, LocateOptions, Located, Nearest, Overlapped, Sliced};
use olbvh::reference::boundary::Counts;
use std::path::PathBuf;

/// An opened device, and the target of its kernels with its origin.
pub struct Device(Gpu, Shapes);

impl Device {
    /// Opens the device that `--device` names, or the best one, with the target that applies. Compiled pipelines are
    /// kept in the user's cache folder.
    pub fn open(common: &Common) -> Outcome<Self> {
        // The device is trusted here, because the self-test follows with the target that it will have.
        let options = GpuOptions { device: common.device.clone(), pipeline_cache: cache_folder(), trust: true, ..GpuOptions::default() };
        let gpu = Gpu::new(&options)?;
        let shapes = Shapes::of(common, gpu.report())?;
        let gpu = gpu.with_target(shapes.target.clone())?;
        gpu.self_test()?;
        Ok(Self(gpu, shapes))
    }

    /// Maximum number of bytes of device memory: the given number, or else the device's memory.
    fn memory(&self, given: Option<u64>) -> u64 {
        given.unwrap_or(self.0.report().memory)
    }

    /// The device, and the target of its kernels with its origin.
    pub fn into_parts(self) -> (Gpu, Shapes) {
        (self.0, self.1)
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
        self.0.report().name.clone()
    }

    fn target(&self) -> Option<&Shapes> {
        Some(&self.1)
    }

    fn summary(&self, mesh: &Mesh, options: &BuildOptions) -> Result<Summary> {
        let device = DeviceMesh::upload(&self.0, mesh, BadCells::Skip)?;
        let tree = Tree::build(&self.0, &device, options)?;
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

    fn locate(
        &self,
        asked: &LocateRequest<'_>,
        how: &LocateOptions,
        memory: Option<u64>,
        report: OnProgress<'_>,
    ) -> Result<InBlocks<Located>> {
        blocks::locate(&self.0, self.memory(memory), asked, None, how, report)
    }

    fn locate_all(
        &self,
        asked: &LocateRequest<'_>,
        tolerance: f32,
        memory: Option<u64>,
        report: OnProgress<'_>,
    ) -> Result<InBlocks<AllOwners>> {
        blocks::locate_all(&self.0, self.memory(memory), asked, tolerance, report)
    }

    fn nearest(&self, asked: &LocateRequest<'_>, within: f32, memory: Option<u64>, report: OnProgress<'_>) -> Result<InBlocks<Nearest>> {
        blocks::nearest(&self.0, self.memory(memory), asked, within, report)
    }

    fn overlap(&self, asked: &OverlapRequest<'_>, memory: Option<u64>, report: OnProgress<'_>) -> Result<InBlocks<Overlapped>> {
        blocks::overlap(&self.0, self.memory(memory), asked, report)
    }

    fn render(&self, asked: &RenderRequest<'_>, memory: Option<u64>, report: OnProgress<'_>) -> Result<InBlocks<Picture>> {
        blocks::render(&self.0, self.memory(memory), asked, report)
    }

    fn slice(&self, asked: &SliceRequest<'_>, memory: Option<u64>, report: OnProgress<'_>, sink: Sink<'_>) -> Result<InBlocks<Sliced>> {
        blocks::slice(&self.0, self.memory(memory), asked, report, sink)
    }
}
