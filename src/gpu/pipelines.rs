//! The pipelines of a device, and the Vulkan pipeline cache they are compiled with.

use super::failed;
use super::foundation::Foundation;
use crate::error::{Error, Result};
use ash::vk;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{PoisonError, RwLock};

/// A pipeline with its layouts.
#[derive(Clone, Copy, Default)]
pub(crate) struct Pipeline {
    pub handle: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
}

impl Pipeline {
    /// Destroys the handles that exist.
    ///
    /// # Safety
    /// The handles belong to this device, and nothing uses them any more.
    pub(super) unsafe fn destroy(self, device: &ash::Device) {
        // SAFETY: the caller guarantees that the handles belong to this device and are unused; null handles are
        // ignored.
        unsafe {
            device.destroy_pipeline(self.handle, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// The name of a kernel, and its specialization constants.
pub(super) type PipelineKey = (&'static str, Vec<(u32, u32)>);

/// Number of files that this process has written, so that each has a temporary file of its own.
static WRITTEN: AtomicU32 = AtomicU32::new(0);

/// A hash of these bytes (FNV-1a, 64 bits).
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &b| (hash ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3))
}

/// Length and checksum of the data of a pipeline cache, which its file begins with. Drivers are given only what they
/// have written: few check more than the device that data is for.
fn seal(data: &[u8]) -> [u8; 16] {
    let mut seal = [0; 16];
    seal[..8].copy_from_slice(&(data.len() as u64).to_le_bytes());
    seal[8..].copy_from_slice(&checksum(data).to_le_bytes());
    seal
}

/// The data in a file of a pipeline cache; none if the file is not as it was written.
fn unsealed(file: &[u8]) -> &[u8] {
    file.split_at_checked(16).filter(|(head, data)| *head == seal(data)).map_or(&[], |(_, data)| data)
}

/// The file of a device and its driver in the folder of pipeline caches.
pub(super) fn cache_file(folder: &Path, uuid: [u8; vk::UUID_SIZE]) -> PathBuf {
    let uuid = format!("{:032x}", u128::from_be_bytes(uuid));
    folder.join(format!("pipelines-{}-{uuid}.bin", env!("CARGO_PKG_VERSION")))
}

/// The pipelines compiled so far.
pub(super) struct Pipelines {
    made: RwLock<HashMap<PipelineKey, Pipeline>>,
    /// The host's pipeline cache, or one owned by this crate.
    pub cache: vk::PipelineCache,
    /// The file that a cache owned by this crate is stored in.
    file: Option<PathBuf>,
}

impl Pipelines {
    /// Starts without pipelines. `file` is the file of the pipeline cache, used if the host provides no cache.
    pub fn new(foundation: &Foundation, file: Option<PathBuf>) -> Result<Self> {
        let cache = if let Some(cache) = foundation.pipeline_cache {
            cache
        } else {
            let stored = file.as_ref().and_then(|f| std::fs::read(f).ok()).unwrap_or_default();
            let info = vk::PipelineCacheCreateInfo::default().initial_data(unsealed(&stored));
            // SAFETY: the data, if any, was read from a pipeline cache; drivers ignore data of another device.
            unsafe { foundation.device.create_pipeline_cache(&info, None) }.map_err(failed("vkCreatePipelineCache"))?
        };
        Ok(Self { made: RwLock::default(), cache, file })
    }

    /// The pipeline of a key, if it has been made.
    pub fn find(&self, key: &PipelineKey) -> Option<Pipeline> {
        self.made.read().unwrap_or_else(PoisonError::into_inner).get(key).copied()
    }

    /// Stores a new pipeline of this device that has not been handed out, and returns the one to use.
    pub fn keep(&self, device: &ash::Device, key: PipelineKey, made: Pipeline) -> Pipeline {
        match self.made.write().unwrap_or_else(PoisonError::into_inner).entry(key) {
            Entry::Vacant(place) => *place.insert(made),
            Entry::Occupied(first) => {
                // SAFETY: another thread stored its pipeline first, and this one has not been handed out.
                unsafe { made.destroy(device) };
                *first.get()
            }
        }
    }

    /// Writes the pipeline cache to its file, if it has one and differs from what is there: to a temporary file, which is
    /// renamed, so that readers never see a partial one.
    pub fn save(&self, device: &ash::Device) -> Result<()> {
        let Some(path) = &self.file else { return Ok(()) };
        // SAFETY: the cache belongs to this device, which is alive.
        let data = unsafe { device.get_pipeline_cache_data(self.cache) }.map_err(failed("vkGetPipelineCacheData"))?;
        let content = [&seal(&data)[..], &data].concat();
        if std::fs::read(path).is_ok_and(|stored| stored == content) {
            return Ok(());
        }
        let (process, number) = (std::process::id(), WRITTEN.fetch_add(1, Ordering::Relaxed));
        let temporary = path.with_extension(format!("{process}.{number}.tmp"));
        let write = || {
            path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
            std::fs::write(&temporary, content)?;
            std::fs::rename(&temporary, path)
        };
        write().map_err(|source| {
            let _ = std::fs::remove_file(&temporary);
            Error::Io { path: path.clone(), source }
        })
    }

    /// Destroys the pipelines, and the cache if this crate owns it.
    ///
    /// # Safety
    /// Nothing uses them any more.
    pub unsafe fn destroy(&mut self, foundation: &Foundation) {
        let Foundation { device, pipeline_cache, .. } = foundation;
        // SAFETY: the caller guarantees that nothing uses them any more.
        unsafe {
            for p in self.made.get_mut().map(std::mem::take).unwrap_or_default().into_values() {
                p.destroy(device);
            }
            if pipeline_cache.is_none() {
                device.destroy_pipeline_cache(self.cache, None);
            }
        }
    }
}
