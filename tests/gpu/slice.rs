//! Slices on the device equal those of the reference implementation, kinds and owners to the bit, values except for
//! flushed denormals, for meshes that the conformance suite lacks.

use crate::not_run::not_run;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Binding, Gpu, GpuOptions};
use olbvh::mesh::{Field, Mesh, On, kuhn, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions};
use olbvh::query::{SILENT, slice};
use olbvh::reference::build::build;
use olbvh::reference::slice::Slicer;
use olbvh::slicing::{Band, Extrapolate, Plane, SliceSettings, VoxelGrid};

fn check(gpu: &Gpu, name: &str, mesh: &Mesh, trees: &[(f32, Assign)], settings: &[SliceSettings]) -> u64 {
    let topology = olbvh::reference::boundary::topology(mesh).unwrap();
    let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap();
    let fields = [
        Field { name: "x".into(), on: On::Points, values: mesh.points.iter().map(|p| p[0] + 0.5 * p[1]).collect() },
        Field { name: "id".into(), on: On::Cells, values: (0..mesh.tets.len()).map(|t| t as f32).collect() },
    ];
    let mut touched = 0;
    for &(alpha, assign) in trees {
        let options = BuildOptions { alpha, assign, slabs: true, ..BuildOptions::default() };
        let tree = Tree::build(gpu, &device, &options).unwrap();
        let host = build(mesh, &topology, &options).unwrap();
        let three = |v: [f32; 4]| [v[0], v[1], v[2]];
        let (lo, hi) = (three(host.grid.lo), three(host.grid.hi));
        for (i, settings) in settings.iter().enumerate() {
            let Ok(voxels) = settings.voxels(lo, hi, mesh.origin) else { continue };
            let (field, extrapolate) = [
                (None, Extrapolate::Nearest),
                (Some(&fields[0]), Extrapolate::Nearest),
                (Some(&fields[0]), Extrapolate::Linear),
                (Some(&fields[1]), Extrapolate::Nearest),
            ][i % 4];
            let slicer = Slicer::new(mesh, &topology, &host, field, voxels, extrapolate).unwrap();
            let what = format!("{name} alpha {alpha} {assign} {settings:?}");
            let mut compare = |found: Band| {
                let expected = slicer.band(found.rows);
                for i in 0..expected.kinds.len() {
                    let decided = |b: &Band| (b.kinds[i], b.owners[i]);
                    assert_eq!(decided(&expected), decided(&found), "{what}: voxel {i} of {:?}", found.rows);
                    // Devices may flush denormal products of a value; everything else must be equal.
                    let (a, b) = (expected.values[i], found.values[i]);
                    let same = a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-36;
                    assert!(same, "{what}: value {a} or {b} of voxel {i} of {:?}", found.rows);
                }
                Ok(())
            };
            let values = field.map(|f| (&f.values[..], f.on));
            let sliced = slice(&tree, values, &voxels, extrapolate, SILENT, &mut compare).unwrap_or_else(|e| panic!("{what}: {e}"));
            touched += sliced.tally.touched;
            assert_eq!(sliced.tally.inside + sliced.tally.touched + sliced.tally.empty, voxels.voxels(), "{what}");
        }
    }
    touched
}

fn settings() -> Vec<SliceSettings> {
    let default = SliceSettings { size: [37, 21], ..SliceSettings::default() };
    vec![
        SliceSettings { plane: Plane::Axis(0), ..default },
        SliceSettings { plane: Plane::Axis(1), layers: 4, size: [9, 7], ..default },
        SliceSettings { plane: Plane::Normal([1.0, -2.0, 0.7]), layers: 3, ..default },
    ]
}

#[test]
fn by_address() {
    let gpu = Gpu::new(&GpuOptions { binding: Some(Binding::Address), ..GpuOptions::default() }).unwrap();
    if std::env::var("OLBVH_TEST_DRIVER").is_ok_and(|d| d == "swiftshader") {
        not_run("slices with lists of 20,000 entries and of flow_sphere_50k on SwiftShader, where they take many minutes");
        return;
    }
    // Lists that no dispatch can search in one go.
    let one = kuhn_jittered([1; 3], 0.0, 0).unwrap();
    let many = Mesh::new(one.points.clone(), vec![one.tets[0]; 20_000]);
    let mut touched =
        check(&gpu, "long lists", &many, &[(0.0, Assign::Aabb)], &[SliceSettings { size: [5, 5], ..SliceSettings::default() }]);
    // A flat tetrahedron owns the voxels below it; its weights do not extend beyond it.
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [3.0, 3.0, 0.0], [0.0, 0.0, 1.0]];
    let flat = Mesh::new(points, vec![[0, 1, 2, 3], [0, 1, 2, 4]]);
    let below =
        |k: i32| SliceSettings { at: Some(-0.1 - f64::from(k) / 100.0), thickness: Some(1.0), size: [9, 9], ..SliceSettings::default() };
    touched += check(&gpu, "flat", &flat, &[(0.0, Assign::Exact)], &(0..40).map(below).collect::<Vec<_>>());
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/flow_sphere_50k.vtu");
    let loaded = olbvh::formats::load(&file, &olbvh::formats::LoadOptions::default()).unwrap();
    touched += check(&gpu, "flow_sphere_50k", &loaded.mesh, &[(0.0, Assign::Aabb), (2.0, Assign::Planes)], &settings());
    assert!(touched > 1000, "{touched}");
    crate::silent(&gpu);
}

/// Voxels so small that most of those beside the mesh lie in a few leaves, whose octants and slabs decide about them.
#[test]
fn voxels_smaller_than_leaves() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bracket_50k.vtu");
    let mesh = olbvh::formats::load(&file, &olbvh::formats::LoadOptions::default()).unwrap().mesh;
    let side = |c: usize, of: fn(f32, f32) -> f32| f64::from(mesh.points.iter().map(|p| p[c]).reduce(of).unwrap()) + mesh.origin[c];
    let through = |plane: Plane, part: f64, width: u32| {
        let (lo, hi) = match plane {
            Plane::Axis(c) => (side(c, f32::min), side(c, f32::max)),
            Plane::Normal(_) => (0.0, 40.0),
        };
        SliceSettings { plane, at: Some(lo + part * (hi - lo)), layers: 2, size: [width, 0], ..SliceSettings::default() }
    };
    let planes = [Plane::Axis(0), Plane::Axis(1), Plane::Axis(2), Plane::Normal([0.3, -0.2, 1.0])];
    let settings: Vec<_> = planes
        .iter()
        .flat_map(|&plane| [(0.08, 40), (0.31, 75), (0.5, 150), (0.77, 400)].map(|(part, width)| through(plane, part, width)))
        .collect();
    let touched = check(&gpu, "bracket_50k", &mesh, &[(0.0, Assign::Planes), (1.0, Assign::Exact)], &settings);
    assert!(touched > 10_000, "{touched}");
}

#[test]
fn an_error_of_the_sink_ends_the_stack() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([3; 3], 0.0, 0).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
    let half = 0.5;
    let axis = |c: usize| [0, 1, 2].map(|k| if k == c { 1.0 } else { 0.0 });
    let voxels = VoxelGrid {
        origin: [0.5; 3],
        next_voxel: axis(0),
        next_row: axis(1),
        next_layer: axis(2),
        half: [0, 1, 2].map(|c| axis(c).map(|x| x * half)),
        size: [3, 3],
        layers: 3,
    };
    let mut stop = |_: Band| Err(olbvh::Error::Invalid("full".into()));
    let result = slice(&tree, None, &voxels, Extrapolate::Nearest, SILENT, &mut stop);
    assert!(result.is_err_and(|e| e.to_string().contains("full")));
}

/// Centres on vertices are each searched for in a star of tetrahedra. A dispatch takes no more of them than drivers let
/// the loops of an invocation run for: one (Mesa 22.3) ends them after 65,535 passes, and the rest of a run was empty.
#[test]
fn runs_along_vertices_are_sliced_to_their_end() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn([8, 128, 8]).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
    let settings = SliceSettings { at: Some(4.0), size: [4, 64], ..SliceSettings::default() };
    let voxels = settings.voxels([0.0; 3], [8.0, 128.0, 8.0], mesh.origin).unwrap();
    let sliced = slice(&tree, None, &voxels, Extrapolate::Nearest, SILENT, &mut |_| Ok(())).unwrap();
    assert_eq!(sliced.tally.inside, voxels.voxels(), "{:?}", sliced.tally);
}

/// Where tetrahedra overlap, the owner of a voxel is found from that of the voxel before. That is the same one however
/// many voxels are sliced at a time.
#[test]
fn memory_makes_no_difference_where_cells_overlap() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap().with_memory(1 << 25);
    let one = kuhn_jittered([6; 3], 0.0, 0).unwrap();
    let moved = one.points.iter().map(|p| [p[0] + 0.37, p[1] + 0.21, p[2] + 0.43]);
    let beside = one.tets.iter().map(|t| t.map(|v| v + one.points.len() as u32));
    let mesh = Mesh::new(one.points.iter().copied().chain(moved).collect(), one.tets.iter().copied().chain(beside).collect());
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
    let settings = SliceSettings { layers: 3, size: [40, 150], ..SliceSettings::default() };
    let voxels = settings.voxels([0.0; 3], [6.43; 3], mesh.origin).unwrap();
    let owners = || {
        let (mut owners, mut bands) = (Vec::new(), 0);
        let mut sink = |band: Band| {
            owners.extend(band.owners);
            bands += 1;
            Ok(())
        };
        slice(&tree, None, &voxels, Extrapolate::Nearest, SILENT, &mut sink).unwrap();
        (owners, bands)
    };
    let (all, bands) = owners();
    assert_eq!(bands, 1);
    let second = one.tets.len() as u32;
    assert!(all.iter().any(|&t| t < second) && all.iter().any(|&t| t >= second && t != u32::MAX));
    // Memory for 70 rows, of which only 64 are used, since bands start where runs do.
    let _rest = gpu.buffer("olbvh.test.rest", gpu.memory_left() - 70 * 40 * 40 - (1 << 14)).unwrap();
    let (in_parts, bands) = owners();
    assert_eq!(bands, 9);
    assert!(all == in_parts, "{} owners differ", all.iter().zip(&in_parts).filter(|(a, b)| a != b).count());
}
