//! All figures of one structure over a mesh.

use super::copy::CopyRate;
use super::measure::Timing;
use super::quantity::Quantity;
use super::structure::{Kind, Structure};
use super::subject::Subject;
use super::traffic::traffic;
use crate::baseline::RayMethod;
use serde::Serialize;

/// One measurement.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// What was measured.
    pub quantity: Quantity,
    /// Repetitions and times.
    #[serde(flatten)]
    pub timing: Timing,
    /// Number of items: tetrahedra built over, points located, samples found in the mesh, or voxels; `None` if nothing
    /// is counted.
    pub items: Option<u64>,
    /// Items per second, from the median time.
    pub per_second: Option<f64>,
    /// Ratio of the median time of the LBVH to this one.
    pub speedup: Option<f64>,
}

impl Figure {
    pub(super) fn new(quantity: Quantity, timing: Timing, items: Option<u64>) -> Self {
        let per_second = items.map(|n| n as f64 / timing.milliseconds() * 1e3);
        Self { quantity, timing, items, per_second, speedup: None }
    }

    /// The number that tables and plots show: millions per second, or milliseconds.
    pub fn shown(&self) -> f64 {
        if self.quantity.is_rate() { self.per_second.unwrap_or(0.0) * 1e-6 } else { self.timing.milliseconds() }
    }
}

/// Memory of a structure in bytes.
#[derive(Clone, Debug, Serialize)]
pub struct MemoryFigures {
    /// Total.
    pub total: u64,
    /// Bytes of each array.
    pub arrays: Vec<(&'static str, u64)>,
    /// For an octree, bytes as the paper's Table 2 counts them: with boxes, without PO.
    pub paper: Option<u64>,
    /// For an acceleration structure, bytes before compaction.
    pub before_compaction: Option<u64>,
    /// Scratch memory of the construction, where it is known.
    pub scratch: Option<u64>,
}

/// Points that a structure did not find although a tetrahedron contains them.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Lost {
    /// Number of lost points.
    pub points: u64,
    /// Number of points that lie in the mesh.
    pub of: u64,
}

/// The report about one structure over a mesh.
#[derive(Clone, Debug, Serialize)]
pub struct StructureReport {
    /// Its name in tables.
    pub name: String,
    /// `olbvh`, `lbvh`, `ray_query` or `ray_pipeline`.
    pub kind: &'static str,
    /// The paper's α.
    pub alpha: Option<u8>,
    /// How tetrahedra are assigned to leaves.
    pub assign: Option<&'static str>,
    /// Which leaves list all of their tetrahedra.
    pub lists: Option<&'static str>,
    /// Level of the leaves.
    pub level: Option<u32>,
    /// Number of entries.
    pub entries: Option<u32>,
    /// Number of nodes.
    pub nodes: Option<u32>,
    /// Memory of the structure.
    pub memory: MemoryFigures,
    /// Points that rays lost.
    pub lost: Option<Lost>,
    /// Measurements.
    pub figures: Vec<Figure>,
    /// Stages of the construction, compared with the device's copy rate; for octrees only.
    pub stages: Vec<StageFigure>,
}

/// A stage of a construction, compared with what the device can move.
#[derive(Clone, Debug, Serialize)]
pub struct StageFigure {
    /// Name of the stage.
    pub stage: String,
    /// Median of the milliseconds on the device; for stages of `mesh.`, of all structures together.
    pub ms: f64,
    /// Bytes that the stage must read and write at least.
    pub bytes: u64,
    /// Gigabytes (10^9 bytes) per second that this amounts to.
    pub gb_per_s: f64,
    /// This rate as a fraction of the device's copy rate.
    pub of_copy_rate: f64,
}

impl StructureReport {
    /// Compares the stages of an octree's construction with the copy rate, if stages are timed.
    pub(super) fn set_stages(&mut self, subject: &Subject<'_>, structure: &Structure, copy: &CopyRate) {
        let Structure::Octree(tree) = structure else { return };
        let mut times = subject.topology.stages_ms.clone();
        times.extend(self.figure(Quantity::Build).map(|f| f.timing.stages_ms.clone()).unwrap_or_default());
        let stage = |(name, bytes): (&'static str, u64)| {
            let ms = times.get(name).copied().unwrap_or(0.0);
            let gb_per_s = bytes as f64 / ms * 1e-6;
            (ms > 0.0).then(|| StageFigure { stage: name.into(), ms, bytes, gb_per_s, of_copy_rate: gb_per_s / copy.gb_per_s })
        };
        self.stages = traffic(&subject.device, tree, subject.gpu.target()).into_iter().filter_map(stage).collect();
    }

    pub(super) fn new(kind: Kind, structure: &Structure, lost: Option<Lost>) -> Self {
        let alpha = if let Kind::Octree { alpha, .. } = kind { Some(alpha) } else { None };
        let (assign, lists) = kind.lists().map(|(assign, lists)| (assign.name(), lists.name())).unzip();
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
