//! Targets change times, never results. The conformance suite tests primitives; here a mesh, its tree and all queries
//! are tested with every row of the table.

use olbvh::baseline::Lbvh;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::error::Error;
use olbvh::gpu::{DeviceClass, Gpu, GpuOptions, Target};
use olbvh::mesh::{Bounds, Mesh, On, kuhn_jittered};
use olbvh::options::{BuildOptions, Lists};
use olbvh::query::{self, LocateMethod, LocateOptions, SILENT};
use olbvh::render::RenderSettings;
use olbvh::slicing::{Extrapolate, SliceSettings};
use olbvh::tree::TreeArrays;

/// All results of a device for a mesh.
#[derive(PartialEq)]
struct Answers {
    trees: [TreeArrays; 2],
    neighbours: Vec<[u32; 4]>,
    owners: [Vec<u32>; 2],
    barycentrics: Vec<[f32; 4]>,
    colors: Vec<[f32; 4]>,
    voxels: (Vec<u8>, Vec<u32>),
    overlap: [Vec<u32>; 2],
}

fn ask(gpu: &Gpu, mesh: &Mesh) -> Answers {
    let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap();
    let build = |lists| Tree::build(gpu, &device, &BuildOptions { lists, ..BuildOptions::default() }).unwrap();
    let (all, boundary) = (build(Lists::All), build(Lists::Boundary));
    let bounds = Bounds::from(device.grid());
    let Bounds { lo, hi } = bounds;
    let at = |i: u32, step: u32, c: usize| lo[c] + (hi[c] - lo[c]) * (i * step % 1009) as f32 / 1009.0;
    let points: Vec<[f32; 3]> = (0..3000).map(|i| [at(i, 1, 0), at(i, 313, 1), at(i, 71, 2)]).collect();
    let locate = |tree, method| query::locate(tree, &points, None, &LocateOptions { method, ..LocateOptions::default() }, SILENT).unwrap();
    let (found, walked) = (locate(&all, LocateMethod::Descent), locate(&boundary, LocateMethod::Sorted));
    let lbvh = Lbvh::build(gpu, &device).unwrap().locate(&points, olbvh::options::TOLERANCE).unwrap();
    assert!(lbvh.owners == found.owners, "{}: the LBVH finds other owners", gpu.target().name);
    let field = &mesh.fields[0];
    let settings = RenderSettings { size: [40, 32], ..RenderSettings::default() };
    let neighbours = device.neighbours().unwrap();
    let prepared = query::prepare_picture(&device, mesh, field, &settings).unwrap();
    let values = (field.values.as_slice(), On::Points);
    let drawn = query::render(&boundary, &prepared.plan, values, Some(&prepared.normals), SILENT).unwrap();
    assert!(drawn.stats.found_samples > 0);
    let voxels = SliceSettings { size: [60, 0], ..SliceSettings::default() }.voxels(lo, hi, [0.0; 3]).unwrap();
    let (mut kinds, mut owners) = (Vec::new(), Vec::new());
    query::slice(&all, None, &voxels, Extrapolate::Nearest, SILENT, &mut |band| {
        kinds.extend(band.kinds);
        owners.extend(band.owners);
        Ok(())
    })
    .unwrap();
    let overlap = query::overlap(&all, &boundary, SILENT).unwrap().overlap;
    Answers {
        trees: [all.download().unwrap(), boundary.download().unwrap()],
        neighbours,
        owners: [found.owners, walked.owners],
        barycentrics: found.barycentrics,
        colors: drawn.colors,
        voxels: (kinds, owners),
        overlap: [overlap.a, overlap.b],
    }
}

#[test]
fn every_row_gives_the_same_bytes() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([9, 8, 7], 0.3, 5).unwrap();
    let expected = ask(&gpu, &mesh);
    assert!(expected.owners[0].iter().any(|&o| o != u32::MAX) && !expected.overlap[0].is_empty());
    for row in DeviceClass::EVERY {
        let shaped = gpu.with_target(row.target(&gpu.report().room)).unwrap();
        assert_eq!(shaped.target().name, row.name());
        assert!(ask(&shaped, &mesh) == expected, "{}", row.name());
    }
    crate::silent(&gpu);
}

#[test]
fn what_does_not_fit_is_refused() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let wrong = |target: Target| {
        let error = gpu.with_target(target.clone()).unwrap_err();
        assert!(matches!(error, Error::Invalid(_)), "{error}");
        let opened = Gpu::new(&GpuOptions { target: Some(target), ..GpuOptions::default() });
        assert!(matches!(opened, Err(Error::Invalid(_))));
    };
    let target = gpu.target().clone();
    wrong(Target { each: gpu.subgroup_size() + 1, ..target.clone() });
    wrong(Target { query: 1 << 20, ..target });
}
