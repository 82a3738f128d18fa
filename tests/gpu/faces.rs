//! Stage 0 on meshes whose faces crowd in the hash table of faces, or have more than two cells, by both kernels of faces.

use olbvh::build::{BadCells, DeviceMesh};
use olbvh::gpu::{DeviceClass, Gpu, GpuOptions};
use olbvh::mesh::{Mesh, kuhn};
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

/// A block with copies of cells, vertices in another order: of every 7th right after itself, and of every 5th and 11th at
/// the end, the latter twice. So many faces have three cells or more, next to each other or far apart.
fn copies() -> Mesh {
    let block = kuhn([6, 6, 6]).unwrap();
    let rotated = |tet: &[u32; 4], by: usize| std::array::from_fn(|v| tet[(v + by) % 4]);
    let mut mesh = Mesh::new(block.points, Vec::new());
    for (i, tet) in block.tets.iter().enumerate() {
        mesh.tets.push(*tet);
        if i % 7 == 0 {
            mesh.tets.push(rotated(tet, 1));
        }
    }
    let every = |n: usize, by: usize| block.tets.iter().step_by(n).map(move |tet| rotated(tet, by));
    mesh.tets.extend(every(5, 2).chain(every(11, 3)).chain(every(11, 1)));
    mesh
}

#[test]
fn faces_find_each_other_however_many_cells_they_have() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    for row in [DeviceClass::Cpu, DeviceClass::Portable] {
        let gpu = gpu.with_target(row.target(&gpu.report().room)).unwrap();
        for (name, mesh) in [("stars", stars(3000)), ("copies", copies())] {
            let expected = topology(&mesh).unwrap();
            assert_eq!(expected.counts.branched > 0, name == "copies");
            let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
            assert!(device.neighbours().unwrap() == expected.neighbours, "neighbours of {name}, {row}");
            assert!(device.boundary_bits().unwrap() == expected.boundary, "boundary of {name}, {row}");
            assert_eq!(device.status().branched, expected.counts.branched, "{name}, {row}");
        }
    }
}
