//! Every figure of a run.

use super::scaling::scales;
use super::structure::Structure;
use super::subject::{Subject, corners, volume};
use super::traffic::traffic;
use super::{CopyRate, Kind, Scale, Settings, Suite, Timing};
use crate::baseline::RayMethod;
use crate::error::Result;
use crate::gpu::{Gpu, StageTime};
use crate::kernels::Target;
use glam::DVec3;
use serde::Serialize;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Construction.
    Build,
    /// Ray intervals of a picture.
    Intervals,
    /// March of a picture, counting the samples in the mesh.
    March,
    /// Conservative slicing.
    Slice,
    /// Overlap with the moved mesh.
    Overlap,
    /// Location of points in no order.
    LocateRandom,
    /// Location of points along a Z curve.
    LocateCoherent,
    /// Location of the samples of a picture, each by itself.
    LocateSamples,
    /// Location of points in no order by the paper's traversal.
    TraverseRandom,
    /// Location of points along a Z curve by the paper's traversal.
    TraverseCoherent,
}

impl Quantity {
    /// All, in the paper's order.
    pub const ALL: [Self; 10] = [
        Self::Build,
        Self::Intervals,
        Self::March,
        Self::LocateSamples,
        Self::Slice,
        Self::Overlap,
        Self::LocateRandom,
        Self::LocateCoherent,
        Self::TraverseRandom,
        Self::TraverseCoherent,
    ];

    /// The same points, located by the paper's traversal.
    pub(super) fn traversed(self) -> Option<Self> {
        match self {
            Self::LocateRandom => Some(Self::TraverseRandom),
            Self::LocateCoherent => Some(Self::TraverseCoherent),
            _ => None,
        }
    }

    /// Title of a table, with the paper's.
    pub fn title(self) -> &'static str {
        match self {
            Self::Build => "Construction (Fig. 6)",
            Self::Intervals => "Ray intervals (Table 3)",
            Self::March => "Samples inside the mesh, ray marching (Fig. 7)",
            Self::Slice => "Conservative slicing (Fig. 8)",
            Self::Overlap => "Overlap with the moved mesh (Fig. 10)",
            Self::LocateRandom => "Point location, random points",
            Self::LocateCoherent => "Point location, points along a Z curve",
            Self::LocateSamples => "Samples inside the mesh, each located by itself (Fig. 7)",
            Self::TraverseRandom => "Point location by the paper's traversal, random points",
            Self::TraverseCoherent => "Point location by the paper's traversal, points along a Z curve",
        }
    }

    /// Name of a file.
    pub fn stem(self) -> &'static str {
        match self {
            Self::Build => "fig06_construction",
            Self::Intervals => "table3_ray_intervals",
            Self::March => "fig07_samples",
            Self::Slice => "fig08_slicing",
            Self::Overlap => "fig10_overlap",
            Self::LocateRandom => "location_random",
            Self::LocateCoherent => "location_coherent",
            Self::LocateSamples => "fig07_samples_located",
            Self::TraverseRandom => "location_random_traversal",
            Self::TraverseCoherent => "location_coherent_traversal",
        }
    }

    /// Whether it is told in items per second, not in milliseconds.
    pub fn is_rate(self) -> bool {
        !matches!(self, Self::Build | Self::Intervals | Self::Slice | Self::Overlap)
    }
}

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

/// Shape of the cells, as the paper's Table 1.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Quality {
    /// Largest volume over smallest.
    pub volume_ratio: f64,
    /// Inradius over circumradius: smallest, median, largest; 1/3 is regular.
    pub aspect: [f64; 3],
}

impl Quality {
    fn of(subject: &Subject<'_>) -> Self {
        let mut aspects: Vec<f64> = corners(subject.mesh).map(aspect).collect();
        aspects.sort_by(f64::total_cmp);
        let at = |i: usize| aspects.get(i).copied().unwrap_or(f64::NAN);
        let ends = corners(subject.mesh).map(volume).fold([f64::INFINITY, 0.0], |[lo, hi], v| [lo.min(v), hi.max(v)]);
        Self { volume_ratio: ends[1] / ends[0], aspect: [at(0), at(aspects.len() / 2), at(aspects.len().saturating_sub(1))] }
    }
}

/// Inradius over circumradius.
fn aspect(p: [[f64; 3]; 4]) -> f64 {
    let v = p.map(DVec3::from_array);
    let [a, b, c] = [v[1] - v[0], v[2] - v[0], v[3] - v[0]];
    let six_volumes = a.cross(b).dot(c).abs();
    let faces = [a.cross(b), b.cross(c), c.cross(a), (v[2] - v[1]).cross(v[3] - v[1])];
    let double_area: f64 = faces.iter().map(|n| n.length()).sum();
    let around = (a.length_squared() * b.cross(c) + b.length_squared() * c.cross(a) + c.length_squared() * a.cross(b)).length();
    if around > 0.0 { 2.0 * six_volumes * six_volumes / (double_area * around) } else { 0.0 }
}

/// All structures over a mesh.
#[derive(Clone, Debug, Serialize)]
pub struct MeshReport {
    /// File or name.
    pub name: String,
    /// Tetrahedra.
    pub tets: u32,
    /// Points.
    pub points: u32,
    /// Boundary tetrahedra.
    pub boundary: u32,
    /// Shape of the cells.
    pub quality: Quality,
    /// Milliseconds for bounds, neighbours and boundary, once per mesh, whatever the structure.
    pub topology_ms: f64,
    /// The structures.
    pub structures: Vec<StructureReport>,
    /// Structures that were not measured, and why.
    pub skipped: Vec<(String, String)>,
}

impl MeshReport {
    pub(super) fn new(name: &str, subject: &Subject<'_>) -> Self {
        let (input, status) = (subject.device.input(), subject.device.status());
        Self {
            name: name.into(),
            tets: input.tets,
            points: input.points,
            boundary: status.boundary,
            quality: Quality::of(subject),
            topology_ms: StageTime::sum(subject.device.stages()),
            structures: Vec::new(),
            skipped: Vec::new(),
        }
    }

    pub(super) fn skip(&mut self, kind: Kind, why: &str, progress: &dyn Fn(&str)) {
        progress(&format!("{}: {kind}: not measured: {why}", self.name));
        self.skipped.push((kind.to_string(), why.into()));
    }

    /// The LBVH over this mesh.
    pub fn lbvh(&self) -> Option<&StructureReport> {
        self.structures.iter().find(|s| s.kind == "lbvh")
    }

    /// Relates every measurement to that of the LBVH.
    pub(super) fn set_ratios(&mut self) {
        let baseline: Vec<(Quantity, f64)> =
            self.lbvh().map_or(Vec::new(), |lbvh| lbvh.figures.iter().map(|f| (f.quantity, f.timing.milliseconds())).collect());
        for figure in self.structures.iter_mut().flat_map(|s| &mut s.figures) {
            let lbvh = baseline.iter().find(|b| b.0 == figure.quantity);
            figure.speedup = lbvh.map(|b| b.1 / figure.timing.milliseconds());
        }
    }
}

/// Where it ran.
#[derive(Clone, Debug, Serialize)]
pub struct DeviceFacts {
    /// Name.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// Highest API version.
    pub api: String,
    /// discrete, integrated, virtual, cpu, other.
    pub kind: &'static str,
    /// Subgroup size.
    pub subgroup: u32,
    /// Whether it has ray queries.
    pub ray_query: bool,
    /// Whether it has ray-tracing pipelines.
    pub ray_pipeline: bool,
    /// Name of the shapes of the kernels.
    pub target: String,
    /// The shapes themselves.
    pub tunables: Target,
    /// How kernels get their buffers.
    pub binding: String,
}

/// A whole run.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Version of this crate.
    pub version: &'static str,
    /// Commit of the sources, where known.
    pub commit: Option<String>,
    /// The suite.
    pub suite: Suite,
    /// Sizes of the questions.
    pub settings: Settings,
    /// The device.
    pub device: DeviceFacts,
    /// How fast it copies.
    pub copy: CopyRate,
    /// Time per item over the size of the mesh; of the suite `scaling` only.
    pub scaling: Vec<Scale>,
    /// The meshes.
    pub meshes: Vec<MeshReport>,
}

impl Report {
    /// A report without meshes; measures how fast the device copies.
    ///
    /// # Errors
    /// As [`CopyRate::measure`].
    pub fn new(gpu: &Gpu, suite: Suite, settings: Settings, commit: Option<String>) -> Result<Self> {
        let report = gpu.report();
        let device = DeviceFacts {
            name: report.name.clone(),
            driver: report.driver.clone(),
            api: report.api.clone(),
            kind: report.kind,
            subgroup: report.subgroup,
            ray_query: report.requirements.ray_tracing.queries,
            ray_pipeline: report.requirements.ray_tracing.pipelines,
            target: gpu.target().name.to_string(),
            tunables: gpu.target().clone(),
            binding: format!("{:?}", gpu.binding()).to_lowercase(),
        };
        let (copy, scaling, meshes) = (CopyRate::measure(gpu)?, Vec::new(), Vec::new());
        Ok(Self { version: env!("CARGO_PKG_VERSION"), commit, suite, settings, device, copy, scaling, meshes })
    }

    /// Adds a mesh.
    pub fn push(&mut self, mesh: MeshReport) {
        self.meshes.push(mesh);
        if self.suite == Suite::Scaling {
            self.scaling = scales(self);
        }
    }
}
