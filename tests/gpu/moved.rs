//! Points that are not finite for a while: the tetrahedra there are left out, and nothing else is lost, then or later.

use crate::host::Frame;
use crate::submit::submit;
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
