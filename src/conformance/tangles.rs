//! Whether tetrahedra of a mesh overlap. Then only full lists always name the lowest-numbered tetrahedron that contains
//! a point (SPEC 3.1), so answers may differ between trees without any fault of the device.

use super::failure::Verdict;
use crate::mesh::Mesh;
use crate::options::{BuildOptions, Lists};
use crate::reference::boundary::Topology;
use crate::reference::locate::{Locator, place};
use crate::reference::vertices::Vertices;
use rayon::prelude::*;

/// Weights of the sample points of a tetrahedron: its centre, and points between that and each vertex, each edge and
/// each face.
#[rustfmt::skip]
const SAMPLES: [[f32; 4]; 15] = [
    [0.25, 0.25, 0.25, 0.25],
    [0.85, 0.05, 0.05, 0.05], [0.05, 0.85, 0.05, 0.05], [0.05, 0.05, 0.85, 0.05], [0.05, 0.05, 0.05, 0.85],
    [0.45, 0.45, 0.05, 0.05], [0.45, 0.05, 0.45, 0.05], [0.45, 0.05, 0.05, 0.45],
    [0.05, 0.45, 0.45, 0.05], [0.05, 0.45, 0.05, 0.45], [0.05, 0.05, 0.45, 0.45],
    [0.04, 0.32, 0.32, 0.32], [0.32, 0.04, 0.32, 0.32], [0.32, 0.32, 0.04, 0.32], [0.32, 0.32, 0.32, 0.04],
];

/// Two tetrahedra of a mesh that overlap, in words: both on the same side of the face that they share (a fold), or both
/// with a sample point strictly inside. `None` if there are none.
pub(super) fn overlap(mesh: &Mesh, topology: &Topology, vertices: &Vertices) -> Verdict<Option<String>> {
    let tets = || (0..mesh.tets.len() as u32).into_par_iter().filter(|&t| topology.is_valid(t));
    if let Some([s, t]) = tets().find_map_first(|t| folded(mesh, topology, vertices, t)) {
        return Ok(Some(format!("tetrahedra {s} and {t} lie on the same side of their common face")));
    }
    let full = BuildOptions { lists: Lists::All, ..BuildOptions::default() };
    let tree = crate::reference::build::build(mesh, topology, &full)?;
    let locator = Locator::new(mesh, topology, &tree);
    let twice = |t: u32| {
        let corners = mesh.tets[t as usize].map(|v| mesh.points[v as usize]);
        SAMPLES.iter().find_map(|w| {
            let p = [0, 1, 2].map(|c| (0..4).map(|i| w[i] * corners[i][c]).sum::<f32>());
            let (_, x) = place(&tree.grid, p)?;
            let clear = |&t: &u32| vertices.tet(mesh.tets[t as usize]).weights(x).clear;
            let mut inside = locator.owners(p).into_iter().filter(clear);
            Some(format!("tetrahedra {} and {} both contain {p:?}", inside.next()?, inside.next()?))
        })
    };
    Ok(tets().find_map_first(twice))
}

/// Tetrahedron `t` and a neighbour that lies on the same side of their common face.
fn folded(mesh: &Mesh, topology: &Topology, vertices: &Vertices, t: u32) -> Option<[u32; 2]> {
    // The side of the face opposite to `vertex` on which that vertex lies, as the sign of a volume.
    let side = |ids: [u32; 4], vertex: u32| {
        let (rank, volume) = (ids.iter().filter(|&&v| v < vertex).count(), vertices.tet(ids).volume());
        if rank % 2 == 1 { volume } else { -volume }
    };
    let ids = mesh.tets[t as usize];
    let is_fold = |i: &usize| {
        let theirs = topology.neighbours[t as usize][*i];
        let theirs = mesh.tets.get(theirs as usize);
        theirs.is_some_and(|&theirs| {
            let opposite = theirs.into_iter().find(|v| !ids.contains(v)).unwrap_or(ids[*i]);
            let (a, b) = (side(ids, ids[*i]), side(theirs, opposite));
            (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0)
        })
    };
    (0..4).find(is_fold).map(|i| [t, topology.neighbours[t as usize][i]])
}

#[cfg(test)]
mod tests {
    use super::super::meshes::recipes;
    use super::*;
    use crate::reference::boundary::topology;

    fn of(name: &str) -> Option<String> {
        let mesh = recipes().find(|r| r.name == name).unwrap().mesh().unwrap_or_else(|_| panic!("{name}"));
        let topology = topology(&mesh).unwrap();
        let vertices = Vertices::new(&mesh, &topology.grid);
        overlap(&mesh, &topology, &vertices).unwrap_or_else(|_| panic!("{name}"))
    }

    #[test]
    fn overlapping_tetrahedra_are_found() {
        for name in ["fold", "jitter-12x13x11", "tangled"] {
            assert!(of(name).unwrap().contains("same side"), "{name}");
        }
        for name in ["cloud", "identical-1000", "huge-among-small"] {
            assert!(of(name).unwrap().contains("both contain"), "{name}");
        }
        for name in ["no-cells", "one-tet", "coplanar", "two-share-face", "two-share-vertex", "kuhn-16x16x16", "renumbered", "far"] {
            assert_eq!(of(name), None, "{name}");
        }
    }
}
