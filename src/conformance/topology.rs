//! Stage 0 against the reference: bad cells, bounds, normalised vertices, neighbours, boundary.

use super::failure::{Verdict, compare, compare_one};
use super::meshes::MeshRecipe;
use crate::build::{BadCells, DeviceMesh};
use crate::gpu::Gpu;
use crate::mesh::Mesh;
use crate::reference::boundary::{Topology, topology};
use crate::reference::vertices::Vertices;

pub(crate) fn check(gpu: &Gpu, recipe: &MeshRecipe) -> Verdict {
    let mesh = recipe.mesh()?;
    let expected = topology(&mesh)?;
    let found = DeviceMesh::upload(gpu, &mesh, BadCells::Skip)?;
    compare_mesh(&mesh, &expected, &found)
}

/// Holds a prepared mesh against its topology.
pub(crate) fn compare_mesh(mesh: &Mesh, expected: &Topology, found: &DeviceMesh) -> Verdict {
    let (counts, status) = (expected.counts, found.status());
    let bad: Vec<u32> = expected.bad.iter().map(|b| b.0).collect();
    compare("build.check_cells", "bad cells", &bad, &found.bad_cells()?)?;
    compare_one("build.check_cells", "status.bad", &counts.bad, &status.bad)?;
    let words = |grid| bytemuck::cast_slice::<_, u32>(std::slice::from_ref(grid)).to_vec();
    compare("build.make_grid", "grid", &words(&expected.grid), &words(found.grid()))?;
    // Points that are not finite have no place; no valid cell uses them.
    let vertices = Vertices::new(mesh, &expected.grid);
    let finite: Vec<bool> = mesh.points.iter().map(|p| p.iter().all(|x| x.is_finite())).collect();
    let normalised = vertices.normalised.iter().zip(&finite).map(|(v, f)| if *f { v.map(f32::to_bits) } else { [0; 3] });
    let on_device = found.vertices()?;
    let on_device = on_device.iter().zip(&finite).map(|(v, f)| if *f { [v[0], v[1], v[2]].map(f32::to_bits) } else { [0; 3] });
    compare("build.normalise_vertices", "vertices", &normalised.collect::<Vec<_>>(), &on_device.collect::<Vec<_>>())?;
    compare_one("build.match_faces", "status.zero_volume", &counts.flat, &status.zero_volume)?;
    compare_one("build.match_faces", "status.negative", &counts.negative, &status.negative)?;
    compare_one("build.match_faces", "status.overflow", &0, &status.overflow)?;
    compare("build.find_neighbours", "neighbours", &expected.neighbours, &found.neighbours()?)?;
    compare("build.find_neighbours", "boundary", &expected.boundary, &found.boundary_bits()?)?;
    compare_one("build.find_neighbours", "status.boundary", &counts.boundary, &status.boundary)
}
