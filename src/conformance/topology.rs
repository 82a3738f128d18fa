//! Cases that compare stage 0 with the reference implementation: bad cells, bounds, normalised vertices, neighbours,
//! boundary.

use super::failure::{Verdict, compare, compare_one};
use super::twin::Twin;
use crate::build::DeviceMesh;

/// Compares a prepared mesh with its topology.
pub(crate) fn check(twin: &Twin, found: &DeviceMesh) -> Verdict {
    let (mesh, expected, vertices) = (&twin.mesh, &twin.topology, &twin.vertices);
    let (counts, status) = (expected.counts, found.status());
    let bad: Vec<u32> = expected.bad.iter().map(|b| b.0).collect();
    compare("build.check_cells", "bad cells", &bad, &found.bad_cells()?)?;
    compare_one("build.check_cells", "status.bad", &counts.bad, &status.bad)?;
    let words = |grid| bytemuck::cast_slice::<_, u32>(std::slice::from_ref(grid)).to_vec();
    compare("build.make_grid", "grid", &words(&expected.grid), &words(found.grid()))?;
    // Points that are not finite have no position in the grid; no valid tetrahedron uses them.
    let finite: Vec<bool> = mesh.points.iter().map(|p| p.iter().all(|x| x.is_finite())).collect();
    let pack_cell = |q: [u32; 3]| q[0] | q[1] << 10 | q[2] << 20;
    let pack = |(v, q): (&[f32; 3], &[u16; 3])| [v[0].to_bits(), v[1].to_bits(), v[2].to_bits(), pack_cell(q.map(u32::from))];
    let placed = |words: Vec<[u32; 4]>| words.into_iter().zip(&finite).map(|(w, f)| if *f { w } else { [0; 4] }).collect::<Vec<_>>();
    let expected_words = placed(vertices.normalised.iter().zip(&vertices.cell).map(pack).collect());
    let words = placed(found.vertices()?.into_iter().map(|v| v.map(f32::to_bits)).collect());
    compare("build.normalise_vertices", "vertices", &expected_words, &words)?;
    compare_one("build.match_faces", "status.crowded", &counts.crowded, &status.crowded)?;
    compare_one("build.match_faces", "status.zero_volume", &counts.flat, &status.zero_volume)?;
    compare_one("build.match_faces", "status.negative", &counts.negative, &status.negative)?;
    compare_one("build.match_faces", "status.overflow", &0, &status.overflow)?;
    compare("build.find_neighbours", "neighbours", &expected.neighbours, &found.neighbours()?)?;
    compare("build.find_neighbours", "boundary", &expected.boundary, &found.boundary_bits()?)?;
    compare_one("build.find_neighbours", "status.boundary", &counts.boundary, &status.boundary)
}
