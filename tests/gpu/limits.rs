//! What happens exactly at a limit: of coordinates and extents, of a share of candidates, of a part of a list, of a
//! tolerance, of the room for an answer.

use crate::submit::submit;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Arena, Gpu, GpuOptions};
use olbvh::mesh::{Mesh, kuhn, kuhn_jittered};
use olbvh::options::{BuildOptions, LIST_PART, Lists, TOLERANCE};
use olbvh::query::{
    LocateOptions, OwnersMemory, PointInput, SILENT, Scene, cmd_count_owners, cmd_list_owners, locate, locate_all, overlap,
};
use olbvh::reference::boundary::topology;
use olbvh::reference::build::build;
use olbvh::reference::locate::Locator;

fn on_device(gpu: &Gpu, mesh: &Mesh) -> DeviceMesh {
    DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap()
}

fn corner(at: f32, size: f32) -> [[f32; 3]; 4] {
    [[at; 3], [at + size, at, at], [at, at + size, at], [at, at, at + size]]
}

#[test]
fn coordinates_and_extents() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    for exponent in [125, -103] {
        let size = 2f32.powi(exponent);
        let mut points = corner(0.0, size).to_vec();
        points.extend([[0.5 * size; 3], [0.1 * size, 0.5 * size, 0.2 * size]]);
        let mesh = Mesh::new(points, vec![[0, 1, 2, 3], [0, 5, 4, 0], [1, 2, 3, 4]]);
        let (topology, device) = (topology(&mesh).unwrap(), on_device(&gpu, &mesh));
        assert_eq!(device.status().bad, topology.counts.bad, "2^{exponent}");
        assert_eq!(device.grid().inv.map(f32::to_bits), topology.grid.inv.map(f32::to_bits), "2^{exponent}");
    }
}

/// A tetrahedron with as many candidates as a share has, one fewer, and one and two more.
#[test]
fn candidates_of_a_share() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    for cells in [31, 32, 33, 34] {
        let mut points = corner(0.0, 0.2).to_vec();
        points.extend([[0.5, 0.2, 0.2], [cells as f32 - 0.5, 0.2, 0.2], [0.5, 0.4, 0.2], [0.5, 0.2, 0.4]]);
        points.extend(corner(63.8, 0.2));
        let mesh = Mesh::new(points, vec![[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]);
        let options = BuildOptions { level: Some(6), ..BuildOptions::default() };
        let expected = build(&mesh, &topology(&mesh).unwrap(), &options).unwrap();
        assert!(expected.p.iter().filter(|&&t| t == 1).count() >= cells);
        let tree = Tree::build(&gpu, &on_device(&gpu, &mesh), &options).unwrap();
        assert_eq!(tree.download().unwrap().p, expected.p, "{cells} candidates");
    }
}

/// A tolerance that reaches beyond a leaf leaves nothing out by quarters or slabs that lies within it.
#[test]
fn large_tolerances() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([6, 5, 4], 0.2, 5).unwrap();
    let (topology, device) = (topology(&mesh).unwrap(), on_device(&gpu, &mesh));
    let part = |i: u32, c: usize| i.wrapping_mul([0x9e37_79b9, 0x7f4a_7c15, 0xf39c_c060][c]) as f32 / 4_294_967_296.0;
    let points: Vec<[f32; 3]> = (0..5000).map(|i| [0, 1, 2].map(|c| part(i, c) * (8 - c) as f32 - 1.0)).collect();
    let variants = [Lists::All, Lists::Boundary].into_iter().flat_map(|lists| [(lists, false), (lists, true)]);
    for ((lists, slabs), level) in variants.flat_map(|variant| [2, 4, 6].map(|level| (variant, level))) {
        let options = BuildOptions { lists, slabs, level: Some(level), ..BuildOptions::default() };
        let expected = build(&mesh, &topology, &options).unwrap();
        let tree = Tree::build(&gpu, &device, &options).unwrap();
        for tolerance in [1e-4, 0.01, 0.3] {
            let locator = Locator::new(&mesh, &topology, &expected).with_tolerance(tolerance);
            let found = locate(&tree, &points, None, &LocateOptions { tolerance, ..LocateOptions::default() }, SILENT).unwrap();
            let other = points.iter().zip(&found.owners).filter(|&(&p, &owner)| locator.locate(p).owner != owner).count();
            assert_eq!(other, 0, "{options:?}, tolerance {tolerance}");
        }
    }
}

/// The owner of a point beside the mesh is found once, also where its list is searched in several parts.
#[test]
fn owners_within_the_tolerance_of_a_long_list() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let device = on_device(&gpu, &kuhn([20; 3]).unwrap());
    let tree = Tree::build(&gpu, &device, &BuildOptions { level: Some(0), lists: Lists::All, ..BuildOptions::default() }).unwrap();
    let points: Vec<[f32; 3]> = (0..50).map(|i| [-5e-6, 0.3 + 0.37 * i as f32, 7.2]).collect();
    let owners = locate(&tree, &points, None, &LocateOptions::default(), SILENT).unwrap().owners;
    assert!(!owners.contains(&u32::MAX));
    let all = locate_all(&tree, &points, TOLERANCE, SILENT).unwrap().owners;
    assert!(all.iter().zip(&owners).all(|(all, owner)| all == &[*owner]), "{all:?}");
}

/// A list that ends with a part, or just behind one, is searched to its end, and the answer is complete, also where more parts
/// are recorded since the host does not know how long lists are.
#[test]
fn lists_of_whole_parts() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    for more in [0, 1] {
        // All of one part lie in one place, and the last tetrahedron in another.
        let length = LIST_PART + more;
        let mut tets = vec![[0, 1, 2, 3]; length as usize - 1];
        tets.push([4, 5, 6, 7]);
        let mesh = Mesh::new([corner(0.0, 0.5), corner(0.9, 0.1)].concat(), tets);
        let device = on_device(&gpu, &mesh);
        let tree = Tree::build(&gpu, &device, &BuildOptions { level: Some(0), lists: Lists::All, ..BuildOptions::default() }).unwrap();
        assert_eq!(tree.status().longest_leaf, length);
        let (known, points) = (Scene::of(&tree), [[0.1f32; 3], [0.91; 3]]);
        let asked = gpu.upload("olbvh.test.points", &points).unwrap();
        let input = PointInput { points: asked.all(), stride: 3, count: 2, hints: None, order: None };
        for longest_leaf in [length, 3 * LIST_PART] {
            let scene = Scene { longest_leaf, ..known };
            let (buffer, memory) = Arena::reserve(&gpu, "olbvh.test.owners", |a| OwnersMemory::carve(&gpu, a, 2)).unwrap();
            let options = LocateOptions::default();
            submit(&gpu, "olbvh.test.count", |r| cmd_count_owners(r, &scene, &input, &memory, &options)).unwrap();
            assert_eq!(gpu.download_one::<u32>(&buffer, memory.total).unwrap(), length);
            let owners: Vec<u32> = gpu.download(&buffer, memory.located.owners.part(0, 8)).unwrap();
            assert_eq!(owners, [0, length - 1]);
            let barycentrics: Vec<[f32; 4]> = gpu.download(&buffer, memory.located.barycentrics.part(0, 32)).unwrap();
            assert!(barycentrics.iter().all(|b| (b.iter().sum::<f32>() - 1.0).abs() < 1e-5 && b[1] > 0.05), "{barycentrics:?}");
        }
    }
}

/// Of two meshes, the one whose list has the vertex of the other in its last part may be either.
#[test]
fn overlap_that_a_late_part_of_a_list_tells() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mut tets = vec![[0, 1, 2, 3]; 20_000];
    tets.push([4, 5, 6, 7]);
    let many = Mesh::new([corner(0.0, 1.0), corner(0.9, 0.1)].concat(), tets);
    let one = Mesh::new(corner(0.91, 0.01).to_vec(), vec![[0, 1, 2, 3]]);
    let options = BuildOptions { level: Some(0), lists: Lists::All, ..BuildOptions::default() };
    let [many, one] = [&many, &one].map(|mesh| Tree::build(&gpu, &on_device(&gpu, mesh), &options).unwrap());
    for (a, b) in [(&one, &many), (&many, &one)] {
        let found = overlap(a, b, SILENT).unwrap().overlap;
        assert_eq!((found.a.len(), found.b.len()), (1, 1));
        assert_eq!(found.effort[0].by_vertex + found.effort[1].by_vertex, 2);
    }
}

/// Nothing is written behind the memory for owners, wherever an owner comes from: walks, lists, the tolerance.
#[test]
fn owners_without_room() {
    const UNTOUCHED: u32 = 0xdead_beef;
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn([4; 3]).unwrap();
    let device = on_device(&gpu, &mesh);
    let mut points = mesh.points.clone();
    points.extend((0..9).map(|i| [-5e-6, 0.3 + 0.4 * i as f32, 1.2]));
    let count = points.len() as u32;
    let asked = gpu.upload("olbvh.test.points", &points).unwrap();
    let input = PointInput { points: asked.all(), stride: 3, count, hints: None, order: None };
    for lists in [Lists::All, Lists::Boundary] {
        let tree = Tree::build(&gpu, &device, &BuildOptions { lists, level: Some(3), ..BuildOptions::default() }).unwrap();
        let (scene, options) = (Scene::of(&tree), LocateOptions::default());
        let (buffer, memory) = Arena::reserve(&gpu, "olbvh.test.owners", |a| OwnersMemory::carve(&gpu, a, count)).unwrap();
        submit(&gpu, "olbvh.test.count", |r| cmd_count_owners(r, &scene, &input, &memory, &options)).unwrap();
        let total: u32 = gpu.download_one(&buffer, memory.total).unwrap();
        let every = locate_all(&tree, &points, TOLERANCE, SILENT).unwrap().owners.concat();
        assert_eq!(every.len(), total as usize);
        // The room ends at owners of every kind: in the middle, and among the last, which lie beside the mesh.
        for room in (0..40).map(|i| i * total / 40).chain(total - 9..=total) {
            let found = gpu.upload("olbvh.test.found", &vec![UNTOUCHED; total as usize]).unwrap();
            let part = found.all().part(0, 4 * u64::from(room));
            // Listing moves the places that counting left.
            submit(&gpu, "olbvh.test.list", |r| {
                cmd_count_owners(r, &scene, &input, &memory, &options)?;
                cmd_list_owners(r, &scene, &input, &memory, part)
            })
            .unwrap();
            let written: Vec<u32> = gpu.download(&found, found.all()).unwrap();
            let (within, behind) = written.split_at(room as usize);
            assert!(within == &every[..room as usize] && behind.iter().all(|&word| word == UNTOUCHED), "{lists}, room for {room}");
        }
    }
}
