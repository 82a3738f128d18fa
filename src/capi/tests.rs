//! Tests of the recording functions, called as a C host calls them.

#[path = "../../tests/gpu/host/mod.rs"]
mod host;

/// Calls a function as C does: without `unsafe`.
macro_rules! call {
    ($call:expr) => {{
        // SAFETY: these tests pass pointers to what is theirs, or null, and handles that they free last.
        unsafe { $call }
    }};
}

mod owned;
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
use std::ptr::{null, null_mut};
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
    let device = &call!(handle(gpu, "gpu")).unwrap().0;
    let (positions, cells) = (device.upload("olbvh.test.positions", &mesh.points), device.upload("olbvh.test.cells", &mesh.tets));
    let (positions, cells) = (positions.unwrap(), cells.unwrap());
    let mut plan = OlbvhPlan { points, stride: 3, tets, level: 6, longest_leaf: 0, build: olbvh_default_build_options() };
    let sizes: OlbvhPlanSizes = made(|out| call!(olbvh_plan_measure(gpu, &raw const plan, out)));
    let address =
        if device.binding() == Binding::Address { vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS } else { vk::BufferUsageFlags::empty() };
    assert_eq!((sizes.alignment, sizes.usage), (256, (USAGE | address).as_raw()));
    let buffer = |bytes: u64| device.buffer("olbvh.test.memory", bytes).unwrap();
    let (memory, scratch) = (buffer(sizes.memory), buffer(sizes.scratch));
    let (owners, barycentrics) = (buffer(4 * u64::from(points)), buffer(16 * u64::from(points)));
    let part = |b: BufferRef| OlbvhBuffer::from(b);
    let place = |plan: &OlbvhPlan, memory: BufferRef, out| {
        call!(olbvh_scene_place(gpu, plan, part(positions.all()), part(cells.all()), part(memory), part(scratch.all()), out))
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
    assert_eq!(call!(olbvh_scene_place(gpu, &raw const plan, odd[0], odd[1], odd[2], odd[3], &raw mut none)), OlbvhStatus::Invalid);
    assert!(none.is_null() && message().contains("positions at byte 64"), "{}", message());
    let scene: *mut OlbvhScene = made(|out| place(&plan, memory.all(), out));
    let recording: *mut OlbvhRecording = made(|out| call!(olbvh_recording_new(gpu, out)));
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
            ok(call!(olbvh_recording_host_barrier(recording)));
        }
    };
    let record = |commands: u64, queries: vk::QueryPool, told: bool| {
        ok(call!(olbvh_recording_begin(recording, commands, queries.as_raw(), QUERIES)));
        ok(call!(olbvh_cmd_build(recording, scene)));
        ok(call!(olbvh_cmd_rebuild(recording, scene)));
        ok(call!(olbvh_cmd_locate(recording, scene, &raw const location)));
        ok(call!(olbvh_cmd_barrier(recording)));
        ok(call!(olbvh_cmd_locate(recording, scene, &raw const location)));
        own_barrier(commands, told);
        ok(call!(olbvh_cmd_locate(recording, scene, &raw const hinted)));
        call!(olbvh_recording_end(recording))
    };
    assert_eq!(record(0, vk::QueryPool::null(), false), OlbvhStatus::Invalid);
    assert!(message().contains("no barrier between them"), "{}", message());
    assert_eq!(call!(olbvh_cmd_barrier(recording)), OlbvhStatus::Invalid, "it has ended");
    assert_eq!(call!(olbvh_recording_host_barrier(recording)), OlbvhStatus::Invalid, "it has ended");
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
        let stage: OlbvhStage = made(|out| call!(olbvh_recording_stage(recording, i, out)));
        // SAFETY: the name ends with a zero byte.
        let name = unsafe { CStr::from_ptr(stage.name.as_ptr()) }.to_str().unwrap();
        assert!(name.starts_with("mesh.") || name.starts_with("build."), "{name}");
        assert!(ticks[stage.begin as usize] <= ticks[stage.end as usize], "{name}: {ticks:?}");
        used.extend([stage.begin, stage.end]);
    }
    used.sort_unstable();
    assert_eq!(used, (0..QUERIES).collect::<Vec<_>>());
    let mut none = std::mem::MaybeUninit::uninit();
    assert_eq!(call!(olbvh_recording_stage(recording, QUERIES / 2, none.as_mut_ptr())), OlbvhStatus::Invalid);
    let (topology, found) = (topology(&mesh).unwrap(), device.download::<u32>(&owners, owners.all()).unwrap());
    let host = build(&mesh, &topology, &BuildOptions::default()).unwrap();
    let locator = Locator::new(&mesh, &topology, &host);
    assert_eq!(found, mesh.points.iter().map(|&p| locator.locate(p).owner).collect::<Vec<_>>());

    let arrays: OlbvhSceneArrays = made(|out| call!(olbvh_scene_arrays(scene, null(), out)));
    let status: Vec<u32> = device.download(&memory, memory.all().part(arrays.status.offset, 16)).unwrap();
    assert_eq!((status[0], status[3]), (host.grid.level, host.p.len() as u32));
    assert!(arrays.bindings.iter().take(6).all(|b| b.buffer == memory.all().buffer.as_raw()));
    // A field of size 0 is none, and one that is too small is refused.
    let mut field = OlbvhBuffer { size: 0, ..weights };
    let same: OlbvhSceneArrays = made(|out| call!(olbvh_scene_arrays(scene, &raw const field, out)));
    assert_eq!(same.addresses, arrays.addresses);
    field.size = 4 * u64::from(points) - 1;
    let mut none = std::mem::MaybeUninit::uninit();
    assert_eq!(call!(olbvh_scene_arrays(scene, &raw const field, none.as_mut_ptr())), OlbvhStatus::Invalid);
    call!(olbvh_recording_free(recording));
    call!(olbvh_scene_free(scene));
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

/// The pointer, one byte further.
fn odd<T>(pointer: *const T) -> *mut T {
    pointer.cast_mut().wrapping_byte_add(1)
}

#[test]
fn misaligned_pointers_and_null_are_refused() {
    let refused = |status: OlbvhStatus, what: &str| assert!(status == OlbvhStatus::Invalid && message().contains(what), "{}", message());
    let (nothing, parts, corner) = (OlbvhBuffer::default(), OlbvhNearestParts::default(), [0f32; 3].as_ptr());
    let out = &raw const parts;
    refused(call!(olbvh_nearest_parts(1, nothing, null_mut())), "the place for the result is null");
    refused(call!(olbvh_nearest_parts(1, nothing, odd(out))), "the place for the result at address");
    let settings = super::query::olbvh_default_picture_settings();
    let view = |settings, lo, hi| call!(olbvh_view_make(settings, lo, hi, null_mut()));
    refused(view(odd(&raw const settings), corner, corner), "settings at address");
    refused(view(&raw const settings, odd(corner), corner), "lo at address");
    refused(view(&raw const settings, corner, null()), "hi is null");
    refused(call!(olbvh_recording_end(odd(null()))), "recording at address 0x1, which is not a multiple of 8");
    // Without elements, an array may be anywhere.
    let numbers = [1u32, 2, 3];
    let read = |pointer, count| call!(array::<u32>(pointer, count, "numbers")).map(<[u32]>::to_vec).map_err(|e| e.to_string());
    let length = |pointer, count| call!(array_mut::<u32>(pointer, count, "numbers")).map(|array| array.len()).map_err(|e| e.to_string());
    assert_eq!((read(numbers.as_ptr(), 3), read(null(), 0), read(odd(null()), 0)), (Ok(numbers.to_vec()), Ok(vec![]), Ok(vec![])));
    assert_eq!((length(null_mut(), 0), length(odd(null()), 0)), (Ok(0), Ok(0)));
    for (pointer, fault) in [(null_mut(), "numbers is null"), (odd(numbers.as_ptr()), "which is not a multiple of 4")] {
        for error in [read(pointer, 1).unwrap_err(), length(pointer, 1).unwrap_err()] {
            assert!(error.contains(fault), "{error}");
        }
    }
    assert!(read(numbers.as_ptr(), usize::MAX).is_err() && length(numbers.as_ptr().cast_mut(), usize::MAX).is_err());
    // What may be missing is null, not misaligned.
    assert!(call!(optional::<u32>(null(), "number")).is_ok_and(|none| none.is_none()));
    assert!(call!(optional(odd(numbers.as_ptr()), "number")).is_err());
    // Nothing is freed.
    call!(olbvh_gpu_free(odd(null())));
    assert!(message().contains("gpu at address 0x1"), "{}", message());
    call!(olbvh_gpu_free(null_mut()));
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
    let needs: OlbvhHostRequirements = made(|out| call!(olbvh_host_check(Some(get), instance, physical, out)));
    let told = [needs.buffer_addresses, needs.shader_int64, needs.subgroup_size_control].map(|told| told != 0);
    assert_eq!((needs.queue_family, told), (host.family, [host.addresses, host.int64, host.control]));
    // SAFETY: `extension_count` entries are static C strings.
    let names = needs.extensions[..needs.extension_count as usize].iter().map(|&name| unsafe { CStr::from_ptr(name) });
    // SAFETY: the physical device belongs to this instance.
    let known = unsafe { Requirements::check(&host.instance, host.physical) };
    assert!(names.eq(known.extensions.iter().copied()), "{needs:?}");
    assert_eq!(call!(olbvh_host_check(None, instance, physical, std::ptr::from_ref(&needs).cast_mut())), OlbvhStatus::Invalid);
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
    let gpu = made(|out| call!(olbvh_gpu_from_host(&raw const lent, out)));
    frames(gpu);
    owned::owned(gpu);
    call!(olbvh_gpu_free(gpu));
    // Without a queue, only recording is possible; here with the host's pipeline cache.
    // SAFETY: the create info is complete, and the cache is destroyed below, when nothing uses it any more.
    let cache = unsafe { host.device.create_pipeline_cache(&vk::PipelineCacheCreateInfo::default(), None) }.unwrap();
    (lent.queue, lent.pipeline_cache) = (0, cache.as_raw());
    let gpu = made(|out| call!(olbvh_gpu_from_host(&raw const lent, out)));
    let recording: *mut OlbvhRecording = made(|out| call!(olbvh_recording_new(gpu, out)));
    ok(call!(olbvh_recording_begin(recording, 0, 0, 0)));
    ok(call!(olbvh_cmd_barrier(recording)));
    ok(call!(olbvh_recording_end(recording)));
    call!(olbvh_recording_free(recording));
    let (point, tet, mut mesh) = ([[0f32; 3]; 4], [[0u32, 1, 2, 3]], null_mut());
    let upload = call!(olbvh_mesh_upload(gpu, point.as_ptr().cast(), 4, tet.as_ptr().cast(), 1, 0, &raw mut mesh));
    assert!(upload == OlbvhStatus::Invalid && message().contains("lent no queue"), "{}", message());
    assert_eq!(call!(handle(gpu, "gpu")).unwrap().0.pipeline_cache(), cache);
    call!(olbvh_gpu_free(gpu));
    // SAFETY: the cache was created by this device, and the `Gpu` that used it has been freed.
    unsafe { host.device.destroy_pipeline_cache(cache, None) };
    lent.device = 0;
    let mut none = null_mut();
    assert_eq!(call!(olbvh_gpu_from_host(&raw const lent, &raw mut none)), OlbvhStatus::Invalid);
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
    call!(olbvh_gpu_free(gpu));
}
