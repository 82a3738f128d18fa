//! The ray tracing baseline, by ray queries and by ray-tracing pipelines where the device has them: the owners that it
//! finds are right, and the points that it loses are counted.

use crate::not_run::not_run;
use olbvh::baseline::{RayMethod, Rays};
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Binding, Gpu, GpuOptions};
use olbvh::mesh::{Mesh, kuhn, kuhn_jittered};
use olbvh::options::BuildOptions;
use olbvh::query::{LocateOptions, SILENT, locate};
use olbvh::reference::boundary::topology;
use olbvh::reference::locate::Locator;

/// Whether the device traces rays by this method; prints a message if not. The reference driver must.
fn has_rays(gpu: &Gpu, method: RayMethod) -> bool {
    let has = method.of(gpu);
    if !has {
        not_run(&format!("{} traces no rays by {method:?}", gpu.report().name));
        let driver = std::env::var("OLBVH_TEST_DRIVER").unwrap_or_default();
        assert!(!driver.starts_with("lavapipe25"), "{driver} is expected to trace rays");
    }
    has
}

fn by_rays(gpu: &Gpu, mesh: &DeviceMesh, method: RayMethod, points: &[[f32; 3]]) -> (Rays, Vec<u32>, Vec<[f32; 4]>) {
    let rays = Rays::build(gpu, mesh, method).unwrap().unwrap();
    let found = rays.locate(points).unwrap();
    (rays, found.owners, found.barycentrics)
}

/// The mesh with its coordinates scaled, and points in and around it.
fn scaled(mut mesh: Mesh, by: [f32; 3]) -> (Mesh, Vec<[f32; 3]>) {
    mesh.points.iter_mut().for_each(|p| *p = [0, 1, 2].map(|c| p[c] * by[c]));
    let hi = mesh.points.iter().fold([0.0f32; 3], |hi, p| [0, 1, 2].map(|c| hi[c].max(p[c])));
    let mut h = 1u32;
    let mut next = |c: usize| {
        h = h.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((h >> 8) as f32 / 16_777_216.0 * 1.2 - 0.1) * hi[c]
    };
    let points = (0..20_000).map(|_| [next(0), next(1), next(2)]).collect();
    (mesh, points)
}

fn what_rays_find_is_right(binding: Binding, method: RayMethod) {
    let gpu = Gpu::new(&GpuOptions { binding: Some(binding), ..Default::default() }).unwrap();
    if !has_rays(&gpu, method) {
        return;
    }
    let meshes = [
        ("jittered", scaled(kuhn_jittered([10, 11, 9], 0.3, 1).unwrap(), [1.0; 3])),
        ("regular", scaled(kuhn([16; 3]).unwrap(), [1.0; 3])),
        ("huge", scaled(kuhn_jittered([8; 3], 0.3, 2).unwrap(), [1e30; 3])),
        ("plate", scaled(kuhn_jittered([20, 20, 2], 0.3, 3).unwrap(), [1.0, 1.0, 1e-3])),
    ];
    for (name, (mesh, mut points)) in meshes {
        let inside = points.len();
        points.extend_from_slice(&mesh.points);
        points.extend([[f32::NAN; 3], [f32::INFINITY; 3], [-1e38; 3]]);
        let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
        let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
        let expected = locate(&tree, &points, None, &LocateOptions { tolerance: 0.0, ..Default::default() }, SILENT).unwrap();
        let (rays, owners, weights) = by_rays(&gpu, &device, method, &points);
        let host = tree.download().unwrap();
        let topology = topology(&mesh).unwrap();
        let locator = Locator::new(&mesh, &topology, &host);
        let mut lost = [0; 2];
        for (i, (&owner, &octree)) in owners.iter().zip(&expected.owners).enumerate() {
            if owner == u32::MAX {
                lost[usize::from(i >= inside)] += usize::from(octree != owner);
                assert_eq!(weights[i], [0.0; 4]);
                continue;
            }
            let all = locator.owners(points[i]);
            assert!(all.contains(&owner), "{name} point {i} {:?}: {owner} is none of {all:?}", points[i]);
            if all.len() == 1 {
                assert_eq!((owner, weights[i]), (octree, expected.barycentrics[i]), "{name} point {i}");
            }
        }
        let structure = rays.structure();
        println!(
            "{binding:?} {method:?} {name}: {} faces, {} bytes ({} before compaction), lost {} of {inside} points and {} of {} vertices",
            rays.faces(),
            structure.bytes(),
            structure.built_bytes(),
            lost[0],
            lost[1],
            mesh.points.len()
        );
        assert!(lost[0] * 1000 <= inside, "{name}: {} of {inside} points are lost", lost[0]);
        // Every face is counted once: two of the four faces of each tetrahedron, and half of those on the surface in
        // addition.
        let surface = device.neighbours().unwrap().iter().flatten().filter(|&&n| n == u32::MAX).count();
        assert_eq!(2 * rays.faces() as usize, 4 * mesh.tets.len() + surface);
        assert!(structure.bytes() <= structure.built_bytes() + 4096 && rays.bytes() > structure.bytes());
        let stages: Vec<&str> = rays.times().stages.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(stages, ["rays.faces", "acceleration.build", "acceleration.compact", "acceleration.scene"]);
    }
    crate::silent(&gpu);
}

#[test]
fn what_rays_find_is_right_by_address() {
    what_rays_find_is_right(Binding::Address, RayMethod::Query);
}

#[test]
fn what_rays_find_is_right_by_descriptors() {
    what_rays_find_is_right(Binding::Descriptors, RayMethod::Query);
}

#[test]
fn what_pipelines_find_is_right() {
    what_rays_find_is_right(Binding::Address, RayMethod::Pipeline);
}

#[test]
fn meshes_without_cells_have_no_owners() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    for method in RayMethod::EVERY.into_iter().filter(|&method| has_rays(&gpu, method)) {
        for mesh in [Mesh::default(), Mesh::new(vec![[0.0; 3]; 4], vec![[0, 1, 1, 9]; 3])] {
            let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
            let (rays, owners, _) = by_rays(&gpu, &device, method, &[[0.0; 3], [0.5; 3]]);
            assert_eq!((rays.faces(), owners), (0, vec![u32::MAX; 2]));
        }
    }
    crate::silent(&gpu);
}
