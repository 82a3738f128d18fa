//! What lies on another device, or has sizes of something else, is refused instead of read out of bounds.

use olbvh::Error;
use olbvh::baseline::{Lbvh, RayMethod, Rays};
use olbvh::build::{BadCells, BuildScratch, Capacity, DeviceMesh, Tree, TreeMemory, cmd_build};
use olbvh::gpu::{Arena, DescriptorPools, Gpu, GpuOptions, Recorder};
use olbvh::mesh::{Bounds, On, kuhn};
use olbvh::options::{Assign, BuildOptions, Lists};
use olbvh::query::{LocateMethod, LocateOptions, SILENT, locate, overlap, render};
use olbvh::render::RayGrid;
use olbvh::render::{PicturePlan, RenderSettings, TABLE_SIZE};
use std::any::Any;
use std::fmt::Debug;

fn refused<T: Debug>(what: &str, words: &str, result: olbvh::Result<T>) {
    match result {
        Err(Error::Invalid(message)) => assert!(message.contains(words), "{what}: {message}"),
        other => panic!("{what}: {other:?}"),
    }
}

/// Handles of one device are interchangeable, whatever memory or target they have.
#[test]
fn another_device_is_refused() {
    let [gpu, elsewhere] = [(); 2].map(|()| Gpu::new(&GpuOptions::default()).unwrap());
    let mesh = kuhn([2; 3]).unwrap();
    let [here, there] = [&gpu, &elsewhere].map(|gpu| DeviceMesh::upload(gpu, &mesh, BadCells::Skip).unwrap());
    let options = BuildOptions::default();
    refused("tree", "on another device", Tree::build(&gpu, &there, &options));
    refused("lbvh", "on another device", Lbvh::build(&gpu, &there).map(|_| ()));
    let [a, b] = [(&gpu, &here), (&elsewhere, &there)].map(|(gpu, mesh)| Tree::build(gpu, mesh, &options).unwrap());
    refused("overlap", "on different devices", overlap(&a, &b, SILENT));
    let [a, b] = [(&gpu, &here), (&elsewhere, &there)].map(|(gpu, mesh)| Lbvh::build(gpu, mesh).unwrap());
    refused("lbvh.overlap", "on different devices", a.overlap(&b, SILENT));
    let buffer = elsewhere.buffer("olbvh.test.elsewhere", 64).unwrap();
    refused("download", "on another device", gpu.download::<u32>(&buffer, buffer.all()));
    let mut pools = DescriptorPools::new(&elsewhere);
    refused("pools", "another device", Recorder::rehearse(&gpu).with_pools(&mut pools).map(|_| ()));
    let same = gpu.with_memory(1 << 20).with_target(gpu.target().clone()).unwrap();
    Tree::build(&same, &here, &options).unwrap();
}

/// Sizes that a host has made by hand, and that kernels rely on.
#[test]
fn wrong_sizes_are_refused() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn([2; 3]).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
    let (values, settings) = (vec![0.0; mesh.points.len()], RenderSettings { size: [16, 16], ..RenderSettings::default() });
    let mut plan = PicturePlan::new(&settings, &Bounds::from(device.grid()), mesh.origin, Some([0.0, 1.0])).unwrap();
    plan.table.truncate(2);
    refused("render", "2 colours", render(&tree, &plan, (&values, On::Points), None, SILENT));
    let unseen = PicturePlan { rays: RayGrid { origin: [f32::NAN; 3], ..plan.rays }, table: vec![[0.0; 4]; TABLE_SIZE], ..plan };
    refused("render", "no finite numbers", render(&tree, &unseen, (&values, On::Points), None, SILENT));
    let eleven = BuildOptions { level: Some(11), ..BuildOptions::default() };
    refused("level", "level is 11", Tree::build(&gpu, &device, &eleven).map(|_| ()));
    let deep = Capacity { level: 13, ..Capacity::for_entries(1000, 22) };
    refused("level", "level 13", Arena::measure(|a| TreeMemory::carve(a, &deep, &BuildOptions::default())));
    let [small, large] = [64, 128].map(|bytes| gpu.buffer("olbvh.test.copied", bytes).unwrap());
    let mut recorder = Recorder::rehearse(&gpu);
    recorder.copy(large.all(), small.all());
    refused("copy", "copy of 128 bytes", recorder.finish());
    let to_be_read = |bytes: u32, what: &str| format!("{bytes} bytes of the buffer `olbvh.test.copied`, to be read as {what}");
    refused("download", &to_be_read(64, "items of 12"), gpu.download::<[f32; 3]>(&small, small.all()));
    refused("download", &to_be_read(64, "items of 0"), gpu.download::<()>(&small, small.all()));
    refused("download_one", &to_be_read(8, "a value of 16"), gpu.download_one::<[u32; 4]>(&small, small.all().part(56, 16)));
    // A stack of any size gives the same owners.
    let located = |stack| {
        let options = LocateOptions { method: LocateMethod::Traversal(stack), ..LocateOptions::default() };
        locate(&tree, &mesh.points, None, &options, SILENT).unwrap().owners
    };
    assert_eq!(located(u32::MAX), located(8));
}

/// Memory is carved for a size and for options; a build of another kind in it would lose points.
#[test]
fn builds_that_memory_was_not_carved_for_are_refused() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let [mesh, larger] = [[3; 3], [4; 3]].map(|n| DeviceMesh::upload(&gpu, &kuhn(n).unwrap(), BadCells::Skip).unwrap());
    let tets = mesh.input().tets;
    let carve = |entries: u32, options: BuildOptions| {
        let capacity = Capacity::for_entries(entries, 4);
        Arena::reserve(&gpu, "olbvh.test.build", |a| {
            Ok((TreeMemory::carve(a, &capacity, &options)?, BuildScratch::carve(&gpu, a, tets, &capacity, &options)?))
        })
        .unwrap()
    };
    let usual = BuildOptions::default();
    let full = BuildOptions { lists: Lists::All, assign: Assign::Aabb, ..usual };
    let [(_one, one), (_two, two), (_three, three)] = [carve(9000, usual), carve(9000, full), carve(8000, usual)];
    let build = |mesh: &DeviceMesh, tree: &TreeMemory, scratch: &BuildScratch, options: &BuildOptions| {
        cmd_build(&mut Recorder::rehearse(&gpu), &mesh.view(), tree, options, scratch)
    };
    build(&mesh, &one.0, &one.1, &usual).unwrap();
    build(&mesh, &one.0, &one.1, &BuildOptions { alpha: 2.0, ..usual }).unwrap();
    refused("options", "assign, lists", build(&mesh, &one.0, &one.1, &full));
    refused("tree", "assign, lists", build(&mesh, &two.0, &one.1, &usual));
    refused("scratch", "assign, lists", build(&mesh, &one.0, &two.1, &usual));
    refused("capacity", "different capacities", build(&mesh, &three.0, &one.1, &usual));
    refused("mesh", "384 tetrahedra, in memory for 162", build(&larger, &one.0, &one.1, &usual));
}

/// A structure keeps the memory of its mesh, which queries of it read.
#[test]
fn trees_keep_the_place_of_their_mesh() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap().with_memory(1 << 24);
    let mesh = kuhn([3; 3]).unwrap();
    let whole = gpu.memory_left();
    let upload = || DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    for name in ["tree", "LBVH", "rays"] {
        let on = upload();
        let mesh_bytes = whole - gpu.memory_left();
        let built: Box<dyn Any> = match name {
            "tree" => Box::new(Tree::build(&gpu, &on, &BuildOptions::default()).unwrap()),
            "LBVH" => Box::new(Lbvh::build(&gpu, &on).unwrap()),
            _ => match Rays::build(&gpu, &on, RayMethod::Query).unwrap() {
                Some(rays) => Box::new(rays),
                None => continue,
            },
        };
        let both = gpu.memory_left();
        assert!(mesh_bytes > 0 && both < whole - mesh_bytes, "{name}: {both} left of {whole}");
        drop(on);
        assert_eq!(gpu.memory_left(), both, "{name}");
        drop(built);
        assert_eq!(gpu.memory_left(), whole, "{name}");
    }
}
