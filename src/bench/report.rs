//! The report of a whole run: the device and all figures.

use super::copy::CopyRate;
use super::mesh_report::MeshReport;
use super::scaling::{Scale, scales};
use super::suite::{Settings, Suite};
use crate::error::Result;
use crate::gpu::{Gpu, Target};
use serde::Serialize;

/// The device of a run.
#[derive(Clone, Debug, Serialize)]
pub struct DeviceFacts {
    /// Name of the device.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Highest API version.
    pub api: String,
    /// Kind of device: discrete, integrated, virtual, cpu, other.
    pub kind: &'static str,
    /// Subgroup size.
    pub subgroup: u32,
    /// Whether it has ray queries.
    pub ray_query: bool,
    /// Whether it has ray-tracing pipelines.
    pub ray_pipeline: bool,
    /// Name of the target of the kernels.
    pub target: String,
    /// The target itself.
    pub tunables: Target,
    /// How kernels receive their buffers.
    pub binding: String,
}

/// The report of a whole run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of this crate.
    pub version: &'static str,
    /// Commit of the sources, where known.
    pub commit: Option<String>,
    /// The suite.
    pub suite: Suite,
    /// Sizes of the queries.
    pub settings: Settings,
    /// The device.
    pub device: DeviceFacts,
    /// How fast the device copies.
    pub copy: CopyRate,
    /// Time per item over the size of the mesh; only for the suite `scaling`.
    pub scaling: Vec<Scale>,
    /// The meshes.
    pub meshes: Vec<MeshReport>,
    /// Why meshes were not measured; each text begins with the mesh.
    pub failed: Vec<String>,
}

impl Report {
    /// Makes a report without meshes, and measures how fast the device copies.
    ///
    /// # Errors
    /// As [`CopyRate::measure`].
    pub fn new(gpu: &Gpu, suite: Suite, settings: Settings, commit: Option<String>) -> Result<Self> {
        let report = gpu.report();
        let device = DeviceFacts {
            name: report.name.clone(),
            driver: report.driver.clone(),
            api: report.api.clone(),
            kind: report.kind.name(),
            subgroup: report.subgroup,
            ray_query: report.requirements.ray_tracing.queries,
            ray_pipeline: report.requirements.ray_tracing.pipelines,
            target: gpu.target().name.to_string(),
            tunables: gpu.target().clone(),
            binding: format!("{:?}", gpu.binding()).to_lowercase(),
        };
        let (copy, version) = (CopyRate::measure(gpu)?, env!("CARGO_PKG_VERSION"));
        Ok(Self { version, commit, suite, settings, device, copy, scaling: Vec::new(), meshes: Vec::new(), failed: Vec::new() })
    }

    /// Adds a mesh.
    pub fn push(&mut self, mesh: MeshReport) {
        self.meshes.push(mesh);
        if self.suite == Suite::Scaling {
            self.scaling = scales(&self.meshes);
        }
    }
}
