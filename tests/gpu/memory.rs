//! Memory that a build allocates.

use olbvh::build::{BadCells, BuildScratch, Capacity, DeviceMesh, Tree};
use olbvh::gpu::{Arena, Buffer, Gpu, GpuOptions};
use olbvh::mesh::kuhn;
use olbvh::options::{Assign, BuildOptions, Lists};

fn allocated(gpu: &Gpu) -> u64 {
    gpu.allocated().unwrap().total_allocated_bytes
}

/// The paper's largest mesh at α = 0: 12,290,298 tetrahedra, 98,322,384 entries, level 7, 2,396,745 nodes.
#[test]
fn jets_fits_in_two_gibibytes() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let (tets, entries, level, nodes) = (12_290_298, 98_322_384, 7, 2_396_745u64);
    let capacity = Capacity { candidates: entries, entries, nodes: nodes as u32, level };
    let paper = BuildOptions { assign: Assign::Aabb, lists: Lists::All, ..BuildOptions::default() };
    let scratch = Arena::measure(|a| BuildScratch::carve(&gpu, a, tets, &capacity, &paper)).unwrap();
    let tree = 4 * u64::from(entries) + nodes * (4 + 4 + 1 + 1 + 24);
    let total = scratch + tree;
    println!("scratch {scratch}, tree {tree}, together {total} bytes");
    assert!(total < 2 << 30, "{total} bytes");
}

/// Parts lie within the part that they are taken of, whatever the numbers.
#[test]
fn parts_are_cut_off() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let buffer = gpu.buffer("olbvh.test.parts", 64).unwrap();
    let part = buffer.all().part(16, 32);
    for (offset, size, expected) in [(8, 8, (24, 8)), (24, 9, (40, 8)), (33, 1, (48, 0)), (u64::MAX, u64::MAX, (48, 0))] {
        let cut = part.part(offset, size);
        assert_eq!((cut.offset(), cut.size()), expected, "{offset}+{size}");
    }
    assert_eq!(part.word(u64::MAX).size(), 0);
}

/// A buffer beyond the device's limit is refused with that limit, and the driver is not asked.
#[test]
fn too_large_a_buffer_is_refused() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let most = gpu.report().largest_buffer;
    assert!(gpu.report().largest_allocation >= 1 << 30, "what Vulkan requires of every device");
    let refused = |bytes| gpu.buffer("olbvh.test.large", bytes).unwrap_err().to_string();
    if most < u64::MAX {
        assert!(refused(most + 1).contains(&format!("holds {most} bytes at most")), "{}", refused(most + 1));
    } else {
        // Before Vulkan 1.3 only the driver knows.
        assert!(refused(1 << 60).contains("olbvh.test.large"));
    }
}

/// Also where a pool has buffers that it is compared with.
#[test]
fn a_pool_refuses_what_no_buffer_holds() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap().with_pool(1 << 24);
    drop(gpu.buffer("olbvh.test.kept", 1 << 20).unwrap());
    assert!(gpu.buffer("olbvh.test.large", u64::MAX).unwrap_err().to_string().contains("olbvh.test.large"));
}

/// After a build only the tree is left, and the peak is the one planned.
#[test]
fn a_build_allocates_what_it_needs() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn([12; 3]).unwrap();
    let on_device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    for (assign, lists) in Assign::EVERY.into_iter().flat_map(|assign| Lists::EVERY.map(|lists| (assign, lists))) {
        let before = allocated(&gpu);
        let options = BuildOptions { assign, lists, ..BuildOptions::default() };
        let counting = gpu.with_memory(1 << 40);
        let tree = Tree::build(&counting, &on_device, &options).unwrap();
        let status = *tree.status();
        let capacity = Capacity { candidates: status.candidates, entries: status.entries, nodes: status.nodes, level: status.level };
        let planned = Arena::measure(|a| BuildScratch::carve(&gpu, a, on_device.input().tets, &capacity, &options));
        // Allows for the head of 512 bytes and the rounding of each buffer.
        let slack = 8192;
        let planned = planned.unwrap() + slack;
        let (peak, kept) = (counting.memory_peak(), allocated(&gpu) - before);
        assert!(tree.scratch_bytes() <= planned, "{assign}: {} scratch bytes", tree.scratch_bytes());
        assert!((kept..=planned + kept).contains(&peak), "{assign}: {peak} bytes at most, {planned} planned beside the tree's {kept}");
        let host = tree.download().unwrap();
        assert!(kept <= host.memory().total() + slack, "{assign}: {kept} bytes kept for a tree of {}", host.memory().total());
        drop(tree);
        assert_eq!(allocated(&gpu), before, "{assign}");
    }
}

/// Dropped buffers are kept for new ones of nearly their size, up to a limit, as long as a handle exists.
#[test]
fn a_pool_keeps_what_is_dropped() {
    const MIB: u64 = 1 << 20;
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let none = allocated(&gpu);
    let pooled = gpu.with_pool(4 * MIB);
    let buffer = |size: u64| pooled.buffer("olbvh.test.kept", size).unwrap();
    let handle_of = |buffer: Buffer| buffer.all().buffer();
    let handle = handle_of(buffer(MIB));
    assert!(allocated(&gpu) >= none + MIB, "nothing is kept");
    for other in [MIB / 2, 2 * MIB] {
        assert_ne!(handle_of(buffer(other)), handle, "{other} bytes took the place of {MIB}");
    }
    let old = buffer(MIB).all();
    let again = buffer(MIB - MIB / 16);
    assert_eq!((again.size(), again.all().buffer()), (MIB - MIB / 16, handle));
    assert!(pooled.download::<u32>(&again, old).is_err(), "a part of a dropped buffer with the same handle, but larger");
    drop(again);
    // The buffer still has its full size.
    let words: Vec<u32> = (0..1 << 18).collect();
    let written = pooled.upload("olbvh.test.kept", &words).unwrap();
    assert_eq!(pooled.download::<u32>(&written, written.all()).unwrap(), words);
    let many: Vec<_> = (0..9).map(|_| buffer(MIB)).collect();
    drop((many, written));
    let kept = allocated(&gpu) - none;
    assert!((MIB..=4 * MIB).contains(&kept), "{kept} bytes are kept");
    assert!(gpu.with_pool(MIB).with_memory(64 * MIB).buffer("olbvh.test.limited", MIB).is_ok());
    drop(pooled);
    assert_eq!(allocated(&gpu), none);
}
