//! Pictures are drawn in strips, and in rounds of bounded work.

use olbvh::blocks;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::error::{Error, Result};
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{Field, On, kuhn, kuhn_jittered};
use olbvh::options::{BuildOptions, Lists};
use olbvh::query::{self, LocateOptions, SILENT};
use olbvh::render::{PicturePlan, RenderSettings, TransferFunction};
use olbvh::slicing::{Extrapolate, SliceSettings};
use std::cell::Cell;

fn bits(colors: &[[f32; 4]]) -> Vec<[u32; 4]> {
    colors.iter().map(|color| color.map(f32::to_bits)).collect()
}

/// Strips of a picture have the marks of visible nodes in common: each skips samples, and shows what it shows when none
/// is skipped.
#[test]
fn strips_skip_what_is_not_visible() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([6, 6, 6], 0.2, 5).unwrap();
    let field = Field { name: "x".into(), on: On::Points, values: mesh.points.iter().map(|p| p[0]).collect() };
    let transfer = TransferFunction::default().with_opacity(vec![(0.0, 0.0), (0.6, 0.0), (1.0, 0.5)]).unwrap();
    let camera = "zoom=2".parse().unwrap();
    let settings = RenderSettings { size: [4096, 264], camera, transfer, step: Some(0.3), shading: false, ..RenderSettings::default() };
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
    let plan = PicturePlan::new(&settings, &tree.grid().into(), mesh.origin, field.range()).unwrap();
    let all = PicturePlan { visible_values: vec![[f32::NEG_INFINITY, f32::INFINITY]], ..plan.clone() };
    let [some, all] = [plan, all].map(|plan| query::render(&tree, &plan, (&field.values, field.on), None, SILENT).unwrap());
    assert!(bits(&some.colors) == bits(&all.colors));
    assert!(some.colors[4096 * 256..].iter().any(|color| color[3] > 0.1));
    assert!(some.stats.samples + 50_000 < all.stats.samples && all.stats.skipped_samples == 0, "{:?} and {:?}", some.stats, all.stats);
}

/// Rays along the edges of a grid search the structure for every sample, in a walk that ends in a star. That is charged
/// to the round, so that no submission takes long.
#[test]
fn walks_count_as_work() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn([8; 3]).unwrap();
    let field = &mesh.fields[0];
    let camera = "front,ortho=8,target=4.5,4,4.5".parse().unwrap();
    let settings = RenderSettings { size: [8, 8], camera, step: Some(0.01), shading: false, ..RenderSettings::default() };
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
    let plan = PicturePlan::new(&settings, &tree.grid().into(), mesh.origin, field.range()).unwrap();
    let all = PicturePlan { visible_values: vec![[f32::NEG_INFINITY, f32::INFINITY]], termination: 2.0, ..plan };
    let drawn = query::render(&tree, &all, (&field.values, field.on), None, SILENT).unwrap();
    // Each of these rays takes 800 samples in the mesh, each of which tests some forty tetrahedra.
    assert!(drawn.stats.found_samples > 40_000 && (10..100).contains(&drawn.times.submissions), "{:?}, {}", drawn.stats, drawn.times);
}

/// A caller that has had enough ends a call at its first report, and what the call used is free for the next one.
#[test]
fn calls_can_be_cancelled() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn([8; 3]).unwrap();
    let field = &mesh.fields[0];
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
    let whole = Tree::build(&gpu, &device, &BuildOptions { lists: Lists::All, ..BuildOptions::default() }).unwrap();
    let settings = RenderSettings { size: [64, 64], ..RenderSettings::default() };
    let voxels = SliceSettings { layers: 3, ..SliceSettings::default() }.voxels([0.0; 3], [8.0; 3], [0.0; 3]).unwrap();
    let reports = Cell::new(0);
    let enough = |_, _| {
        reports.set(reports.get() + 1);
        Err(Error::Cancelled)
    };
    let held = || gpu.allocated().unwrap().total_allocated_bytes;
    let before = held();
    let how = LocateOptions::default();
    let options = BuildOptions::default();
    let asked = blocks::LocateRequest { mesh: &mesh, options, points: &mesh.points };
    let ends: [(&str, Result<()>); 8] = [
        ("locate", query::locate(&tree, &mesh.points, None, &how, &enough).map(drop)),
        ("locate_all", query::locate_all(&tree, &mesh.points, 0.0, &enough).map(drop)),
        ("nearest", query::nearest(&tree, &mesh.points, 1.0, &enough).map(drop)),
        ("overlap", query::overlap(&tree, &tree, &enough).map(drop)),
        ("pairs", query::overlap_pairs(&tree, &whole, &enough).map(drop)),
        ("slice", query::slice(&tree, None, &voxels, Extrapolate::Nearest, &enough, &mut |_| Ok(())).map(drop)),
        ("blocks", blocks::locate(&gpu.with_memory(1 << 30), &asked, &how, &enough).map(drop)),
        ("render", {
            let plan = query::prepare_picture(&device, &mesh, field, &settings).unwrap();
            query::render(&tree, &plan.plan, (&field.values, field.on), Some(&plan.normals), &enough).map(drop)
        }),
    ];
    for (call, end) in ends {
        assert!(matches!(end, Err(Error::Cancelled)), "{call}: {end:?}");
    }
    assert_eq!(reports.get(), 8, "each call ends at its first report");
    assert_eq!(held(), before, "what the calls used is given back");
    query::locate(&tree, &mesh.points, None, &how, SILENT).unwrap();
}
