//! Scan and sort, in elements per second of device time, verified before they are timed.
//! Run with `cargo bench --bench primitives`.

#[path = "../tests/submit/mod.rs"]
mod submit;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use olbvh::gpu::{Arena, Buffer, DeviceKind, Gpu, GpuOptions, Recorder};
use olbvh::primitives::{Count, ScanScratch, SortScratch, cmd_exclusive_scan, cmd_sort_pairs};
use std::time::Duration;
use submit::submit;

/// Number of elements; the last is for GPUs only, whose rate it takes to see.
const SIZES: [u32; 3] = [1 << 16, 1 << 22, 1 << 25];
const SORT_BITS: u32 = 21;

fn sizes(gpu: &Gpu) -> &'static [u32] {
    if gpu.report().kind == DeviceKind::Cpu { &SIZES[..2] } else { &SIZES }
}

fn keys(n: u32) -> Vec<u32> {
    (0..n).map(|i| (i.wrapping_mul(2_654_435_761).rotate_left(7) ^ i) & ((1 << SORT_BITS) - 1)).collect()
}

/// Device time of `iterations` runs.
fn timed(gpu: &Gpu, iterations: u64, mut record: impl FnMut(&mut Recorder<'_>) -> olbvh::Result<()>) -> Duration {
    let once = |_| {
        let ((), time) = submit(gpu, "olbvh.bench", |r| r.stage("bench", &mut record)).expect("the device runs");
        Duration::from_secs_f64(time.milliseconds("bench") * 1e-3)
    };
    (0..iterations).map(once).sum()
}

fn upload(gpu: &Gpu, data: &[u32]) -> Buffer {
    gpu.upload("olbvh.bench.input", data).expect("memory for the input")
}

fn scan(c: &mut Criterion) {
    let gpu = Gpu::new(&GpuOptions::default()).expect("a device");
    let mut group = c.benchmark_group("scan");
    for &n in sizes(&gpu) {
        let data = keys(n);
        let (input, output, total) = (upload(&gpu, &data), upload(&gpu, &data), upload(&gpu, &[0]));
        let carve = |a: &mut Arena| ScanScratch::carve(&gpu, a, n);
        let memory = gpu.buffer("olbvh.bench.scratch", Arena::measure(carve).expect("a size")).expect("scratch");
        let scratch = carve(&mut Arena::new(memory.all())).expect("scratch");
        let mut record = |r: &mut Recorder<'_>| cmd_exclusive_scan(r, input.all(), output.all(), total.all(), Count::host(n), &scratch);
        timed(&gpu, 1, &mut record);
        let before = |sum: &mut u32, v: &u32| Some(std::mem::replace(sum, sum.wrapping_add(*v)));
        let expected: Vec<u32> = data.iter().scan(0, before).collect();
        assert!(gpu.download::<u32>(&output, output.all()).expect("a result") == expected);
        group.throughput(Throughput::Elements(u64::from(n)));
        group.bench_function(BenchmarkId::new("exclusive", n), |b| b.iter_custom(|i| timed(&gpu, i, &mut record)));
    }
}

fn sort(c: &mut Criterion) {
    let gpu = Gpu::new(&GpuOptions::default()).expect("a device");
    let mut group = c.benchmark_group("sort");
    group.sample_size(20);
    for &n in sizes(&gpu) {
        let (data, ids) = (keys(n), (0..n).collect::<Vec<u32>>());
        let carve = |a: &mut Arena| SortScratch::carve(&gpu, a, n, SORT_BITS);
        let memory = gpu.buffer("olbvh.bench.scratch", Arena::measure(carve).expect("a size")).expect("scratch");
        let scratch = carve(&mut Arena::new(memory.all())).expect("scratch");
        // Every run sorts the same unsorted pairs: pairs that are sorted already would find warm caches.
        let (source, source_ids) = (upload(&gpu, &data), upload(&gpu, &ids));
        let (sorted, sorted_ids) = (upload(&gpu, &data), upload(&gpu, &ids));
        let mut run = |iterations: u64| -> Duration {
            let once = |_| {
                let record = |r: &mut Recorder<'_>| {
                    r.copy(source.all(), sorted.all());
                    r.copy(source_ids.all(), sorted_ids.all());
                    r.barrier("copy → sort");
                    r.stage("sort", |r| cmd_sort_pairs(r, sorted.all(), sorted_ids.all(), SORT_BITS, Count::host(n), &scratch))
                };
                let ((), time) = submit(&gpu, "olbvh.bench", record).expect("the device runs");
                Duration::from_secs_f64(time.milliseconds("sort") * 1e-3)
            };
            (0..iterations).map(once).sum()
        };
        run(1);
        let mut expected = ids.clone();
        expected.sort_by_key(|&i| data[i as usize]);
        assert!(gpu.download::<u32>(&sorted_ids, sorted_ids.all()).expect("a result") == expected);
        group.throughput(Throughput::Elements(u64::from(n)));
        group.bench_function(BenchmarkId::new("pairs of 21 bits", n), |b| b.iter_custom(&mut run));
    }
}

criterion_group!(benches, scan, sort);
criterion_main!(benches);
