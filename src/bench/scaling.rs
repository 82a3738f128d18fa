//! Time per item over the size of the mesh: what a larger problem costs beyond its size.

use super::mesh_report::MeshReport;
use super::quantity::Quantity;
use super::structure_report::StructureReport;
use serde::Serialize;

/// The size that others are related to.
const REFERENCE_TETS: f64 = 200_000.0;
/// What is told by size.
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
    /// Its tetrahedra.
    pub tets: u32,
    /// Nanoseconds per tetrahedron built over, or per point located.
    pub ns_per_item: f64,
    /// That by the one of the mesh nearest to 200,000 tetrahedra.
    pub ratio: f64,
}

/// Every measurement by the size of its mesh.
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

/// Of time per item.
pub(super) fn unit(quantity: Quantity) -> &'static str {
    if quantity == Quantity::Build { "ns per tetrahedron" } else { "ns per point" }
}
