//! The stages of a construction, in tetrahedra per second of device time, verified before they are timed. Run with
//! `cargo bench --bench build`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use olbvh::baseline::Lbvh;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::kuhn_jittered;
use olbvh::options::{Assign, BuildOptions};
use olbvh::reference::{boundary::topology, build::build};
use olbvh::times::StageTimes;
use std::time::Duration;

/// The time of the stage with this name; of all stages for "all".
fn time_of(times: &StageTimes, name: &str) -> Duration {
    let milliseconds = if name == "all" { times.total() } else { times.milliseconds(name) };
    Duration::from_secs_f64(milliseconds * 1e-3)
}

fn construction(c: &mut Criterion) {
    let gpu = Gpu::new(&GpuOptions::default()).expect("a device");
    let mesh = kuhn_jittered([32; 3], 0.3, 1).expect("a mesh");
    let on_device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).expect("a mesh on the device");
    let topology = topology(&mesh).expect("a topology");
    let mut group = c.benchmark_group("build");
    group.sample_size(10).throughput(Throughput::Elements(mesh.tets.len() as u64));
    assert!(on_device.neighbours().expect("neighbours") == topology.neighbours);
    assert!(!on_device.times().stages.is_empty(), "this device has no timestamps, which every figure here is taken from");
    for stage in ["mesh.clear", "mesh.bounds", "mesh.shapes", "mesh.faces", "mesh.boundary"] {
        let run = |iterations: u64| -> Duration {
            let once = |_| time_of(DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).expect("a mesh").times(), stage);
            (0..iterations).map(once).sum()
        };
        group.bench_function(BenchmarkId::new(stage, "any"), |b| b.iter_custom(run));
    }
    for assign in Assign::EVERY {
        let options = BuildOptions { assign, ..BuildOptions::default() };
        let tree = Tree::build(&gpu, &on_device, &options).expect("a tree");
        assert!(tree.download().expect("arrays") == build(&mesh, &topology, &options).expect("a tree"));
        let mut names: Vec<String> = tree.times().stages.iter().map(|s| s.name.clone()).collect();
        names.push("all".into());
        // All stages of `Aabb`; of the other assignments, only the stages that differ.
        names.retain(|n| assign == Assign::Aabb || ["build.filter", "build.sort", "all"].contains(&n.as_str()));
        for stage in names {
            let run = |iterations: u64| -> Duration {
                (0..iterations).map(|_| time_of(Tree::build(&gpu, &on_device, &options).expect("a tree").times(), &stage)).sum()
            };
            group.bench_function(BenchmarkId::new(&stage, assign), |b| b.iter_custom(run));
        }
    }
    let lbvh = |iterations: u64| -> Duration {
        (0..iterations).map(|_| time_of(Lbvh::build(&gpu, &on_device).expect("a tree").times(), "all")).sum()
    };
    group.bench_function(BenchmarkId::new("lbvh", "Apetrei 2014"), |b| b.iter_custom(lbvh));
}

criterion_group!(benches, construction);
criterion_main!(benches);
