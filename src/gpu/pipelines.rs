//! The pipelines of a device, and the driver's cache of what it compiled for them.

use super::failed;
use super::foundation::Foundation;
use crate::error::Result;
use ash::vk;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::PathBuf;
use std::sync::{PoisonError, RwLock};

/// A pipeline with its layouts.
#[derive(Clone, Copy, Default)]
pub(crate) struct Pipeline {
    pub handle: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
}

impl Pipeline {
    /// Destroys what there is of it.
    ///
    /// # Safety
    /// It is of this device, and nothing uses it any more.
    pub(super) unsafe fn destroy(self, device: &ash::Device) {
        // SAFETY: as the caller vouches; null handles are passed over.
        unsafe {
            device.destroy_pipeline(self.handle, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// A kernel by name, and its specialization constants.
pub(super) type PipelineKey = (&'static str, Vec<(u32, u32)>);

/// What has been compiled.
pub(super) struct Pipelines {
    made: RwLock<HashMap<PipelineKey, Pipeline>>,
    /// The host's, or one of our own.
    pub cache: vk::PipelineCache,
    /// Where one of our own is kept.
    file: Option<PathBuf>,
}

impl Pipelines {
    /// None yet; `file`: of the pipeline cache, if the host lends none.
    pub fn new(foundation: &Foundation, file: Option<PathBuf>) -> Result<Self> {
        let cache = if let Some(cache) = foundation.pipeline_cache {
            cache
        } else {
            let stored = file.as_ref().and_then(|f| std::fs::read(f).ok()).unwrap_or_default();
            let info = vk::PipelineCacheCreateInfo::default().initial_data(&stored);
            // SAFETY: drivers check the header of the data and ignore what is not theirs.
            unsafe { foundation.device.create_pipeline_cache(&info, None) }.map_err(failed("vkCreatePipelineCache"))?
        };
        Ok(Self { made: RwLock::default(), cache, file })
    }

    /// That of a key, if it has been made.
    pub fn find(&self, key: &PipelineKey) -> Option<Pipeline> {
        self.made.read().unwrap_or_else(PoisonError::into_inner).get(key).copied()
    }

    /// Keeps a new one of this device that nobody else has got; the one to use.
    pub fn keep(&self, device: &ash::Device, key: PipelineKey, made: Pipeline) -> Pipeline {
        match self.made.write().unwrap_or_else(PoisonError::into_inner).entry(key) {
            Entry::Vacant(place) => *place.insert(made),
            Entry::Occupied(first) => {
                // SAFETY: another thread was first, and nobody has got this one.
                unsafe { made.destroy(device) };
                *first.get()
            }
        }
    }

    /// Writes the pipeline cache beside its file and renames it, so that readers never see half of it.
    pub fn save(&self, device: &ash::Device) -> Option<()> {
        let file = self.file.as_ref()?;
        // SAFETY: the cache belongs to this device, which is alive.
        let data = unsafe { device.get_pipeline_cache_data(self.cache) }.ok()?;
        if std::fs::read(file).is_ok_and(|stored| stored == data) {
            return None;
        }
        std::fs::create_dir_all(file.parent()?).ok()?;
        let temporary = file.with_extension(format!("{}.tmp", std::process::id()));
        std::fs::write(&temporary, data).ok()?;
        std::fs::rename(&temporary, file).ok()
    }

    /// Destroys the pipelines, and the cache if it is one of our own.
    ///
    /// # Safety
    /// Nothing uses them any more.
    pub unsafe fn destroy(&mut self, foundation: &Foundation) {
        let Foundation { device, pipeline_cache, .. } = foundation;
        // SAFETY: as the caller vouches.
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
