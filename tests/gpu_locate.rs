//! Point location on the device: equal to the reference, by every path.
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Binding, Gpu, GpuOptions};
use olbvh::mesh::kuhn_jittered;
use olbvh::options::{Assign, BuildOptions};
use olbvh::query::{LocateOptions, Path, locate, locate_all};
use olbvh::reference::boundary::topology;
use olbvh::reference::locate::Locator;

#[test]
fn owners_are_the_references() {
    for binding in [Binding::Address, Binding::Descriptors] {
        let gpu = Gpu::new(&GpuOptions { binding: Some(binding), ..Default::default() }).unwrap();
        let mesh = kuhn_jittered([10, 11, 9], 0.3, 1).unwrap();
        let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
        let topology = topology(&mesh).unwrap();
        let mut h = 1u32;
        let mut next = || {
            h = h.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (h >> 8) as f32 / 16_777_216.0
        };
        let mut points: Vec<[f32; 3]> = (0..5000).map(|_| [next() * 12.0 - 1.0, next() * 13.0 - 1.0, next() * 11.0 - 1.0]).collect();
        points.extend(mesh.points.iter());
        points.extend(mesh.tets.iter().map(|t| {
            let p = t.map(|i| mesh.points[i as usize]);
            [0, 1, 2].map(|c| (p[0][c] + p[1][c] + p[2][c]) / 3.0)
        }));
        points.extend([[f32::NAN; 3], [f32::INFINITY; 3], [1e38; 3], [-1e38, 1.0, 1.0], [10.0 + 1e-6, 5.0, 5.0]]);
        for assign in Assign::ALL {
            for alpha in [0.0, 1.0, 2.0] {
                let tree = Tree::build(&gpu, &device, &BuildOptions { assign, alpha, ..Default::default() }).unwrap();
                let host = tree.download().unwrap();
                let locator = Locator::new(&mesh, &topology, &host);
                let expected = locator.locate_all(&points);
                for path in [Path::Descent, Path::Traversal(8), Path::Traversal(1)] {
                    let found = locate(&device, &tree, &points, None, &LocateOptions { path, ..Default::default() }, &|_, _| {}).unwrap();
                    for (i, e) in expected.iter().enumerate() {
                        assert_eq!(
                            (e.owner, e.barycentric),
                            (found.owners[i], found.barycentrics[i]),
                            "{assign} {alpha} {path:?} point {i} {:?}",
                            points[i]
                        );
                    }
                }
                let lists = locate_all(&device, &tree, &points, &LocateOptions::default(), &|_, _| {}).unwrap();
                for (i, list) in lists.iter().enumerate() {
                    assert_eq!(&locator.owners(points[i]), list, "all owners of point {i}");
                }
            }
        }
        let v = gpu.validation_messages();
        assert!(v.is_empty(), "{v:#?}");
    }
}
