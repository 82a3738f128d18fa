//! A moving mesh: its tree is rebuilt every frame into the same memory, with two frames in flight, and every tree
//! equals that of a fresh build. Faces are matched in the first frame of each memory only.
//!
//! The reference driver runs 1,000 frames; others run a part of them, to keep the suite short. `OLBVH_TEST_FRAMES`
//! overrides this.

#![allow(unsafe_code, reason = "plain Vulkan, beside the crate")]

use crate::host::{Frame, Host};
use ash::vk;
use olbvh::gpu::{Buffer, BufferRef, Gpu, GpuOptions, Recorder};
use olbvh::layout::BuildStatus;
use olbvh::mesh::{Mesh, kuhn_jittered};
use olbvh::options::BuildOptions;
use olbvh::reference::boundary::topology;
use olbvh::reference::build::build;
use olbvh::tree::stored::split_entries;

const SLOTS: usize = 2;

fn frames() -> u32 {
    let driver = std::env::var("OLBVH_TEST_DRIVER").unwrap_or_default();
    let some = if driver.is_empty() || driver == "lavapipe25-256" { 1000 } else { 60 };
    std::env::var("OLBVH_TEST_FRAMES").ok().and_then(|n| n.parse().ok()).unwrap_or(some)
}

/// Frame number `i` of the mesh, sheared, stretched and jittered.
fn deformed(mesh: &Mesh, i: u32) -> Mesh {
    let mut state = i.wrapping_mul(0x9e37_79b9) | 1;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        (state >> 8) as f32 / 16_777_216.0 - 0.5
    };
    let (stretch, shear) = ([0; 3].map(|_| 1.0 + 0.9 * random()), [0; 3].map(|_| random()));
    let mut moved = mesh.clone();
    for p in &mut moved.points {
        *p = [0, 1, 2].map(|c| p[c] * stretch[c] + p[(c + 1) % 3] * shear[c] + 0.2 * random());
    }
    moved
}

/// The commands and the fence of a frame, and the mesh that it showed.
struct Slot {
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    frame: Frame,
    staging: Buffer,
    shown: Option<Mesh>,
}

fn compare(gpu: &Gpu, slot: &Slot, mesh: &Mesh, number: u32) {
    let frame = &slot.frame;
    let expected = build(mesh, &topology(mesh).unwrap(), &BuildOptions::default()).unwrap();
    let words = |part: BufferRef, n: usize| gpu.download::<u32>(&frame.memory, part.part(0, 4 * n as u64)).unwrap();
    let status: Vec<BuildStatus> = gpu.download(&frame.memory, frame.tree.status.part(0, size_of::<BuildStatus>() as u64)).unwrap();
    assert_eq!((status[0].overflow, status[0].level), (0, expected.grid.level), "frame {number}");
    let (p, quarters) = split_entries(words(frame.tree.p, expected.p.len()), &expected.grid);
    assert_eq!((p, quarters), (expected.p, expected.quarters), "P of frame {number}");
    assert_eq!(words(frame.tree.po, expected.po.len()), expected.po, "PO of frame {number}");
    assert_eq!(words(frame.tree.co, expected.co.len()), expected.co, "CO of frame {number}");
    assert_eq!(words(frame.tree.flags, expected.flags.len()), expected.flags, "flags of frame {number}");
    assert_eq!(words(frame.tree.masks, expected.masks.len()), expected.masks, "masks of frame {number}");
    // Every vertex has an owner.
    for (v, &owner) in words(frame.output.owners, mesh.points.len()).iter().enumerate() {
        assert!(mesh.tets.get(owner as usize).is_some(), "frame {number}: vertex {v} is lost");
    }
}

#[test]
fn rebuilds_in_flight_are_fresh_builds() {
    let host = Host::new();
    let lent = host.lend();
    let queue = lent.queue.clone().unwrap();
    // SAFETY: the host's handles belong together and outlive `gpu`.
    let gpu = unsafe { Gpu::from_raw(lent, &GpuOptions::default()) }.unwrap();
    let device = &host.device;
    let mesh = kuhn_jittered([5, 4, 6], 0.2, 3).unwrap();
    // SAFETY: objects are created and used in the order that Vulkan asks for; the memory of a slot is used again only
    // after its fence is signalled.
    unsafe {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(host.family);
        let pool = device.create_command_pool(&info.flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER), None).unwrap();
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(SLOTS as u32);
        let mut slots: Vec<Slot> = device
            .allocate_command_buffers(&info)
            .unwrap()
            .into_iter()
            .map(|commands| {
                let fence = device.create_fence(&vk::FenceCreateInfo::default(), None).unwrap();
                let frame = Frame::new(&gpu, &mesh);
                Slot { commands, fence, frame, staging: gpu.upload("olbvh.test.staging", &mesh.points).unwrap(), shown: None }
            })
            .collect();
        let mut recorders: [Option<Recorder<'_>>; SLOTS] = [None, None];
        let held = |gpu: &Gpu| gpu.allocated().unwrap().total_capacity_bytes;
        let (total, mut bytes) = (frames(), 0);
        for i in 0..total + SLOTS as u32 {
            let slot = &mut slots[i as usize % SLOTS];
            if let Some(shown) = slot.shown.take() {
                device.wait_for_fences(&[slot.fence], true, u64::MAX).unwrap();
                device.reset_fences(&[slot.fence]).unwrap();
                recorders[i as usize % SLOTS] = None;
                compare(&gpu, slot, &shown, i - SLOTS as u32);
            }
            if i >= total {
                continue;
            }
            let moved = deformed(&mesh, i);
            slot.staging = gpu.upload("olbvh.test.staging", &moved.points).unwrap();
            let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            device.begin_command_buffer(slot.commands, &begin).unwrap();
            let mut recorder = Recorder::new(&gpu, slot.commands, None);
            recorder.copy(slot.staging.all(), slot.frame.input.positions);
            recorder.barrier("frame.positions → frame.mesh");
            if i < SLOTS as u32 { slot.frame.record(&mut recorder) } else { slot.frame.record_moved(&mut recorder) }.unwrap();
            recorder.barrier("frame.locate → host");
            recorder.finish().unwrap();
            recorders[i as usize % SLOTS] = Some(recorder);
            device.end_command_buffer(slot.commands).unwrap();
            let submit = [vk::SubmitInfo::default().command_buffers(std::slice::from_ref(&slot.commands))];
            // The queue's lock is the one that `gpu` takes for its own submissions.
            queue.locked(&mut |queue| device.queue_submit(queue, &submit, slot.fence).unwrap());
            slot.shown = Some(moved);
            if i == SLOTS as u32 {
                bytes = held(&gpu);
            }
        }
        assert_eq!(held(&gpu), bytes, "blocks of the allocator");
        println!("{total} rebuilds, {SLOTS} in flight, each the tree of a fresh build");
        drop(recorders);
        for slot in slots {
            device.destroy_fence(slot.fence, None);
        }
        device.destroy_command_pool(pool, None);
    }
}
