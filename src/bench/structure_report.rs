//! Every figure of one structure over a mesh.

use super::copy::CopyRate;
use super::measure::Timing;
use super::quantity::Quantity;
use super::structure::{Kind, Structure};
use super::subject::Subject;
use super::traffic::traffic;
use crate::baseline::RayMethod;
use crate::gpu::StageTime;
use serde::Serialize;

/// One measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// What was measured.
    pub quantity: Quantity,
    /// Repetitions and times.
    #[serde(flatten)]
    pub timing: Timing,
    /// Tetrahedra built over, points located, samples found in the mesh, voxels; `None` where nothing is counted.
    pub items: Option<u64>,
    /// Items per second of the median.
    pub per_second: Option<f64>,
    /// How many times as fast as the LBVH, by the medians.
    pub speedup: Option<f64>,
}

impl Figure {
    pub(super) fn new(quantity: Quantity, timing: Timing, items: Option<u64>) -> Self {
        let per_second = items.map(|n| n as f64 / timing.milliseconds() * 1e3);
        Self { quantity, timing, items, per_second, speedup: None }
    }

    /// What tables and plots show: millions per second, or milliseconds.
    pub fn shown(&self) -> f64 {
        if self.quantity.is_rate() { self.per_second.unwrap_or(0.0) * 1e-6 } else { self.timing.milliseconds() }
    }
}

/// Bytes of a structure.
#[derive(Clone, Debug, Serialize)]
pub struct MemoryFigures {
    /// All of it.
    pub total: u64,
    /// By array.
    pub arrays: Vec<(&'static str, u64)>,
    /// As the paper's Table 2 counts an octree: boxes, but no PO.
    pub paper: Option<u64>,
    /// Of an acceleration structure before compaction.
    pub before_compaction: Option<u64>,
    /// Scratch memory of the construction, where it is known.
    pub scratch: Option<u64>,
}

/// Points that a structure did not find though a cell holds them.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Lost {
    /// So many.
    pub points: u64,
    /// Of so many.
    pub of: u64,
}

/// A structure over a mesh.
#[derive(Clone, Debug, Serialize)]
pub struct StructureReport {
    /// Its name in tables.
    pub name: String,
    /// `olbvh`, `lbvh`, `ray_query` or `ray_pipeline`.
    pub kind: &'static str,
    /// The paper's α.
    pub alpha: Option<u8>,
    /// How primitives are assigned to leaves.
    pub assign: Option<&'static str>,
    /// Which leaves list all of their primitives.
    pub lists: Option<&'static str>,
    /// Level of the leaves.
    pub level: Option<u32>,
    /// Entries of all leaves.
    pub entries: Option<u32>,
    /// Nodes.
    pub nodes: Option<u32>,
    /// Bytes.
    pub memory: MemoryFigures,
    /// Points that rays lost.
    pub lost: Option<Lost>,
    /// Measurements.
    pub figures: Vec<Figure>,
    /// Stages of the construction against the device's copy rate; of octrees only.
    pub stages: Vec<StageFigure>,
}

/// A stage of a construction, and how far it is from what the device can move.
#[derive(Clone, Debug, Serialize)]
pub struct StageFigure {
    /// Its name.
    pub stage: String,
    /// Milliseconds on the device, median; those of `mesh.` once, as it was uploaded.
    pub ms: f64,
    /// Bytes that it must read and write at least.
    pub bytes: u64,
    /// Gigabytes (10^9) per second that these bytes are.
    pub gb_per_s: f64,
    /// Part of the device's copy rate.
    pub of_copy_rate: f64,
}

impl StructureReport {
    /// Relates the stages of an octree's construction to the copy rate, where stages are timed.
    pub(super) fn set_stages(&mut self, subject: &Subject<'_>, structure: &Structure, copy: &CopyRate) {
        let Structure::Octree(tree) = structure else { return };
        let build = self.figure(Quantity::Build).map(|f| f.timing.stages_ms.clone()).unwrap_or_default();
        let stage = |(name, bytes): (&'static str, u64)| {
            let ms = build.get(name).copied().unwrap_or_else(|| StageTime::sum(subject.device.stages().iter().filter(|s| s.name == name)));
            let gb_per_s = bytes as f64 / ms * 1e-6;
            (ms > 0.0).then(|| StageFigure { stage: name.into(), ms, bytes, gb_per_s, of_copy_rate: gb_per_s / copy.gb_per_s })
        };
        self.stages = traffic(&subject.device, tree, subject.gpu.target()).into_iter().filter_map(stage).collect();
    }

    pub(super) fn new(kind: Kind, structure: &Structure, lost: Option<Lost>) -> Self {
        let (alpha, assign, lists) = match kind {
            Kind::Octree { alpha, assign, lists } => (Some(alpha), Some(assign.name()), Some(lists.name())),
            _ => (None, None, None),
        };
        let plain = |total, arrays| MemoryFigures { total, arrays, paper: None, before_compaction: None, scratch: None };
        let (name, memory, status) = match structure {
            Structure::Octree(tree) => {
                let memory = plain(tree.sizes().total(), tree.sizes().arrays().to_vec());
                let memory = MemoryFigures { paper: Some(tree.sizes().paper()), scratch: Some(tree.scratch_bytes()), ..memory };
                ("olbvh", memory, Some(tree.status()))
            }
            Structure::Lbvh(lbvh) => ("lbvh", plain(lbvh.bytes(), vec![("nodes and ids", lbvh.bytes())]), None),
            Structure::Rays(rays) => {
                let built = rays.structure();
                let arrays = vec![("structure", built.bytes()), ("sides", rays.bytes() - built.bytes())];
                let memory = plain(rays.bytes(), arrays);
                let scratch = Some(built.scratch_bytes());
                let name = if kind == Kind::Rays(RayMethod::Pipeline) { "ray_pipeline" } else { "ray_query" };
                (name, MemoryFigures { before_compaction: Some(built.built_bytes()), scratch, ..memory }, None)
            }
        };
        let (level, entries, nodes) = (status.map(|s| s.level), status.map(|s| s.entries), status.map(|s| s.nodes));
        Self {
            name: kind.to_string(),
            kind: name,
            alpha,
            assign,
            lists,
            level,
            entries,
            nodes,
            memory,
            lost,
            figures: Vec::new(),
            stages: Vec::new(),
        }
    }

    /// The measurement of a quantity.
    pub fn figure(&self, quantity: Quantity) -> Option<&Figure> {
        self.figures.iter().find(|f| f.quantity == quantity)
    }
}
