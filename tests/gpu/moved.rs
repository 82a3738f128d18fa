//! Meshes whose points move: the same as if they were uploaded anew. Points that are not finite for a while: the tetrahedra
//! there are left out, and nothing else is lost, then or later.

use crate::host::Frame;
use crate::submit::submit;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::layout::MeshStatus;
use olbvh::mesh::{Mesh, kuhn_jittered};
use olbvh::options::BuildOptions;
use olbvh::reference::boundary::topology;
use olbvh::reference::build::build;
use olbvh::reference::locate::Locator;

/// The mesh with a point in its middle that is nowhere.
fn torn(mesh: &Mesh) -> Mesh {
    let mut torn = mesh.clone();
    let middle = torn.points.len() / 2;
    torn.points[middle] = [f32::NAN, 1.0, f32::INFINITY];
    torn
}

#[test]
fn what_is_bad_for_a_while_is_left_out_for_as_long() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let whole = kuhn_jittered([5, 4, 6], 0.2, 3).unwrap();
    let frame = Frame::new(&gpu, &whole);
    let mut boundary = Vec::new();
    for (step, mesh) in [whole.clone(), torn(&whole), whole.clone(), torn(&whole)].iter().enumerate() {
        let staging = gpu.upload("olbvh.test.staging", &mesh.points).unwrap();
        submit(&gpu, "test.frame", |r| {
            r.copy(staging.all(), frame.input.positions);
            r.barrier("test.positions → test.mesh");
            if step == 0 { frame.record(r) } else { frame.record_moved(r) }
        })
        .unwrap();
        let topology = topology(mesh).unwrap();
        let status: MeshStatus = gpu.download_one(&frame.memory, frame.arrays.status).unwrap();
        assert_eq!(status.bad, topology.counts.bad, "step {step}");
        assert!((status.bad > 0) == (step % 2 == 1), "step {step}");
        assert_eq!(status.parted > 0, step > 0, "step {step}: it tells although all is whole again");
        boundary.push(status.boundary);
        // What is bad is no neighbour, and has none. Once found, a boundary stays.
        if step < 2 {
            assert_eq!(status.boundary, topology.counts.boundary, "step {step}");
        }
        if step % 2 == 1 || step == 0 {
            let neighbours: Vec<[u32; 4]> =
                gpu.download(&frame.memory, frame.arrays.neighbours.part(0, 16 * mesh.tets.len() as u64)).unwrap();
            assert_eq!(neighbours, topology.neighbours, "step {step}");
        }
        let tree = build(mesh, &topology, &BuildOptions::default()).unwrap();
        let locator = Locator::new(mesh, &topology, &tree);
        let owners: Vec<u32> = gpu.download(&frame.memory, frame.output.owners.part(0, 4 * mesh.points.len() as u64)).unwrap();
        for (v, (&point, &owner)) in mesh.points.iter().zip(&owners).enumerate() {
            assert_eq!(owner, locator.locate(point).owner, "step {step}: vertex {v}");
        }
    }
    // Whole again, the mesh keeps the boundary of the hole, until it is prepared anew.
    assert!(boundary[2] > boundary[0] && boundary[1] == boundary[3], "{boundary:?}");
}

/// Everything that is computed of a mesh, but for what tells of its past.
fn all_of(mesh: &DeviceMesh) -> impl PartialEq + std::fmt::Debug + use<> {
    let status = MeshStatus { parted: 0, ..*mesh.status() };
    let vertices: Vec<_> = mesh.vertices().unwrap().into_iter().map(|v| v.map(f32::to_bits)).collect();
    (status, *mesh.grid(), mesh.boundary_bits().unwrap(), mesh.neighbours().unwrap(), vertices, mesh.bad_cells().unwrap())
}

#[test]
fn a_moved_mesh_is_the_one_that_would_be_uploaded() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let whole = kuhn_jittered([5, 4, 6], 0.2, 3).unwrap();
    let first = DeviceMesh::upload(&gpu, &whole, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &first, &BuildOptions::default()).unwrap();
    let before = (all_of(&first), tree.download().unwrap());
    let bent = |mesh: &Mesh| {
        let points = mesh.points.iter().map(|&[x, y, z]| [x + 0.1 * z * z, 3.0 * y, z - 0.2 * x]).collect();
        Mesh::new(points, mesh.tets.clone())
    };
    let mut held = first;
    for (step, mesh) in [bent(&whole), torn(&whole), torn(&bent(&whole)), bent(&whole), whole.clone()].iter().enumerate() {
        held = held.moved(&mesh.points).unwrap();
        let anew = DeviceMesh::upload(&gpu, mesh, BadCells::Skip).unwrap();
        assert_eq!(all_of(&held), all_of(&anew), "step {step}");
        let trees = [&held, &anew].map(|mesh| Tree::build(&gpu, mesh, &BuildOptions::default()).unwrap().download().unwrap());
        assert_eq!(trees[0], trees[1], "step {step}");
        let searched = held.times().stages.iter().any(|stage| stage.name == "mesh.faces");
        assert_eq!(searched, step == 2 || step == 3, "step {step}: {:?}", held.times().stages);
    }
    assert_eq!((all_of(&held), tree.download().unwrap()), before);
    assert!(held.moved(&whole.points[1..]).unwrap_err().to_string().contains("points for a mesh of"));
}
