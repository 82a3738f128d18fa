//! A budget in bytes: trees within it, as deep as it allows, equal to the reference's, and refused with figures where not even the root fits.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use olbvh::Error;
use olbvh::build::{BadCells, BuildScratch, Capacity, DeviceMesh, MeshView, Tree, TreeMemory, cmd_build};
use olbvh::gpu::{Binding, Gpu, GpuOptions};
use olbvh::layout::BuildStatus;
use olbvh::mesh::{Mesh, kuhn, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, Lists};
use olbvh::primitives::Arena;
use olbvh::query::{LocateOptions, locate};
use olbvh::reference::boundary::topology;
use olbvh::reference::build::build;
use olbvh::reference::depth::measure;
use olbvh::reference::vertices::Vertices;
use olbvh::tree::Memory;

/// A mesh that fills little of its bounds, so that a level has far fewer nodes than cells.
fn diagonal() -> Mesh {
    let mut mesh = kuhn_jittered([24, 2, 2], 0.2, 5).unwrap();
    mesh.points.iter_mut().for_each(|p| *p = [p[0], p[1] + p[0], p[2] + 0.7 * p[0]]);
    mesh
}

fn check(gpu: &Gpu, name: &str, mesh: &Mesh) {
    let topology = topology(mesh).unwrap();
    let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap();
    let sizes = measure(mesh, &topology, &Vertices::new(mesh, &topology.grid));
    let deepest = sizes.level(&BuildOptions::default()).unwrap();
    for (assign, lists, boxes) in [
        (Assign::Aabb, Lists::All, false),
        (Assign::Aabb, Lists::All, true),
        (Assign::Exact, Lists::All, true),
        (Assign::Planes, Lists::Boundary, false),
    ] {
        let of = |level: u32| Memory::most(&sizes.entries, level, boxes).total();
        let options = |budget: u64| BuildOptions { assign, lists, boxes, budget: Some(budget), ..BuildOptions::default() };
        // Too small by a byte: refused by both, with the sizes.
        let (short, what) = (of(0) - 1, format!("{name} {assign} {lists} boxes {boxes}"));
        let refused = [Tree::build(gpu, &device, &options(short)).err(), build(mesh, &topology, &options(short)).err()];
        for error in refused {
            let Some(Error::TooLarge(text)) = error else { panic!("{what}: {error:?}") };
            assert!(text.contains(&of(0).to_string()) && text.contains(&short.to_string()), "{what}: {text}");
        }
        let ample = of(deepest) + 1000;
        for budget in (0..=deepest).flat_map(|l| [of(l), of(l) + 3, of(l + 1) - 1]).chain([ample, 1 << 40]) {
            let tree = Tree::build(gpu, &device, &options(budget)).unwrap().download().unwrap();
            assert_eq!(tree, build(mesh, &topology, &options(budget)).unwrap(), "{what}, {budget} bytes");
            tree.validate(mesh, &topology).unwrap_or_else(|e| panic!("{what}, {budget} bytes: {e}"));
            assert!(tree.memory().total() <= budget, "{what}: {} of {budget} bytes", tree.memory().total());
            let level = tree.grid.level;
            assert!(level == deepest || of(level + 1) > budget, "{what}: level {level} in {budget} bytes");
        }
    }
    // Every point is found in a tree of a small budget, by its lowest cell.
    let of = |budget: Option<u64>| {
        let tree = Tree::build(gpu, &device, &BuildOptions { budget, ..BuildOptions::default() }).unwrap();
        let found = locate(&device, &tree, &mesh.points, None, &LocateOptions::default(), &|_, _| {}).unwrap();
        (tree.status().level, found.owners)
    };
    let ((coarse, found), (fine, expected)) = (of(Some(Memory::most(&sizes.entries, 1, false).total())), of(None));
    assert!(coarse < fine, "{name}");
    assert_eq!(found, expected, "{name}");
    assert!(!found.contains(&u32::MAX), "{name}");
}

fn everything(binding: Binding) {
    let gpu = Gpu::new(&GpuOptions { binding: Some(binding), ..GpuOptions::default() }).unwrap();
    check(&gpu, "kuhn", &kuhn([6; 3]).unwrap());
    check(&gpu, "diagonal", &diagonal());
    let messages = gpu.validation_messages();
    assert!(messages.is_empty(), "{messages:#?}");
}

#[test]
fn by_address() {
    everything(Binding::Address);
}

#[test]
fn by_descriptors() {
    everything(Binding::Descriptors);
}

/// A recorded build into so many bytes of memory stays within them, whatever the mesh.
#[test]
fn memory_of_a_recorded_build() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = diagonal();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let view = MeshView { input: *device.input(), arrays: *device.arrays() };
    let tets = view.input.tets;
    let mut levels = Vec::new();
    for bytes in [64 << 10, 256 << 10, 1 << 20, 8 << 20] {
        let options = BuildOptions { budget: Some(bytes), ..BuildOptions::default() };
        let capacity = Capacity::for_bytes(bytes, 8, &options).unwrap();
        let size = Arena::measure(|a| TreeMemory::carve(a, &capacity, &options)).unwrap();
        assert!(size <= bytes && size > bytes - bytes / 8, "{size} of {bytes}");
        let carve =
            |a: &mut Arena| Ok((TreeMemory::carve(a, &capacity, &options)?, BuildScratch::carve(&gpu, a, tets, &capacity, &options)?));
        let memory = gpu.buffer("olbvh.test.tree", Arena::measure(carve).unwrap()).unwrap();
        let (tree, scratch) = carve(&mut Arena::new(memory.all())).unwrap();
        gpu.run("olbvh.test.build", |r| cmd_build(r, &view, &tree, &capacity, &options, &scratch)).unwrap();
        let status = gpu.download::<BuildStatus>(&memory, tree.status.part(0, size_of::<BuildStatus>() as u64)).unwrap()[0];
        assert!(status.overflow == 0 && status.entries <= capacity.entries && status.nodes <= capacity.nodes);
        levels.push(status.level);
    }
    assert!(levels.is_sorted() && levels[0] < levels[3], "{levels:?}");
    assert!(matches!(Capacity::for_bytes(100, 8, &BuildOptions::default()), Err(Error::TooLarge(_))));
}
