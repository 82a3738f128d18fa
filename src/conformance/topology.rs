//! Cases that compare stage 0 with the reference implementation: bad cells, bounds, normalised vertices, neighbours,
//! boundary; and the same for a mesh that had other positions before.

use super::failure::{Verdict, compare, compare_one};
use super::twin::Twin;
use crate::build::{DeviceMesh, MeshArrays, MeshInput, MeshScratch, cmd_move_mesh, cmd_prepare_mesh};
use crate::gpu::{Arena, Gpu};
use crate::layout::{Grid, MeshStatus};

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
    compare_one("build.measure_cells", "status.crowded", &counts.crowded, &status.crowded)?;
    compare_one("build.measure_cells", "status.zero_volume", &counts.flat, &status.zero_volume)?;
    compare_one("build.measure_cells", "status.negative", &counts.negative, &status.negative)?;
    compare_one("build.match_faces", "status.overflow", &0, &status.overflow)?;
    compare("build.match_faces", "neighbours", &expected.neighbours, &found.neighbours()?)?;
    compare_one("build.match_faces", "status.branched", &counts.branched, &status.branched)?;
    compare("build.find_boundary", "boundary", &expected.boundary, &found.boundary_bits()?)?;
    compare_one("build.find_boundary", "status.boundary", &counts.boundary, &status.boundary)
}

/// Prepares the mirror image of a mesh, moves its points to those of the mesh, and compares what results with the mesh
/// as it was prepared at once.
pub(crate) fn check_moved(gpu: &Gpu, twin: &Twin, prepared: &DeviceMesh) -> Verdict {
    let input = *prepared.input();
    let mirrored: Vec<[f32; 3]> = twin.mesh.points.iter().map(|&[x, y, z]| [z, y, x]).collect();
    let positions = gpu.upload("olbvh.conformance.mirrored", &mirrored)?;
    let carve = |a: &mut Arena| Ok((MeshArrays::carve(a, input.points, input.tets)?, MeshScratch::carve(a, input.points, input.tets)?));
    let (memory, (arrays, scratch)) = Arena::reserve(gpu, "olbvh.conformance.moved", carve)?;
    gpu.submit("olbvh.conformance.moved", |r| {
        cmd_prepare_mesh(r, &MeshInput { positions: positions.all(), ..input }, &arrays, &scratch)?;
        r.barrier("conformance.prepared → conformance.moved");
        cmd_move_mesh(r, &input, &arrays, &scratch)
    })?;
    let status: MeshStatus = gpu.download_one(&memory, arrays.status)?;
    compare("build.move", "status", bytemuck::cast_slice::<_, u32>(&[*prepared.status()]), bytemuck::cast_slice(&[status]))?;
    let grid: Grid = gpu.download_one(&memory, arrays.grid)?;
    compare("build.move", "grid", bytemuck::cast_slice::<_, u32>(&[*prepared.grid()]), bytemuck::cast_slice(&[grid]))?;
    let words = u64::from(input.tets).div_ceil(32);
    compare("build.move", "boundary", &prepared.boundary_bits()?, &gpu.download(&memory, arrays.boundary.part(0, 4 * words))?)?;
    let bits = |v: Vec<[f32; 4]>| v.into_iter().map(|v| v.map(f32::to_bits)).collect::<Vec<_>>();
    let vertices = gpu.download(&memory, arrays.vertices.part(0, 16 * u64::from(input.points)))?;
    compare("build.move", "vertices", &bits(prepared.vertices()?), &bits(vertices))?;
    let neighbours = gpu.download(&memory, arrays.neighbours.part(0, 16 * u64::from(input.tets)))?;
    compare("build.move", "neighbours", &prepared.neighbours()?, &neighbours)
}
