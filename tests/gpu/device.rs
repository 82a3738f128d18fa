//! Opening a device: which one is chosen, which are refused, and the pipeline cache on disk.

#![allow(unsafe_code, reason = "plain Vulkan, beside the crate")]

use crate::host::Host;
use ash::vk;
use olbvh::Error;
use olbvh::gpu::{Gpu, GpuOptions, HostDevice, list_devices};
use std::cell::Cell;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

#[test]
fn a_listed_device_opens_by_index_and_by_name() {
    let devices = list_devices().unwrap();
    let usable = devices.iter().position(|d| d.requirements.missing.is_empty()).expect("a device that qualifies");
    let name = devices[usable].name.clone();
    for device in [usable.to_string(), name.to_uppercase(), name[..5].to_string()] {
        let gpu = Gpu::new(&GpuOptions { device: Some(device.clone()), trust: true, ..Default::default() });
        assert_eq!(gpu.unwrap_or_else(|e| panic!("{device}: {e}")).report().name, name);
    }
}

#[test]
fn a_device_that_is_not_there_is_told_with_those_that_are() {
    let error = Gpu::new(&GpuOptions { device: Some("no such device".into()), ..Default::default() }).unwrap_err();
    let names = list_devices().unwrap();
    assert!(matches!(&error, Error::NoDevice(text) if text.contains("no such device") && text.contains(&names[0].name)), "{error}");
}

fn files(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
}

static CREATE_CACHE: OnceLock<vk::PFN_vkCreatePipelineCache> = OnceLock::new();
thread_local! {
    /// Bytes that this thread's last pipeline cache was created from.
    static GIVEN: Cell<usize> = const { Cell::new(usize::MAX) };
}

unsafe extern "system" fn create_cache(
    device: vk::Device,
    info: *const vk::PipelineCacheCreateInfo<'_>,
    callbacks: *const vk::AllocationCallbacks<'_>,
    out: *mut vk::PipelineCache,
) -> vk::Result {
    // SAFETY: the caller's valid arguments are passed on.
    unsafe {
        GIVEN.set((*info).initial_data_size);
        CREATE_CACHE.get().unwrap()(device, info, callbacks, out)
    }
}

/// The driver is given what it has written, and nothing else.
#[test]
fn a_broken_pipeline_cache_is_ignored_and_replaced() {
    let host = Host::new();
    let mut zero = host.device.fp_v1_0().clone();
    CREATE_CACHE.get_or_init(|| zero.create_pipeline_cache);
    zero.create_pipeline_cache = create_cache;
    let (one, two, three) = (host.device.fp_v1_1().clone(), host.device.fp_v1_2().clone(), host.device.fp_v1_3().clone());
    let device = ash::Device::from_parts_1_3(host.device.handle(), zero, one, two, three);
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path().join("deeper");
    let options = GpuOptions { pipeline_cache: Some(folder.clone()), ..Default::default() };
    let open = || {
        // SAFETY: the host's handles belong together and outlive the `Gpu`; the function above calls the device's own.
        drop(unsafe { Gpu::from_raw(HostDevice { device: device.clone(), ..host.lend() }, &options) }.unwrap());
        GIVEN.replace(usize::MAX)
    };
    assert_eq!(open(), 0);
    let found = files(&folder);
    assert_eq!(found.len(), 1, "{found:?}");
    let file = &found[0];
    let good = fs::read(file).unwrap();
    let data = good.len() - 16;
    assert!(data >= 32, "a cache has a header of 32 bytes");
    assert_eq!(open(), data);
    let changed = |at: usize| {
        let mut other = good.clone();
        other[at] ^= 0x5a;
        other
    };
    let broken = [
        vec![],
        b"not a cache at all".to_vec(),
        vec![0xff; 4096],
        vec![0; good.len()],
        good[..good.len() / 2].to_vec(),
        [&good[..], &[0]].concat(),
        good[16..].to_vec(),
        changed(0),
        changed(8),
        changed(40),
        changed(good.len() - 1),
    ];
    for content in broken {
        fs::write(file, &content).unwrap();
        assert_eq!(open(), 0, "{} bytes reach the driver", content.len());
        assert_ne!(fs::read(file).unwrap(), content, "still broken");
    }
    assert_ne!(open(), 0, "the last one was replaced");
    assert_eq!(files(&folder).len(), 1, "temporary files are gone");
}

static PROPERTIES: OnceLock<vk::PFN_vkGetPhysicalDeviceProperties> = OnceLock::new();

/// The driver's properties, with another identity of its pipeline caches.
unsafe extern "system" fn other_caches(physical: vk::PhysicalDevice, properties: *mut vk::PhysicalDeviceProperties) {
    // SAFETY: the caller's valid arguments are passed on.
    unsafe {
        PROPERTIES.get().unwrap()(physical, properties);
        (*properties).pipeline_cache_uuid[0] ^= 1;
    }
}

#[test]
fn devices_keep_their_pipelines_in_files_of_their_own() {
    let host = Host::new();
    let mut zero = host.instance.fp_v1_0().clone();
    PROPERTIES.get_or_init(|| zero.get_physical_device_properties);
    zero.get_physical_device_properties = other_caches;
    let (one, three) = (host.instance.fp_v1_1().clone(), host.instance.fp_v1_3().clone());
    let other = ash::Instance::from_parts_1_3(host.instance.handle(), zero, one, three);
    let folder = tempfile::tempdir().unwrap();
    let options = GpuOptions { pipeline_cache: Some(folder.path().into()), trust: true, ..Default::default() };
    for (instance, count) in [(&host.instance, 1), (&other, 2), (&host.instance, 2)] {
        // SAFETY: the host's handles belong together and outlive the `Gpu`.
        drop(unsafe { Gpu::from_raw(HostDevice { instance: instance.clone(), ..host.lend() }, &options) }.unwrap());
        assert_eq!(files(folder.path()).len(), count);
    }
}

#[test]
fn a_pipeline_cache_that_cannot_be_written_is_an_error_only_if_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a file");
    fs::write(&file, "x").unwrap();
    let gpu = Gpu::new(&GpuOptions { pipeline_cache: Some(file.join("below")), ..Default::default() }).unwrap();
    let error = gpu.save_pipelines().unwrap_err();
    assert!(matches!(&error, Error::Io { path, .. } if path.starts_with(&file)), "{error}");
    drop(gpu);
    assert_eq!(fs::read(&file).unwrap(), b"x");
}

#[test]
fn a_pipeline_cache_is_written_while_the_device_is_in_use() {
    let folder = tempfile::tempdir().unwrap();
    let gpu = Gpu::new(&GpuOptions { pipeline_cache: Some(folder.path().into()), ..Default::default() }).unwrap();
    assert_eq!(files(folder.path()).len(), 0);
    gpu.save_pipelines().unwrap();
    let file = &files(folder.path())[0];
    let saved = fs::read(file).unwrap();
    drop(gpu);
    assert_eq!(fs::read(file).unwrap(), saved, "nothing was compiled since");
}
