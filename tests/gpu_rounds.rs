//! Pictures are drawn in strips, and in rounds of bounded work.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{Field, On, kuhn, kuhn_jittered};
use olbvh::options::BuildOptions;
use olbvh::query::{self, SILENT};
use olbvh::render::{PicturePlan, RenderSettings, TransferFunction};

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
    let stats = query::render(&tree, &all, (&field.values, field.on), None, SILENT).unwrap().stats;
    // Each of these rays takes 800 samples in the mesh, each of which tests some forty tetrahedra.
    assert!(stats.found_samples > 40_000 && (10..100).contains(&stats.submissions), "{stats:?}");
}
