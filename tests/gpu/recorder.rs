//! The recorder's hazard check objects to whichever barrier is left out. So no barrier is missing where the check
//! looks, and none is superfluous. Commands that Vulkan does not allow are not recorded.

#![allow(unsafe_code, reason = "plain Vulkan, beside the crate")]

use crate::host::Frame;
use crate::host::baseline::Baseline;
use crate::host::queries::Queries;
use crate::not_run::not_run;
use crate::submit::submit;
use ash::vk;
use olbvh::Error;
use olbvh::build::{
    BadCells, BuildScratch, Capacity, DeviceMesh, MeshArrays, MeshScratch, MeshView, Tree, TreeMemory, cmd_build, cmd_prepare_mesh,
    cmd_ranges, range_bytes,
};
use olbvh::gpu::{Arena, Binding, Buffer, BufferRef, DeviceClass, Gpu, GpuOptions, Recorder, SortTarget, Target};
use olbvh::mesh::{On, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions};
use olbvh::primitives::{Count, ScanScratch, SortScratch, cmd_exclusive_scan, cmd_sort_pairs};
use olbvh::query::{
    LocateMethod, LocateOptions, LocateOutput, NearestMemory, PointInput, PointOrder, Rounds, Scene, cmd_interpolate, cmd_locate,
    cmd_nearest, cmd_sort_points, cmd_visible, visible_bytes,
};

/// Copies from each part, as a caller would use it next.
fn read(r: &mut Recorder<'_>, parts: &[BufferRef], sink: &Buffer) {
    for (i, part) in parts.iter().enumerate() {
        let n = part.size().min(4);
        r.copy(part.part(0, n), sink.all().part(16 * i as u64, n));
    }
}

/// Records `work` once as it is, which must pass, and once without each of its barriers, which must be refused.
fn every_barrier_counts(gpu: &Gpu, what: &str, work: impl Fn(&mut Recorder<'_>) -> olbvh::Result<()>) -> usize {
    let labels = submit(gpu, "olbvh.test.whole", |r| {
        work(r)?;
        Ok(r.barriers().to_vec())
    })
    .unwrap_or_else(|e| panic!("{what}: {e}"))
    .0;
    let mut wrong = Vec::new();
    for (n, label) in labels.iter().enumerate() {
        let result = submit(gpu, "olbvh.test.dropped", |r| {
            r.drop_barrier(Some(n as u32));
            work(r)
        });
        match result {
            Err(Error::Invalid(message)) => assert!(message.contains("no barrier between them"), "{what}: {message}"),
            Err(other) => wrong.push(format!("{what}: without barrier {n} `{label}`: {other}")),
            Ok(_) => wrong.push(format!("{what}: nothing needs barrier {n} `{label}`")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    labels.len()
}

fn targets(gpu: &Gpu) -> Vec<Gpu> {
    let [serial, ballot] = [DeviceClass::Cpu, DeviceClass::Portable].map(|row| row.target(&gpu.report().room));
    let few_bits = Target { sort: SortTarget { digit_bits: 4, ..serial.sort }, ..serial.clone() };
    [serial, ballot, few_bits].map(|target| gpu.with_target(target).unwrap()).to_vec()
}

#[test]
fn primitives() {
    for gpu in targets(&Gpu::new(&GpuOptions::default()).unwrap()) {
        let n = 50_000;
        let words = |n: u64| gpu.upload("olbvh.test.words", &vec![3u32; n as usize]).unwrap();
        let (a, b, total, count, sink) = (words(n), words(n), words(1), words(1), words(64));
        let carve = |a: &mut Arena| Ok((ScanScratch::carve(&gpu, a, n as u32)?, SortScratch::carve(&gpu, a, n as u32, 21)?));
        let (_scratch, (scan, sort)) = Arena::reserve(&gpu, "olbvh.test.scratch", carve).unwrap();
        for count in [Count::host(n as u32), Count::device(n as u32, count.all())] {
            let what = format!("{} {count:?}", gpu.target().name);
            every_barrier_counts(&gpu, &format!("scan {what}"), |r| {
                r.fill(a.all(), 1);
                cmd_exclusive_scan(r, a.all(), b.all(), total.all(), count, &scan)?;
                r.barrier("scan → caller");
                read(r, &[total.all(), b.all()], &sink);
                Ok(())
            });
            every_barrier_counts(&gpu, &format!("sort {what}"), |r| {
                r.fill(a.all(), 1);
                cmd_sort_pairs(r, a.all(), b.all(), 21, count, &sort)?;
                r.barrier("sort → caller");
                read(r, &[a.all(), b.all()], &sink);
                Ok(())
            });
        }
    }
}

#[test]
fn queries() {
    let mesh = kuhn_jittered([4, 3, 5], 0.3, 1).unwrap();
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let sink = gpu.buffer("olbvh.test.sink", 4096).unwrap();
    let frame = Frame::new(&gpu, &mesh);
    submit(&gpu, "olbvh.test.frame", |r| frame.record(r)).unwrap();
    let queries = Queries::new(&gpu, &frame, &vec![0.0; mesh.points.len()], &mesh, 100);
    let barriers = every_barrier_counts(&gpu, "slice, picture, sets, pairs", |r| {
        queries.record(r)?;
        r.barrier("queries → caller");
        let (slice, sets) = (&queries.slice, &queries.sets);
        read(
            r,
            &[
                slice.answers,
                slice.values,
                slice.status,
                sets.hits[0],
                sets.hits[1],
                sets.status[0],
                sets.status[1],
                queries.found,
                queries.owner_lists,
                queries.picture.colors,
                queries.picture.status,
            ],
            &sink,
        );
        Ok(())
    });
    assert!(barriers >= 70, "{barriers}");
}

/// Sorted points, location that takes several dispatches, since leaves could be this long, and values at the located
/// points.
#[test]
fn location() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([4, 3, 5], 0.3, 1).unwrap();
    let frame = Frame::new(&gpu, &mesh);
    submit(&gpu, "olbvh.test.frame", |r| frame.record(r)).unwrap();
    let scene = Scene { mesh: MeshView { input: frame.input, arrays: frame.arrays }, tree: frame.tree, longest_leaf: 40_000 };
    let field = gpu.upload("olbvh.test.field", &mesh.fields[0].values).unwrap();
    let (values, sink) = (gpu.buffer("olbvh.test.values", 4 * u64::from(frame.points.count)), gpu.buffer("olbvh.test.sink", 64));
    let (values, sink) = (values.unwrap(), sink.unwrap());
    let carve = |a: &mut Arena| PointOrder::carve(&gpu, a, frame.points.count);
    let (_memory, order) = Arena::reserve(&gpu, "olbvh.test.order", carve).unwrap();
    let points = PointInput { order: Some(order.order), ..frame.points };
    let barriers = every_barrier_counts(&gpu, "location", |r| {
        cmd_sort_points(r, frame.tree.grid, &points, &order)?;
        r.barrier("sort_points → locate");
        cmd_locate(r, &scene, &points, &frame.output, &LocateOptions { method: LocateMethod::Sorted, ..LocateOptions::default() })?;
        r.barrier("locate → interpolate");
        cmd_interpolate(r, &scene, (field.all(), On::Points), 1, &frame.output, (values.all(), frame.points.count))?;
        r.barrier("interpolate → caller");
        read(r, &[values.all()], &sink);
        Ok(())
    });
    assert!(barriers >= 4 + 5, "{barriers}");
    let (_memory, near) = Arena::reserve(&gpu, "olbvh.test.nearest", |a| NearestMemory::carve(a, frame.points.count)).unwrap();
    let barriers = every_barrier_counts(&gpu, "closest places", |r| {
        cmd_nearest(r, &scene, &frame.points, 1.0, &near, Rounds::begin(2))?;
        r.barrier("nearest → caller");
        read(r, &[near.states, near.barycentrics, near.unfinished], &sink);
        Ok(())
    });
    assert_eq!(barriers, 5);
    let unordered = submit(&gpu, "olbvh.test.unordered", |r| {
        cmd_locate(r, &scene, &frame.points, &frame.output, &LocateOptions { method: LocateMethod::Sorted, ..LocateOptions::default() })
    });
    assert!(matches!(unordered, Err(Error::Invalid(_))));
}

/// The host's own barriers between commands of this crate count once the host has reported them.
#[test]
fn barriers_of_a_host() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let words = |n: u64| gpu.buffer("olbvh.test.words", 4 * n).unwrap();
    let (a, b, sink) = (words(64), words(64), words(64));
    let stages = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
    let writes = vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE;
    let all = [vk::MemoryBarrier::default().src_access_mask(writes).dst_access_mask(writes | vk::AccessFlags::TRANSFER_READ)];
    // SAFETY: the commands are being recorded.
    let own = |r: &Recorder<'_>| unsafe {
        gpu.device().cmd_pipeline_barrier(r.commands(), stages, stages, vk::DependencyFlags::empty(), &all, &[], &[]);
    };
    let barriers = every_barrier_counts(&gpu, "a host's barriers", |r| {
        r.fill(a.all(), 1);
        own(r);
        r.host_barrier("host.fill → host.copy");
        r.copy(a.all(), b.all());
        own(r);
        r.host_barrier("host.copy → caller");
        read(r, &[b.all()], &sink);
        Ok(())
    });
    assert_eq!(barriers, 2);
}

/// Under a validation layer, any of these commands would also fail the test.
#[test]
fn what_vulkan_does_not_allow_is_refused() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let buffer = gpu.upload("olbvh.test.words", &[7u32; 16]).unwrap();
    let all = buffer.all();
    let refused = |words: &str, work: &dyn Fn(&mut Recorder<'_>)| {
        let mut rehearsal = Recorder::rehearse(&gpu);
        work(&mut rehearsal);
        let recorded = submit(&gpu, "olbvh.test.refused", |r| {
            work(r);
            Ok(())
        });
        for result in [rehearsal.finish(), recorded.map(|_| ())] {
            assert!(matches!(&result, Err(Error::Invalid(message)) if message.contains(words)), "{words}: {result:?}");
        }
    };
    refused("fill of 8 bytes at byte 2 of a buffer; both must be multiples of 4", &|r| r.fill(all.part(2, 8), 1));
    refused("fill of 6 bytes at byte 8", &|r| r.fill(all.part(8, 6), 1));
    refused("copy of 16 bytes from byte 8 of a buffer to byte 12, which overlap", &|r| r.copy(all.part(8, 16), all.part(12, 16)));
    refused("copy of 16 bytes from byte 12", &|r| r.copy(all.part(12, 16), all.part(8, 52)));
    refused("which overlap", &|r| r.copy(all, all));
    assert_eq!(gpu.download::<u32>(&buffer, all).unwrap(), [7; 16]);
    let side_by_side = |r: &mut Recorder<'_>| {
        r.fill(all.part(0, 16), 1);
        r.copy(all.part(16, 16), all.part(32, 32));
        r.copy(all.part(52, 1), all.part(51, 1));
        Ok(())
    };
    submit(&gpu, "olbvh.test.side_by_side", side_by_side).unwrap();
}

/// An address that a host forgot, or that a kernel cannot load from, is refused before a device uses it. A rehearsal
/// needs no addresses.
#[test]
fn addresses_of_a_host() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    if gpu.binding() == Binding::Descriptors {
        not_run("the device has no buffer addresses");
        return;
    }
    let frame = Frame::new(&gpu, &kuhn_jittered([3; 3], 0.3, 1).unwrap());
    submit(&gpu, "olbvh.test.frame", |r| frame.record(r)).unwrap();
    let scene = Scene::recorded(MeshView { input: frame.input, arrays: frame.arrays }, frame.tree);
    let refused = |address: u64| {
        let all = frame.output.barycentrics;
        // SAFETY: nothing is executed.
        let barycentrics = unsafe { BufferRef::from_raw(all.buffer(), all.offset(), all.size(), address) };
        let output = LocateOutput { barycentrics, owners: frame.output.owners };
        let record = |r: &mut Recorder<'_>| cmd_locate(r, &scene, &frame.points, &output, &LocateOptions::default());
        record(&mut Recorder::rehearse(&gpu)).unwrap();
        submit(&gpu, "olbvh.test.address", record).unwrap_err().to_string()
    };
    let (none, odd) = (refused(0), refused(frame.output.barycentrics.address() + 8));
    assert!(none.contains("olbvh.query.locate is given `barycentrics`, which has no device address"), "{none}");
    assert!(odd.contains("`barycentrics`, which is not at a multiple of 16 bytes"), "{odd}");
}

#[test]
fn ranges_of_a_field() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([6, 5, 4], 0.3, 1).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
    let view = device.view();
    let field = gpu.upload("olbvh.test.field", &mesh.fields[0].values).unwrap();
    let drawn = gpu.upload("olbvh.test.drawn", &[[0.4f32, 0.5]]).unwrap();
    let nodes = tree.memory().capacity.nodes;
    let memory = |bytes: u64| gpu.buffer("olbvh.test.ranges", bytes).unwrap();
    let (ranges, marks, sink) = (memory(range_bytes(nodes)), memory(visible_bytes(nodes)), memory(64));
    let barriers = every_barrier_counts(&gpu, "ranges", |r| {
        cmd_ranges(r, &view, tree.memory(), (field.all(), On::Points), ranges.all())?;
        cmd_visible(r, tree.memory(), ranges.all(), (drawn.all(), 1), marks.all())?;
        r.barrier("visible → caller");
        read(r, &[marks.all()], &sink);
        Ok(())
    });
    assert!(barriers as u32 >= 4 + 2 * tree.grid().level, "{barriers}");
}

#[test]
fn baseline() {
    let mesh = kuhn_jittered([4, 3, 5], 0.3, 1).unwrap();
    for gpu in targets(&Gpu::new(&GpuOptions::default()).unwrap()) {
        let baseline = Baseline::new(&gpu, &mesh);
        let sink = gpu.buffer("olbvh.test.sink", 64).unwrap();
        let barriers = every_barrier_counts(&gpu, "lbvh", |r| {
            baseline.record_lbvh(r)?;
            r.barrier("lbvh.locate → caller");
            read(r, &[baseline.output.owners, baseline.output.barycentrics, baseline.unfinished], &sink);
            Ok(())
        });
        assert!(barriers >= 10, "{barriers}");
    }
}

#[test]
fn construction() {
    let mesh = kuhn_jittered([6, 5, 4], 0.3, 1).unwrap();
    let (points, tets) = (mesh.points.len() as u32, mesh.tets.len() as u32);
    for gpu in targets(&Gpu::new(&GpuOptions::default()).unwrap()) {
        let sink = gpu.buffer("olbvh.test.sink", 4096).unwrap();
        let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
        let carve = |a: &mut Arena| Ok((MeshArrays::carve(a, points, tets)?, MeshScratch::carve(a, points, tets)?));
        let (_memory, (arrays, scratch)) = Arena::reserve(&gpu, "olbvh.test.mesh", carve).unwrap();
        let barriers = every_barrier_counts(&gpu, "mesh", |r| {
            cmd_prepare_mesh(r, device.input(), &arrays, &scratch)?;
            r.barrier("mesh → caller");
            read(r, &[arrays.status, arrays.grid, arrays.bad, arrays.boundary, arrays.vertices, arrays.neighbours], &sink);
            Ok(())
        });
        assert!(barriers >= 5);
        let view = device.view();
        for assign in Assign::EVERY {
            for (boxes, capacity) in [
                (false, Capacity::for_entries(60_000, 8)),
                (true, Capacity::for_entries(60_000, 1)),
                (true, Capacity::for_entries(tets, 0)),
                (false, Capacity { candidates: 60_000, ..Capacity::for_entries(2 * tets, 2) }),
            ] {
                let options = BuildOptions { assign, boxes, ..Default::default() };
                let carve = |a: &mut Arena| {
                    Ok((TreeMemory::carve(a, &capacity, &options)?, BuildScratch::carve(&gpu, a, tets, &capacity, &options)?))
                };
                let (_memory, (tree, scratch)) = Arena::reserve(&gpu, "olbvh.test.tree", carve).unwrap();
                let barriers = every_barrier_counts(&gpu, &format!("build {assign} {boxes} {}", gpu.target().name), |r| {
                    cmd_build(r, &view, &tree, &options, &scratch)?;
                    let arrays = [tree.status, tree.grid, tree.p, tree.po, tree.co, tree.flags, tree.masks];
                    read(r, &arrays.into_iter().chain(tree.boxes).collect::<Vec<_>>(), &sink);
                    Ok(())
                });
                assert!(barriers >= 12, "{barriers}");
            }
        }
    }
}
