//! Overlaps on the device, and their counters, equal those of the reference implementation, for poses and lists that
//! the conformance suite lacks.

use olbvh::conformance::{HostAndDevice, check_overlap};
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{Mesh, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, Lists};
use olbvh::query::{SILENT, overlap_pairs};

fn moved(mut mesh: Mesh, at: [f32; 3], scale: f32) -> Mesh {
    mesh.points.iter_mut().for_each(|p| *p = [0, 1, 2].map(|c| at[c] + scale * p[c]));
    mesh
}

fn everything(gpu: &Gpu) {
    let mut hits = 0;
    for (alpha, assign) in [(0.0, Assign::Aabb), (1.0, Assign::Exact), (10.0, Assign::Planes)] {
        let options = BuildOptions { alpha, assign, lists: Lists::All, ..BuildOptions::default() };
        let cube = HostAndDevice::new(gpu, kuhn_jittered([6, 5, 4], 0.3, 9).unwrap(), &options).unwrap();
        for (i, scale) in [1.0, 0.3, 1.7].into_iter().enumerate() {
            let at = [0.4 + i as f32, 0.37 * i as f32 - 1.0, 1.1];
            let other = HostAndDevice::new(gpu, moved(kuhn_jittered([7, 6, 8], 0.2, 3).unwrap(), at, scale), &options).unwrap();
            hits += check_overlap(&cube, &other).unwrap();
        }
    }
    assert!(hits > 500, "{hits}");
}

both_bindings!(everything, by_address, by_descriptors);

#[test]
fn long_lists_take_several_submissions() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let one = kuhn_jittered([1; 3], 0.0, 0).unwrap();
    let options = BuildOptions { lists: Lists::All, ..BuildOptions::default() };
    // A tetrahedron that touches none of 20,000 others in its cell, and one that touches all of them.
    let many = HostAndDevice::new(&gpu, Mesh::new(one.points.clone(), vec![one.tets[0]; 20_000]), &options).unwrap();
    let apart = Mesh::new(
        vec![
            [0.1, 0.5, 0.9],
            [0.0, 0.6, 1.0],
            [0.1, 0.7, 0.95],
            [0.05, 0.5, 1.0],
            [-1.0, 0.1, 0.1],
            [2.0, 0.3, 0.1],
            [0.5, 0.3, 0.2],
            [0.5, 0.2, 0.1],
        ],
        vec![[0, 1, 2, 3], [4, 5, 6, 7]],
    );
    let apart = HostAndDevice::new(&gpu, apart, &options).unwrap();
    check_overlap(&apart, &many).unwrap();
    check_overlap(&many, &apart).unwrap();
    let found = overlap_pairs(&apart.tree, &many.tree, SILENT).unwrap();
    assert!(found.times.submissions > 10, "{}", found.times);
}
