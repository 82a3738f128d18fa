//! Point location and volume rendering, in points and samples per second of device time, verified before they are
//! timed. Run with `cargo bench --bench query`.

#[path = "../tests/submit/mod.rs"]
mod submit;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use olbvh::baseline::Lbvh;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{Bounds, Mesh, On, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, TOLERANCE};
use olbvh::query::{self, LocateMethod, LocateOptions, LocateOutput, PointInput, SILENT, Scene};
use olbvh::reference::boundary::topology;
use olbvh::render::{Prepared, RenderSettings, ValidTets};
use std::time::Duration;
use submit::submit;

const POINTS: u32 = 1 << 17;
const CELLS: u32 = 32;

fn setting() -> (Gpu, Mesh) {
    // With more jitter, some tetrahedra turn over and lie in others, where trees may give different owners.
    (Gpu::new(&GpuOptions::default()).expect("a device"), kuhn_jittered([CELLS; 3], 0.2, 1).expect("a mesh"))
}

fn location(c: &mut Criterion) {
    let (gpu, mesh) = setting();
    let on_device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).expect("a mesh on the device");
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 16_777_216.0 * CELLS as f32
    };
    let points: Vec<[f32; 3]> = (0..POINTS).map(|_| [next(), next(), next()]).collect();
    let buffer = gpu.upload("olbvh.bench.points", &points).expect("memory");
    let owners = gpu.buffer("olbvh.bench.owners", 4 * u64::from(POINTS)).expect("memory");
    let barycentrics = gpu.buffer("olbvh.bench.barycentrics", 16 * u64::from(POINTS)).expect("memory");
    let input = PointInput { points: buffer.all(), stride: 3, count: POINTS, hints: None, order: None };
    let output = LocateOutput { owners: owners.all(), barycentrics: barycentrics.all() };
    let found = || gpu.download::<u32>(&owners, owners.all()).expect("owners");
    let mut group = c.benchmark_group("locate");
    group.sample_size(10).throughput(Throughput::Elements(u64::from(POINTS)));
    let mut expected: Option<Vec<u32>> = None;
    for assign in Assign::EVERY {
        let tree = Tree::build(&gpu, &on_device, &BuildOptions { assign, ..BuildOptions::default() }).expect("a tree");
        let scene = Scene::of(&tree);
        for (name, method) in [("descent", LocateMethod::Descent), ("traversal", LocateMethod::Traversal(8))] {
            let options = LocateOptions { method, ..LocateOptions::default() };
            let run = |iterations: u64| -> Duration {
                let record = |_| {
                    let ((), time) =
                        submit(&gpu, "olbvh.bench", |r| query::cmd_locate(r, &scene, &input, &output, &options)).expect("it runs");
                    Duration::from_secs_f64(time.milliseconds("query.locate") * 1e-3)
                };
                (0..iterations).map(record).sum()
            };
            run(1);
            let owners = found();
            assert!(!owners.contains(&u32::MAX), "a point is lost");
            assert!(expected.get_or_insert(owners.clone()) == &owners, "{assign} {name} finds other owners");
            group.bench_function(BenchmarkId::new(name, assign), |b| b.iter_custom(run));
        }
    }
    let lbvh = Lbvh::build(&gpu, &on_device).expect("a tree");
    let locate = || lbvh.locate(&points, TOLERANCE).expect("owners");
    let run = |iterations: u64| -> Duration {
        let milliseconds = (0..iterations).map(|_| locate().times.total()).sum::<f64>();
        Duration::from_secs_f64(milliseconds * 1e-3)
    };
    assert!(expected.as_ref() == Some(&locate().owners), "the LBVH finds other owners");
    group.bench_function(BenchmarkId::new("lbvh", "Apetrei 2014"), |b| b.iter_custom(run));
}

fn rendering(c: &mut Criterion) {
    let (gpu, mesh) = setting();
    let on_device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).expect("a mesh on the device");
    let tree = Tree::build(&gpu, &on_device, &BuildOptions::default()).expect("a tree");
    let topology = topology(&mesh).expect("a topology");
    let bounds = Bounds { lo: [0.0; 3], hi: [CELLS as f32; 3] };
    let settings = RenderSettings { size: [256, 256], ..RenderSettings::default() };
    let field = &mesh.fields[0];
    let valid = ValidTets { bounds, neighbours: &topology.neighbours, is_valid: &|_| true };
    let prepared = Prepared::new(&settings, &mesh, &valid, field).expect("a plan");
    let draw = || query::render(&tree, &prepared.plan, (&field.values, On::Points), Some(&prepared.normals), SILENT).expect("a picture");
    let first = draw();
    assert!(first.stats.found_samples > 0 && first.colors == draw().colors, "two pictures differ");
    let mut group = c.benchmark_group("render");
    assert!(first.times.milliseconds("query.march") > 0.0, "this device has no timestamps, which every figure here is taken from");
    group.sample_size(10);
    // Rays and samples.
    let rays = u64::from(settings.size[0] * settings.size[1]);
    for (name, items) in [("intervals", rays), ("march", first.stats.samples)] {
        group.throughput(Throughput::Elements(items));
        let took = || Duration::from_secs_f64(draw().times.milliseconds(&format!("query.{name}")) * 1e-3);
        let run = |iterations: u64| -> Duration { (0..iterations).map(|_| took()).sum() };
        group.bench_function(BenchmarkId::new(name, "256x256"), |b| b.iter_custom(run));
    }
}

criterion_group!(benches, location, rendering);
criterion_main!(benches);
