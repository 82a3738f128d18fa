//! Tests of the recording functions, called as a C host calls them.

#[path = "../../tests/gpu/host/mod.rs"]
mod host;
mod pictures;
mod plans;
mod queries;

use super::host::{LentQueue, OlbvhHostDevice, OlbvhHostRequirements, olbvh_gpu_from_host, olbvh_host_check};
use super::record::*;
use super::*;
use crate::gpu::{Binding, BufferRef, HostDevice, HostQueue, Recorder, Requirements, USAGE, failed};
use crate::mesh::kuhn_jittered;
use crate::reference::boundary::topology;
use crate::reference::build::build;
use crate::reference::locate::Locator;
use ash::vk::{self, Handle};
use host::Host;
use host::counted::{ARMED, CALLS, counting};
use std::ffi::c_void;
use std::ptr::null;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};

/// Number of timestamp queries: too few for all stages of a frame.
const QUERIES: u32 = 8;

fn message() -> String {
    // SAFETY: the pointer is a C string that is valid until the next call.
    unsafe { CStr::from_ptr(olbvh_last_error()) }.to_string_lossy().into_owned()
}

fn ok(status: OlbvhStatus) {
    assert_eq!(status, OlbvhStatus::Ok, "{}", message());
}

/// The value that a call writes through its last argument.
fn made<T>(call: impl FnOnce(*mut T) -> OlbvhStatus) -> T {
    let mut out = std::mem::MaybeUninit::zeroed();
    ok(call(out.as_mut_ptr()));
    // SAFETY: the call succeeded, so it has filled the value.
    unsafe { out.assume_init() }
}

/// Records three frames on the host's device, after a rehearsal; recording them creates nothing.
fn frames(gpu: *mut OlbvhGpu) {
    let mesh = kuhn_jittered([5, 4, 3], 0.3, 1).unwrap();
    let (points, tets) = (mesh.points.len() as u32, mesh.tets.len() as u32);
    let device = &handle(gpu, "gpu").unwrap().0;
    let (positions, cells) = (device.upload("olbvh.test.positions", &mesh.points), device.upload("olbvh.test.cells", &mesh.tets));
    let (positions, cells) = (positions.unwrap(), cells.unwrap());
    let mut plan = OlbvhPlan { points, stride: 3, tets, level: 6, longest_leaf: 0, build: olbvh_default_build_options() };
    let sizes: OlbvhPlanSizes = made(|out| olbvh_plan_measure(gpu, &raw const plan, out));
    let address =
        if device.binding() == Binding::Address { vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS } else { vk::BufferUsageFlags::empty() };
    assert_eq!((sizes.alignment, sizes.usage), (256, (USAGE | address).as_raw()));
    let buffer = |bytes: u64| device.buffer("olbvh.test.memory", bytes).unwrap();
    let (memory, scratch) = (buffer(sizes.memory), buffer(sizes.scratch));
    let (owners, barycentrics) = (buffer(4 * u64::from(points)), buffer(16 * u64::from(points)));
    let part = |b: BufferRef| OlbvhBuffer::from(b);
    let place = |plan: &OlbvhPlan, memory: BufferRef, out| {
        olbvh_scene_place(gpu, plan, part(positions.all()), part(cells.all()), part(memory), part(scratch.all()), out)
    };
    let mut none = null_mut();
    assert_eq!(place(&plan, memory.all().part(0, sizes.memory / 2), &raw mut none), OlbvhStatus::Invalid);
    plan.points += 1;
    assert_eq!(place(&plan, memory.all(), &raw mut none), OlbvhStatus::Invalid);
    assert!(none.is_null() && message().contains("positions"), "{}", message());
    plan.points -= 1;
    let moved = |b: BufferRef, by: u64| BufferRef { offset: b.offset + by, ..b };
    assert_eq!(place(&plan, moved(memory.all(), 128), &raw mut none), OlbvhStatus::Invalid);
    assert!(none.is_null() && message().contains("at a multiple of 256"), "{}", message());
    let odd = [moved(positions.all(), 64), cells.all(), memory.all(), scratch.all()].map(part);
    assert_eq!(olbvh_scene_place(gpu, &raw const plan, odd[0], odd[1], odd[2], odd[3], &raw mut none), OlbvhStatus::Invalid);
    assert!(none.is_null() && message().contains("positions at byte 64"), "{}", message());
    let scene: *mut OlbvhScene = made(|out| place(&plan, memory.all(), out));
    let recording: *mut OlbvhRecording = made(|out| olbvh_recording_new(gpu, out));
    let (owners_of, weights) = (part(owners.all()), part(barycentrics.all()));
    let location = OlbvhLocation {
        points: part(positions.all()),
        stride: 3,
        count: points,
        tolerance: -1.0,
        path: 0,
        hints: OlbvhBuffer::default(),
        memory: OlbvhBuffer::default(),
        owners: owners_of,
        barycentrics: weights,
    };
    // With the owners so far as hints, in place.
    let hinted = OlbvhLocation { hints: owners_of, ..location };
    // The host's own barrier, which it may report to olbvh or not.
    let own_barrier = |commands: u64, told: bool| {
        let stages = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
        let writes = vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE;
        let barrier = [vk::MemoryBarrier::default().src_access_mask(writes).dst_access_mask(writes | vk::AccessFlags::SHADER_READ)];
        if commands != 0 {
            let commands = vk::CommandBuffer::from_raw(commands);
            // SAFETY: the command buffer is in the recording state.
            unsafe { device.device().cmd_pipeline_barrier(commands, stages, stages, vk::DependencyFlags::empty(), &barrier, &[], &[]) };
        }
        if told {
            ok(olbvh_recording_host_barrier(recording));
        }
    };
    let record = |commands: u64, queries: vk::QueryPool, told: bool| {
        ok(olbvh_recording_begin(recording, commands, queries.as_raw(), QUERIES));
        ok(olbvh_cmd_build(recording, scene));
        ok(olbvh_cmd_rebuild(recording, scene));
        ok(olbvh_cmd_locate(recording, scene, &raw const location));
        ok(olbvh_cmd_barrier(recording));
        ok(olbvh_cmd_locate(recording, scene, &raw const location));
        own_barrier(commands, told);
        ok(olbvh_cmd_locate(recording, scene, &raw const hinted));
        olbvh_recording_end(recording)
    };
    assert_eq!(record(0, vk::QueryPool::null(), false), OlbvhStatus::Invalid);
    assert!(message().contains("no barrier between them"), "{}", message());
    assert_eq!(olbvh_cmd_barrier(recording), OlbvhStatus::Invalid, "it has ended");
    assert_eq!(olbvh_recording_host_barrier(recording), OlbvhStatus::Invalid, "it has ended");
    ok(record(0, vk::QueryPool::null(), true));

    let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(QUERIES);
    // SAFETY: the create info is complete, and the query pool is destroyed below.
    let queries = unsafe { device.device().create_query_pool(&info, None) }.unwrap();
    let before = CALLS.get();
    ARMED.set(true);
    ok(record(0, vk::QueryPool::null(), true));
    ARMED.set(false);
    assert_eq!(CALLS.get(), before, "calls made by another rehearsal");
    for _ in 0..3 {
        let frame = |r: &mut Recorder<'_>| {
            // SAFETY: the command buffer is in the recording state, and no pending command uses the queries.
            unsafe { device.device().cmd_reset_query_pool(r.commands(), queries, 0, QUERIES) };
            ARMED.set(true);
            let status = record(r.commands().as_raw(), queries, true);
            ARMED.set(false);
            ok(status);
            Ok(())
        };
        device.submit("olbvh.test.frame", frame).unwrap();
    }
    assert_eq!(CALLS.get(), before, "calls made while recording");
    let (mut ticks, flags) = ([0u64; QUERIES as usize], vk::QueryResultFlags::TYPE_64);
    // SAFETY: `submit` has waited for the commands, and all queries have been written, since there are more stages than
    // that.
    unsafe {
        device.device().get_query_pool_results(queries, 0, &mut ticks, flags).unwrap();
        device.device().destroy_query_pool(queries, None);
    }
    let mut used = Vec::new();
    for i in 0..QUERIES / 2 {
        let stage: OlbvhStage = made(|out| olbvh_recording_stage(recording, i, out));
        // SAFETY: the name ends with a zero byte.
        let name = unsafe { CStr::from_ptr(stage.name.as_ptr()) }.to_str().unwrap();
        assert!(name.starts_with("mesh.") || name.starts_with("build."), "{name}");
        assert!(ticks[stage.begin as usize] <= ticks[stage.end as usize], "{name}: {ticks:?}");
        used.extend([stage.begin, stage.end]);
    }
    used.sort_unstable();
    assert_eq!(used, (0..QUERIES).collect::<Vec<_>>());
    let mut none = std::mem::MaybeUninit::uninit();
    assert_eq!(olbvh_recording_stage(recording, QUERIES / 2, none.as_mut_ptr()), OlbvhStatus::Invalid);
    let (topology, found) = (topology(&mesh).unwrap(), device.download::<u32>(&owners, owners.all()).unwrap());
    let host = build(&mesh, &topology, &BuildOptions::default()).unwrap();
    let locator = Locator::new(&mesh, &topology, &host);
    assert_eq!(found, mesh.points.iter().map(|&p| locator.locate(p).owner).collect::<Vec<_>>());

    let arrays: OlbvhSceneArrays = made(|out| olbvh_scene_arrays(scene, null(), out));
    let status: Vec<u32> = device.download(&memory, memory.all().part(arrays.status.offset, 16)).unwrap();
    assert_eq!((status[0], status[3]), (host.grid.level, host.p.len() as u32));
    assert!(arrays.bindings.iter().take(6).all(|b| b.buffer == memory.all().buffer.as_raw()));
    // A field of size 0 is none, and one that is too small is refused.
    let mut field = OlbvhBuffer { size: 0, ..weights };
    let same: OlbvhSceneArrays = made(|out| olbvh_scene_arrays(scene, &raw const field, out));
    assert_eq!(same.addresses, arrays.addresses);
    field.size = 4 * u64::from(points) - 1;
    let mut none = std::mem::MaybeUninit::uninit();
    assert_eq!(olbvh_scene_arrays(scene, &raw const field, none.as_mut_ptr()), OlbvhStatus::Invalid);
    olbvh_recording_free(recording);
    olbvh_scene_free(scene);
}

/// The lock of a host, which counts how often it was taken.
#[derive(Default)]
struct Held {
    now: AtomicBool,
    times: AtomicU32,
}

unsafe extern "C" fn lock(held: *mut c_void) {
    // SAFETY: the pointer is the one that the test passed, to a `Held` that outlives the `Gpu`.
    let held = unsafe { &*held.cast::<Held>() };
    assert!(!held.now.swap(true, Relaxed));
    held.times.fetch_add(1, Relaxed);
}

unsafe extern "C" fn unlock(held: *mut c_void) {
    // SAFETY: the pointer is the one that the test passed, to a `Held` that outlives the `Gpu`.
    assert!(unsafe { &*held.cast::<Held>() }.now.swap(false, Relaxed));
}

unsafe extern "C" fn nothing(_: *mut c_void) {}

/// A thread that holds its host's lock, which it may take several times, need not wait for anything else.
#[test]
fn a_lent_queue_has_no_lock_but_the_hosts() {
    let queue = LentQueue { queue: vk::Queue::null(), lock: [nothing; 2], argument: null_mut() };
    let (told, heard) = std::sync::mpsc::channel();
    std::thread::spawn(move || queue.locked(&mut |_| queue.locked(&mut |_| told.send(()).unwrap())));
    heard.recv_timeout(std::time::Duration::from_secs(10)).unwrap();
}

#[test]
fn any_call_may_be_short_of_memory() {
    let error = failed("vkQueueSubmit")(vk::Result::ERROR_OUT_OF_DEVICE_MEMORY);
    assert!(error.is_lack_of_room());
    assert_eq!(status_of(&error), OlbvhStatus::Memory);
}

#[test]
fn a_c_host_records_by_address_and_asks() {
    let host = Host::new();
    // SAFETY: one function pointer type is cast to another, and back before the call.
    let get =
        unsafe { std::mem::transmute::<*const (), unsafe extern "C" fn()>(host.entry.static_fn().get_instance_proc_addr as *const ()) };
    let (instance, physical) = (host.instance.handle().as_raw(), host.physical.as_raw());
    let needs: OlbvhHostRequirements = made(|out| olbvh_host_check(Some(get), instance, physical, out));
    let told = [needs.buffer_addresses, needs.shader_int64, needs.subgroup_size_control].map(|told| told != 0);
    assert_eq!((needs.queue_family, told), (host.family, [host.addresses, host.int64, host.control]));
    // SAFETY: `extension_count` entries are static C strings.
    let names = needs.extensions[..needs.extension_count as usize].iter().map(|&name| unsafe { CStr::from_ptr(name) });
    // SAFETY: the physical device belongs to this instance.
    let known = unsafe { Requirements::check(&host.instance, host.physical) };
    assert!(names.eq(known.extensions.iter().copied()), "{needs:?}");
    assert_eq!(olbvh_host_check(None, instance, physical, std::ptr::from_ref(&needs).cast_mut()), OlbvhStatus::Invalid);
    let held = Held::default();
    let mut lent = OlbvhHostDevice {
        get_instance_proc_addr: Some(get),
        instance,
        physical_device: physical,
        device: host.device.handle().as_raw(),
        queue: host.queue().lock().unwrap().as_raw(),
        lock_queue: Some(lock),
        unlock_queue: Some(unlock),
        queue_lock: (&raw const held).cast_mut().cast(),
        pipeline_cache: 0,
        queue_family: host.family,
        buffer_addresses: u32::from(host.addresses),
        shader_int64: u32::from(host.int64),
        subgroup_size_control: u32::from(host.control),
        debug_utils: 0,
    };
    let gpu = made(|out| olbvh_gpu_from_host(&raw const lent, out));
    frames(gpu);
    queries::owned(gpu);
    olbvh_gpu_free(gpu);
    // Without a queue, only recording is possible; here with the host's pipeline cache.
    // SAFETY: the create info is complete, and the cache is destroyed below, when nothing uses it any more.
    let cache = unsafe { host.device.create_pipeline_cache(&vk::PipelineCacheCreateInfo::default(), None) }.unwrap();
    (lent.queue, lent.pipeline_cache) = (0, cache.as_raw());
    let gpu = made(|out| olbvh_gpu_from_host(&raw const lent, out));
    let recording: *mut OlbvhRecording = made(|out| olbvh_recording_new(gpu, out));
    ok(olbvh_recording_begin(recording, 0, 0, 0));
    ok(olbvh_cmd_barrier(recording));
    ok(olbvh_recording_end(recording));
    olbvh_recording_free(recording);
    let (point, tet, mut mesh) = ([[0f32; 3]; 4], [[0u32, 1, 2, 3]], null_mut());
    let upload = olbvh_mesh_upload(gpu, point.as_ptr().cast(), 4, tet.as_ptr().cast(), 1, 0, &raw mut mesh);
    assert!(upload == OlbvhStatus::Invalid && message().contains("lent no queue"), "{}", message());
    assert_eq!(handle(gpu, "gpu").unwrap().0.pipeline_cache(), cache);
    olbvh_gpu_free(gpu);
    // SAFETY: the cache was created by this device, and the `Gpu` that used it has been freed.
    unsafe { host.device.destroy_pipeline_cache(cache, None) };
    lent.device = 0;
    let mut none = null_mut();
    assert_eq!(olbvh_gpu_from_host(&raw const lent, &raw mut none), OlbvhStatus::Invalid);
}

#[test]
fn a_c_host_records_by_descriptors_and_makes_nothing() {
    let host = Host::new();
    let options = GpuOptions { binding: Some(Binding::Descriptors), ..GpuOptions::default() };
    // SAFETY: the host's handles belong to one device and outlive the frames; the counted functions call the device's
    // own.
    let gpu = unsafe { Gpu::from_raw(HostDevice { device: counting(&host.device), ..host.lend() }, &options) }.unwrap();
    let gpu = Box::into_raw(Box::new(OlbvhGpu(gpu)));
    frames(gpu);
    queries::recorded(gpu);
    olbvh_gpu_free(gpu);
}
