//! Opening a device: which one is chosen, which are refused, and the pipeline cache on disk.

#![allow(clippy::unwrap_used)]

use olbvh::Error;
use olbvh::gpu::{Gpu, GpuOptions, list_devices};
use std::fs;

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

#[test]
fn a_broken_pipeline_cache_is_ignored_and_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("deeper").join("pipelines.bin");
    let open = || drop(Gpu::new(&GpuOptions { pipeline_cache: Some(file.clone()), ..Default::default() }).unwrap());
    open();
    let good = fs::read(&file).unwrap();
    assert!(good.len() >= 32, "a cache has a header of 32 bytes");
    let broken: [Vec<u8>; 6] =
        [vec![], b"not a cache at all".to_vec(), vec![0xff; 4096], vec![0; good.len() + 7], good[..good.len() / 2].to_vec(), {
            // The header of another device.
            let mut other = good.clone();
            other.iter_mut().skip(8).take(24).for_each(|b| *b ^= 0x5a);
            other
        }];
    for content in broken {
        fs::write(&file, &content).unwrap();
        open();
        let now = fs::read(&file).unwrap();
        assert_ne!(now, content, "still broken");
        assert_eq!(now[..32], good[..32], "the header is this device's");
    }
    let left: Vec<_> = fs::read_dir(file.parent().unwrap()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 1, "temporary files are gone: {left:?}");
}

#[test]
fn a_pipeline_cache_that_cannot_be_written_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a file");
    fs::write(&file, "x").unwrap();
    let below = file.join("pipelines.bin");
    drop(Gpu::new(&GpuOptions { pipeline_cache: Some(below), ..Default::default() }).unwrap());
    assert_eq!(fs::read(&file).unwrap(), b"x");
}
