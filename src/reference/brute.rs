//! Point location without a tree, by testing every tetrahedron: the oracle for the rest of the reference
//! implementation.

use super::boundary::Topology;
use super::tet::{Tet, Vec3};
use crate::mesh::Mesh;

/// Every valid tetrahedron that contains `p`, ascending; the first is the owner.
pub fn owners(mesh: &Mesh, topology: &Topology, normalised: &[Vec3], p: [f32; 3]) -> Vec<u32> {
    let x = topology.grid.normalise(p);
    let inside = |&t: &u32| topology.is_valid(t) && Tet::new(mesh.tets[t as usize], normalised).weights(x).inside;
    (0..mesh.tets.len() as u32).filter(inside).collect()
}
