//! Embedding: the host's device, queue, allocator and pipeline cache, and recording that does nothing but record.

#![allow(unsafe_code, reason = "plain Vulkan, beside the crate")]

use crate::host::baseline::Baseline;
use crate::host::counted::{ARMED, CALLS, counting};
use crate::host::live::{FAILING, FALLIBLE, live, watching};
use crate::host::queries::Queries;
use crate::host::{Frame, Host};
use crate::not_run::not_run;
use crate::submit::submit;
use ash::vk;
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{
    Binding, DescriptorPools, DescriptorRoom, EnabledFeatures, Gpu, GpuOptions, HostDevice, HostQueue, Recorder, Requirements, Target,
};
use olbvh::mesh::{Mesh, kuhn_jittered};
use olbvh::options::BuildOptions;
use olbvh::query::{LocateOptions, SILENT, locate};
use std::ffi::c_char;
use std::panic::AssertUnwindSafe;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Barrier, Mutex, OnceLock, PoisonError};

fn owners(gpu: &Gpu, mesh: &Mesh) -> Vec<u32> {
    let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(gpu, &device, &BuildOptions::default()).unwrap();
    locate(&tree, &mesh.points, None, &LocateOptions::default(), SILENT).unwrap().owners
}

#[test]
fn a_hosts_device_allocator_and_cache_are_used_and_left() {
    let host = Host::new();
    let mesh = kuhn_jittered([6; 3], 0.3, 1).unwrap();
    let expected = owners(&Gpu::new(&GpuOptions::default()).unwrap(), &mesh);
    let allocator = Allocator::new(&AllocatorCreateDesc {
        instance: host.instance.clone(),
        device: host.device.clone(),
        physical_device: host.physical,
        debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
        buffer_device_address: host.addresses,
        allocation_sizes: gpu_allocator::AllocationSizes::default(),
    });
    let allocator = Arc::new(Mutex::new(allocator.unwrap()));
    // SAFETY: the cache belongs to the device and is destroyed below.
    let cache = unsafe { host.device.create_pipeline_cache(&vk::PipelineCacheCreateInfo::default(), None) }.unwrap();
    for binding in [Binding::Address, Binding::Descriptors] {
        let lent = HostDevice { allocator: Some(allocator.clone()), pipeline_cache: Some(cache), ..host.lend() };
        let options = GpuOptions { binding: Some(binding), ..GpuOptions::default() };
        // SAFETY: the host's handles belong together and outlive `gpu`.
        let gpu = unsafe { Gpu::from_raw(lent, &options) }.unwrap();
        let _mesh = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
        let held = allocator.lock().unwrap().generate_report().total_allocated_bytes;
        assert!(held > 0 && gpu.allocated().unwrap().total_allocated_bytes == held, "the allocator is the host's");
        assert_eq!(owners(&gpu, &mesh), expected);
    }
    assert_eq!(allocator.lock().unwrap().generate_report().allocations.len(), 0, "everything is given back");
    // SAFETY: no pipeline is being made with the cache; the allocator frees its blocks while the device still exists.
    unsafe { host.device.destroy_pipeline_cache(cache, None) };
    drop(allocator);
}

/// A queue of a host that does what it should not: it passes the queue on twice.
struct Twice(Arc<Mutex<vk::Queue>>);

// SAFETY: the lock is held.
unsafe impl HostQueue for Twice {
    fn locked(&self, submit: &mut dyn FnMut(vk::Queue)) {
        let queue = self.0.lock().unwrap();
        submit(*queue);
        submit(*queue);
    }
}

#[test]
fn commands_are_submitted_once() {
    let host = Host::new();
    let queue: Arc<dyn HostQueue> = Arc::new(Twice(host.queue()));
    // SAFETY: as above.
    let gpu = unsafe { Gpu::from_raw(HostDevice { queue: Some(queue), ..host.lend() }, &GpuOptions::default()) }.unwrap();
    let mesh = kuhn_jittered([3; 3], 0.3, 1).unwrap();
    assert!(owners(&gpu, &mesh).iter().all(|&o| o != u32::MAX));
}

/// A queue whose lock panics, once, when it has passed the queue on.
struct Panics(Arc<Mutex<vk::Queue>>, AtomicBool);

// SAFETY: the lock is held.
unsafe impl HostQueue for Panics {
    fn locked(&self, submit: &mut dyn FnMut(vk::Queue)) {
        let queue = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        submit(*queue);
        assert!(!self.1.swap(false, Ordering::Relaxed), "the host's lock fails");
    }
}

/// What a submission uses is freed only when it has been executed, also if the call unwinds.
#[test]
fn a_host_that_panics_frees_nothing_in_use() {
    let host = Host::new();
    let queue = Arc::new(Panics(host.queue(), AtomicBool::new(false)));
    // SAFETY: as above.
    let gpu = unsafe { Gpu::from_raw(HostDevice { queue: Some(queue.clone()), ..host.lend() }, &GpuOptions::default()) }.unwrap();
    let words = vec![7u32; 1 << 20];
    let buffer = gpu.upload("olbvh.test.words", &words).unwrap();
    queue.1.store(true, Ordering::Relaxed);
    let copied = std::panic::catch_unwind(AssertUnwindSafe(|| {
        let to = gpu.buffer("olbvh.test.copy", buffer.size()).unwrap();
        submit(&gpu, "olbvh.test.copy", |r| {
            r.copy(buffer.all(), to.all());
            Ok(())
        })
    }));
    assert!(copied.is_err(), "the panic reaches the caller");
    assert_eq!(gpu.download::<u32>(&buffer, buffer.all()).unwrap(), words, "the device works on");
}

#[test]
fn without_a_queue_only_recording_works() {
    let host = Host::new();
    // SAFETY: as above.
    let gpu = unsafe { Gpu::from_raw(HostDevice { queue: None, ..host.lend() }, &GpuOptions::default()) }.unwrap();
    let error = submit(&gpu, "olbvh.test.run", |_| Ok(())).unwrap_err();
    assert!(error.to_string().contains("lent no queue"), "{error}");
}

#[test]
fn what_is_not_enabled_is_not_used() {
    let host = Host::new();
    let lent = HostDevice { enabled: EnabledFeatures { buffer_addresses: false, ..host.enabled() }, ..host.lend() };
    // SAFETY: as above.
    let gpu = unsafe { Gpu::from_raw(lent, &GpuOptions::default()) }.unwrap();
    assert_eq!(gpu.binding(), Binding::Descriptors);
    let mesh = kuhn_jittered([3; 3], 0.3, 1).unwrap();
    assert!(owners(&gpu, &mesh).iter().all(|&o| o != u32::MAX));
    // SAFETY: as above; a family that does not exist is refused.
    let odd = unsafe { Gpu::from_raw(HostDevice { family: 99, ..host.lend() }, &GpuOptions::default()) };
    assert!(odd.unwrap_err().to_string().contains("queue family 99"));
}

/// The messages that were logged.
struct Log(Mutex<Vec<String>>);

static LOG: Log = Log(Mutex::new(Vec::new()));

impl log::Log for Log {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.level() <= log::Level::Warn
    }

    fn log(&self, record: &log::Record<'_>) {
        self.0.lock().unwrap().push(record.args().to_string());
    }

    fn flush(&self) {}
}

unsafe extern "system" fn list_nothing(
    _: vk::PhysicalDevice,
    _: *const c_char,
    count: *mut u32,
    _: *mut vk::ExtensionProperties,
) -> vk::Result {
    // SAFETY: `count` is the caller's valid pointer.
    unsafe { *count = 0 };
    vk::Result::SUCCESS
}

static PROPERTIES: OnceLock<vk::PFN_vkGetPhysicalDeviceProperties2> = OnceLock::new();

/// The driver's properties, with subgroups of up to 128 lanes.
unsafe extern "system" fn vary_subgroups(physical: vk::PhysicalDevice, properties: *mut vk::PhysicalDeviceProperties2<'_>) {
    // SAFETY: `properties` is a chain of the caller's valid structs, each of which starts like `BaseOutStructure`.
    unsafe {
        PROPERTIES.get().unwrap()(physical, properties);
        let mut next = (*properties).p_next.cast::<vk::BaseOutStructure<'_>>();
        while let Some(found) = next.as_mut() {
            if found.s_type == vk::StructureType::PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_PROPERTIES {
                (*next.cast::<vk::PhysicalDeviceSubgroupSizeControlProperties<'_>>()).max_subgroup_size = 128;
            }
            next = found.p_next;
        }
    }
}

/// Subgroup size control is a part of Vulkan 1.3, whether its extension is listed or not. If sizes vary and it is not
/// enabled, a warning says so.
#[test]
fn subgroup_size_control_is_found_and_missed() {
    let host = Host::new();
    let (functions, mut one) = (&host.instance, host.instance.fp_v1_1().clone());
    let mut zero = functions.fp_v1_0().clone();
    zero.enumerate_device_extension_properties = list_nothing;
    let bare = ash::Instance::from_parts_1_3(functions.handle(), zero, one.clone(), functions.fp_v1_3().clone());
    // SAFETY: the physical device belongs to this instance, of which `bare` has other functions.
    let [listed, unlisted] = [functions, &bare].map(|instance| unsafe { Requirements::check(instance, host.physical) });
    // SAFETY: as above.
    let version = unsafe { functions.get_physical_device_properties(host.physical) }.api_version;
    assert!(unlisted.extensions.is_empty());
    assert_eq!(unlisted.subgroup_size_control, listed.subgroup_size_control && version >= vk::API_VERSION_1_3);

    let _ = log::set_logger(&LOG);
    log::set_max_level(log::LevelFilter::Warn);
    PROPERTIES.get_or_init(|| one.get_physical_device_properties2);
    one.get_physical_device_properties2 = vary_subgroups;
    let varying = ash::Instance::from_parts_1_3(functions.handle(), functions.fp_v1_0().clone(), one, functions.fp_v1_3().clone());
    let warned = || LOG.0.lock().unwrap().iter().filter(|text| text.contains("no size control enabled")).count();
    for (instance, warnings) in [(functions, 0), (&varying, 1)] {
        let enabled = EnabledFeatures { subgroup_size_control: false, ..host.enabled() };
        // SAFETY: as above; features that are not enabled are not used.
        drop(unsafe { Gpu::from_raw(HostDevice { instance: instance.clone(), enabled, ..host.lend() }, &GpuOptions::default()) }.unwrap());
        assert_eq!(warned(), if listed.subgroup_size_control { warnings } else { 0 });
    }
}

static FAMILIES: OnceLock<vk::PFN_vkGetPhysicalDeviceQueueFamilyProperties> = OnceLock::new();

/// The driver's queue families, without timestamps.
unsafe extern "system" fn hide_timestamps(physical: vk::PhysicalDevice, count: *mut u32, families: *mut vk::QueueFamilyProperties) {
    // SAFETY: the caller's valid arguments are passed on; `families` is null or has `count` elements.
    unsafe {
        FAMILIES.get().unwrap()(physical, count, families);
        for i in 0..if families.is_null() { 0 } else { *count as usize } {
            (*families.add(i)).timestamp_valid_bits = 0;
        }
    }
}

#[test]
fn a_family_without_timestamps_gets_none() {
    let host = Host::new();
    let mut zero = host.instance.fp_v1_0().clone();
    FAMILIES.get_or_init(|| zero.get_physical_device_queue_family_properties);
    zero.get_physical_device_queue_family_properties = hide_timestamps;
    let (one, three) = (host.instance.fp_v1_1().clone(), host.instance.fp_v1_3().clone());
    let untimed = ash::Instance::from_parts_1_3(host.instance.handle(), zero, one, three);
    let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(2);
    // SAFETY: the create info is complete, and the queries are destroyed below.
    let queries = unsafe { host.device.create_query_pool(&info, None) }.unwrap();
    for (instance, stages) in [(&host.instance, 1), (&untimed, 0)] {
        // SAFETY: as above.
        let gpu = unsafe { Gpu::from_raw(HostDevice { instance: instance.clone(), ..host.lend() }, &GpuOptions::default()) }.unwrap();
        let record = |r: &mut Recorder<'_>| {
            // SAFETY: these are the commands of `r`, which records nothing meanwhile; no command uses the queries.
            unsafe { gpu.device().cmd_reset_query_pool(r.commands(), queries, 0, 2) };
            // SAFETY: as above.
            let mut recorder = unsafe { Recorder::new(&gpu, r.commands(), Some((queries, 2))) };
            recorder.stage("test", |_| Ok(()))?;
            Ok(recorder.timed_stages().len())
        };
        assert_eq!(submit(&gpu, "olbvh.test.stages", record).unwrap().0, stages);
    }
    // SAFETY: the commands with the queries have been executed.
    unsafe { host.device.destroy_query_pool(queries, None) };
}

#[test]
fn one_device_serves_many_threads() {
    fn shared<T: Send + Sync>() {}
    shared::<Gpu>();
    let mesh = kuhn_jittered([5; 3], 0.3, 1).unwrap();
    let expected = owners(&Gpu::new(&GpuOptions::default()).unwrap(), &mesh);
    let host = Host::new();
    let lent = HostDevice { device: watching(&host.device), ..host.lend() };
    // SAFETY: as above. There is no self-test, since it would compile kernels before the threads do.
    let gpu = unsafe { Gpu::from_raw(lent, &GpuOptions { trust: true, ..GpuOptions::default() }) }.unwrap();
    let start = Barrier::new(4);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                start.wait();
                assert_eq!(owners(&gpu, &mesh), expected);
            });
        }
    });
    drop(gpu);
    assert_eq!(live(&host.device), 0, "of a kernel that two threads compile at a time one pipeline is left");
}

/// If any call fails while a device is opened, everything made on the host's device is destroyed again.
#[test]
fn a_failed_opening_leaves_nothing() {
    let host = Host::new();
    // SAFETY: as above; the watched functions call the device's own functions, or fail.
    let open = |options: &GpuOptions| unsafe { Gpu::from_raw(HostDevice { device: watching(&host.device), ..host.lend() }, options) };
    let gpu = open(&GpuOptions::default()).unwrap();
    let target = Some(Target { each: gpu.subgroup_size() + 1, ..gpu.target().clone() });
    drop(gpu);
    assert!(open(&GpuOptions { target, ..GpuOptions::default() }).is_err());
    assert_eq!(live(&host.device), 0, "a target that does not fit");
    let bindings = [Binding::Address, Binding::Descriptors];
    for binding in &bindings[usize::from(!host.addresses)..] {
        let options = GpuOptions { binding: Some(*binding), ..GpuOptions::default() };
        for (name, before) in FALLIBLE.iter().flat_map(|name| [0, 1, 4].map(|before| (*name, before))) {
            FAILING.set((name, before));
            let opened = open(&options);
            // Some functions are called less often, or not at all.
            let failed = FAILING.replace(("", 0)) == (name, 0) && opened.is_err();
            assert!(failed || before > 0 || name.contains("descriptor") || name.contains("query"), "{name} did not fail");
            drop(opened);
            assert_eq!(live(&host.device), 0, "{binding:?}: {name} failed after {before}");
        }
    }
}

fn nothing_is_made(binding: Binding) {
    let host = Host::tracing();
    let options = GpuOptions { binding: Some(binding), ..GpuOptions::default() };
    // SAFETY: as above; the counted functions call the device's own functions.
    let gpu = unsafe { Gpu::from_raw(HostDevice { device: counting(&host.device), ..host.lend() }, &options) }.unwrap();
    let mesh = kuhn_jittered([6; 3], 0.3, 1).unwrap();
    let frame = Frame::new(&gpu, &mesh);
    let queries = Queries::new(&gpu, &frame, &vec![0.0; mesh.points.len()], &mesh, 1000);
    let baseline = Baseline::new(&gpu, &mesh);
    assert_eq!(baseline.ray_methods(), usize::from(host.rays.queries) + usize::from(host.rays.pipelines));
    let record = |r: &mut Recorder<'_>| {
        frame.record(r)?;
        queries.record(r)?;
        baseline.record_lbvh(r)?;
        baseline.record_rays(r)
    };
    let mut rehearsal = Recorder::rehearse(&gpu);
    record(&mut rehearsal).unwrap();
    rehearsal.finish().unwrap();
    let room = rehearsal.descriptor_room();
    assert_eq!(room.sets > 0, binding == Binding::Descriptors);
    let mut pools = DescriptorPools::new(&gpu);
    pools.reserve(room).unwrap();

    let before = CALLS.get();
    for _ in 0..3 {
        submit(&gpu, "olbvh.test.frame", |r| {
            // SAFETY: these are the commands of `r`, which records nothing meanwhile; the pools are kept until `run`
            // has waited for the commands.
            let mut recorder = unsafe { Recorder::new(&gpu, r.commands(), None) }.with_pools(&mut pools)?;
            ARMED.set(true);
            let result = record(&mut recorder).and_then(|()| recorder.finish());
            ARMED.set(false);
            assert_eq!(recorder.descriptor_room(), room);
            result
        })
        .unwrap();
        // SAFETY: `run` has waited.
        unsafe { pools.reset() }.unwrap();
    }
    assert_eq!(CALLS.get(), before, "calls made while recording");
    let found: Vec<u32> = gpu.download(&frame.memory, frame.output.owners.part(0, 4 * mesh.points.len() as u64)).unwrap();
    assert_eq!(found, owners(&gpu, &mesh));
    // Calls are counted at all.
    ARMED.set(true);
    let buffer = gpu.buffer("olbvh.test.counted", 64 << 20);
    ARMED.set(false);
    assert!(buffer.is_ok() && CALLS.get() > before);
}

#[test]
fn recording_neither_makes_nor_submits_nor_waits_by_address() {
    if Host::new().addresses {
        nothing_is_made(Binding::Address);
    } else {
        not_run("the device has no buffer addresses");
    }
}

#[test]
fn recording_neither_makes_nor_submits_nor_waits_by_descriptors() {
    nothing_is_made(Binding::Descriptors);
}

/// Pools without enough room grow once, and serve from then on.
#[test]
fn pools_grow_as_they_are_used() {
    let gpu = Gpu::new(&GpuOptions { binding: Some(Binding::Descriptors), ..GpuOptions::default() }).unwrap();
    let mesh = kuhn_jittered([3; 3], 0.3, 1).unwrap();
    let frame = Frame::new(&gpu, &mesh);
    let expected = owners(&gpu, &mesh);
    let mut pools = DescriptorPools::new(&gpu);
    pools.reserve(DescriptorRoom { sets: 3, buffers: 20 }).unwrap();
    for _ in 0..3 {
        submit(&gpu, "olbvh.test.frame", |r| {
            // SAFETY: as above.
            let mut recorder = unsafe { Recorder::new(&gpu, r.commands(), None) }.with_pools(&mut pools)?;
            frame.record(&mut recorder)?;
            recorder.finish()
        })
        .unwrap();
        // SAFETY: `run` has waited.
        unsafe { pools.reset() }.unwrap();
        let found: Vec<u32> = gpu.download(&frame.memory, frame.output.owners.part(0, 4 * mesh.points.len() as u64)).unwrap();
        assert_eq!(found, expected);
    }
}
