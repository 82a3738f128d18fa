//! Stage 0 on meshes whose faces crowd in the hash table of faces.
#![allow(clippy::unwrap_used)]

use olbvh::build::{BadCells, DeviceMesh};
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::Mesh;
use olbvh::reference::boundary::topology;
use std::collections::{BTreeMap, BTreeSet};

/// Balls cut into tetrahedra around their centres, which are the first points, so that the faces of a few vertices
/// crowd in the table.
fn stars(n: u32) -> Mesh {
    const SIDE: i32 = 2;
    let place = |k: u32, x: i32, y: i32, z: i32| {
        let length = ((x * x + y * y + z * z) as f32).sqrt();
        [3.0 * k as f32 + x as f32 / length, y as f32 / length, z as f32 / length]
    };
    let mut mesh = Mesh::new((0..n).map(|k| [3.0 * k as f32, 0.0, 0.0]).collect(), Vec::new());
    for k in 0..n {
        // Points of the surface of an octahedron, |x| + |y| + |z| = SIDE, in rows.
        let mut ids = BTreeMap::new();
        for (x, y) in (-SIDE..=SIDE).flat_map(|x| (-SIDE..=SIDE).map(move |y| (x, y))) {
            let z = SIDE - x.abs() - y.abs();
            for z in BTreeSet::from([z, -z]).into_iter().filter(|_| z >= 0) {
                ids.insert([x, y, z], mesh.points.len() as u32);
                mesh.points.push(place(k, x, y, z));
            }
        }
        for signs in 0..8 {
            let id = |i: i32, j: i32| {
                let sign = |axis: i32| if signs >> axis & 1 == 0 { 1 } else { -1 };
                ids.get(&[i * sign(0), j * sign(1), (SIDE - i - j) * sign(2)]).copied().unwrap_or_default()
            };
            for (i, j) in (0..SIDE).flat_map(|i| (0..SIDE - i).map(move |j| (i, j))) {
                mesh.tets.push([k, id(i, j), id(i + 1, j), id(i, j + 1)]);
                if i + j + 1 < SIDE {
                    mesh.tets.push([k, id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)]);
                }
            }
        }
    }
    mesh
}

#[test]
fn crowded_faces_find_each_other() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = stars(3000);
    let expected = topology(&mesh).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    assert_eq!(expected.counts.boundary as usize, mesh.tets.len());
    assert!(device.neighbours().unwrap() == expected.neighbours, "neighbours of crowded faces");
    assert_eq!(device.status().branched, expected.counts.branched);
}
