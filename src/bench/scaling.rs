//! Time per item as a function of the size of the mesh, which shows what a larger problem costs beyond its size.

use super::mesh_report::MeshReport;
use super::quantity::Quantity;
use super::structure_report::StructureReport;
use serde::Serialize;

/// The number of tetrahedra that other sizes are related to.
const REFERENCE_TETS: f64 = 200_000.0;
/// The quantities that are reported by size.
pub(super) const QUANTITIES: [Quantity; 3] = [Quantity::Build, Quantity::LocateRandom, Quantity::LocateCoherent];

/// One measurement at one size.
#[derive(Clone, Debug, Serialize)]
pub struct Scale {
    /// The structure.
    pub structure: String,
    /// What was measured.
    pub quantity: Quantity,
    /// The mesh.
    pub mesh: String,
    /// Number of tetrahedra.
    pub tets: u32,
    /// Nanoseconds per tetrahedron built over, or per point located.
    pub ns_per_item: f64,
    /// `ns_per_item` divided by that of the mesh whose size is nearest to 200,000 tetrahedra.
    pub ratio: f64,
}

/// All measurements, by the size of their mesh.
pub(super) fn scales(meshes: &[MeshReport]) -> Vec<Scale> {
    let distance = |tets: u32| (f64::from(tets.max(1)) / REFERENCE_TETS).ln().abs();
    let reference = meshes.iter().min_by(|a, b| distance(a.tets).total_cmp(&distance(b.tets)));
    let per_item = |s: &StructureReport, quantity| s.figure(quantity)?.per_second.map(|rate| 1e9 / rate);
    let mut scales = Vec::new();
    for quantity in QUANTITIES {
        for mesh in meshes {
            for s in &mesh.structures {
                let at_reference =
                    reference.and_then(|m| m.structures.iter().find(|r| r.name == s.name)).and_then(|r| per_item(r, quantity));
                if let (Some(ns_per_item), Some(base)) = (per_item(s, quantity), at_reference) {
                    let (structure, mesh_name) = (s.name.clone(), mesh.name.clone());
                    scales.push(Scale { structure, quantity, mesh: mesh_name, tets: mesh.tets, ns_per_item, ratio: ns_per_item / base });
                }
            }
        }
    }
    scales
}

/// Unit of the time per item.
pub(super) fn unit(quantity: Quantity) -> &'static str {
    if quantity == Quantity::Build { "ns per tetrahedron" } else { "ns per point" }
}
