//! All figures of one mesh: its tetrahedra, and all structures over it.

use super::measure::Timing;
use super::quantity::Quantity;
use super::structure::Kind;
use super::structure_report::StructureReport;
use super::subject::{Subject, corners, volume};
use glam::DVec3;
use serde::Serialize;

/// Shape of the tetrahedra, as in the paper's Table 1.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Quality {
    /// Largest volume divided by the smallest.
    pub volume_ratio: f64,
    /// Inradius divided by circumradius: smallest, median, largest; 1/3 is a regular tetrahedron.
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

/// Inradius of a tetrahedron divided by its circumradius.
fn aspect(p: [[f64; 3]; 4]) -> f64 {
    let v = p.map(DVec3::from_array);
    let [a, b, c] = [v[1] - v[0], v[2] - v[0], v[3] - v[0]];
    let six_volumes = a.cross(b).dot(c).abs();
    let faces = [a.cross(b), b.cross(c), c.cross(a), (v[2] - v[1]).cross(v[3] - v[1])];
    let double_area: f64 = faces.iter().map(|n| n.length()).sum();
    let around = (a.length_squared() * b.cross(c) + b.length_squared() * c.cross(a) + c.length_squared() * a.cross(b)).length();
    if around > 0.0 { 2.0 * six_volumes * six_volumes / (double_area * around) } else { 0.0 }
}

/// The report about a mesh and all structures over it.
#[derive(Clone, Debug, Serialize)]
pub struct MeshReport {
    /// Name of the mesh or its file.
    pub name: String,
    /// Number of tetrahedra.
    pub tets: u32,
    /// Number of points.
    pub points: u32,
    /// Number of boundary tetrahedra.
    pub boundary: u32,
    /// Shape of the tetrahedra.
    pub quality: Quality,
    /// Milliseconds for bounds, neighbours and boundary, which are computed once per mesh for all structures: the median
    /// of `topology`.
    pub topology_ms: f64,
    /// Times of these.
    pub topology: Timing,
    /// The structures.
    pub structures: Vec<StructureReport>,
    /// Structures that were not measured, and why.
    pub skipped: Vec<(String, String)>,
}

impl MeshReport {
    pub(super) fn new(subject: &Subject<'_>) -> Self {
        let (input, status) = (subject.device.input(), subject.device.status());
        Self {
            name: subject.name.into(),
            tets: input.tets,
            points: input.points,
            boundary: status.boundary,
            quality: Quality::of(subject),
            topology_ms: subject.topology.milliseconds(),
            topology: subject.topology.clone(),
            structures: Vec::new(),
            skipped: Vec::new(),
        }
    }

    pub(super) fn skip(&mut self, kind: Kind, why: &str, progress: &dyn Fn(&str)) {
        progress(&format!("{}: {kind}: not measured: {why}", self.name));
        self.skipped.push((kind.to_string(), why.into()));
    }

    /// The report of the LBVH over this mesh.
    pub fn lbvh(&self) -> Option<&StructureReport> {
        self.structures.iter().find(|s| s.kind == "lbvh")
    }

    /// Sets the ratio of every measurement to that of the LBVH.
    pub(super) fn set_ratios(&mut self) {
        let baseline: Vec<(Quantity, f64)> =
            self.lbvh().map_or(Vec::new(), |lbvh| lbvh.figures.iter().map(|f| (f.quantity, f.timing.milliseconds())).collect());
        for figure in self.structures.iter_mut().flat_map(|s| &mut s.figures) {
            let lbvh = baseline.iter().find(|b| b.0 == figure.quantity);
            figure.speedup = lbvh.map(|b| b.1 / figure.timing.milliseconds());
        }
    }
}
