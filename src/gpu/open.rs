//! Choosing, checking and opening a device owned by this crate.

use super::context::{Gpu, GpuOptions};
use super::debug::DebugUtils;
use super::failed;
use super::foundation::{Foundation, Ours};
use super::queue::HostQueue;
use super::requirements::{DeviceReport, Requirements};
use crate::error::{Error, Result};
use ash::vk;
use std::ffi::CStr;
use std::sync::{Arc, Mutex};

/// Reason and remedy if the loader finds no driver.
const NO_DRIVER: &str = "the loader finds no driver; install one (mesa-vulkan-drivers runs on any processor)";

struct Session {
    entry: ash::Entry,
    instance: ash::Instance,
    debug: bool,
}

/// Loads the Vulkan loader and creates an instance.
fn open_instance() -> Result<Session> {
    // SAFETY: loading the Vulkan library runs its initialisation code, which every Vulkan program has to trust.
    let entry = unsafe { ash::Entry::load() }
        .map_err(|e| Error::NoVulkan(format!("its loader is missing ({e}); install libvulkan1 and a driver")))?;
    // SAFETY: plain enumeration.
    let extensions =
        unsafe { entry.enumerate_instance_extension_properties(None) }.map_err(failed("vkEnumerateInstanceExtensionProperties"))?;
    let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
    let mut wanted = Vec::new();
    let debug = has(ash::ext::debug_utils::NAME);
    if debug {
        wanted.push(ash::ext::debug_utils::NAME.as_ptr());
    }
    let mut flags = vk::InstanceCreateFlags::empty();
    if has(ash::khr::portability_enumeration::NAME) {
        // MoltenVK is only listed on request.
        wanted.push(ash::khr::portability_enumeration::NAME.as_ptr());
        flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
    }
    // Vulkan 1.3 is requested for the features that are used if present; a 1.2 device is enough.
    let application = vk::ApplicationInfo::default().application_name(c"olbvh").engine_name(c"olbvh").api_version(vk::API_VERSION_1_3);
    let info = vk::InstanceCreateInfo::default().application_info(&application).enabled_extension_names(&wanted).flags(flags);
    // SAFETY: all structs outlive the call.
    let instance = unsafe { entry.create_instance(&info, None) }.map_err(|e| match e {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => Error::NoVulkan(NO_DRIVER.into()),
        e => Error::NoVulkan(format!("vkCreateInstance failed ({e:?}); look at the drivers installed")),
    })?;
    Ok(Session { entry, instance, debug })
}

/// All Vulkan devices of this machine, each with what it lacks, if anything.
///
/// # Errors
/// [`Error::NoVulkan`] if there is no loader or driver.
pub fn list_devices() -> Result<Vec<DeviceReport>> {
    let session = open_instance()?;
    let reports = devices(&session.instance).map(|all| all.into_iter().map(|(_, report)| report).collect());
    // SAFETY: nothing made from the instance is left.
    unsafe { session.instance.destroy_instance(None) };
    reports
}

/// The physical devices of an instance, with their properties.
fn devices(instance: &ash::Instance) -> Result<Vec<(vk::PhysicalDevice, DeviceReport)>> {
    // SAFETY: the instance is alive.
    let devices = unsafe { instance.enumerate_physical_devices() }.map_err(failed("vkEnumeratePhysicalDevices"))?;
    // SAFETY: the handles are those of the instance.
    let report = |d| unsafe { DeviceReport::of(instance, d, Requirements::check(instance, d)) };
    Ok(devices.into_iter().map(|d| (d, report(d))).collect())
}

/// The requested device, or the best one that meets the requirements.
fn choose(instance: &ash::Instance, wanted: Option<&str>) -> Result<(vk::PhysicalDevice, DeviceReport)> {
    let all = devices(instance)?;
    let names = || all.iter().enumerate().map(|(i, (_, r))| format!("{i} {}", r.name)).collect::<Vec<_>>().join(", ");
    if all.is_empty() {
        return Err(Error::NoDevice(NO_DRIVER.into()));
    }
    if let Some(wanted) = wanted {
        let lower = wanted.to_lowercase();
        let named = |(_, r): &&(_, DeviceReport)| !lower.trim().is_empty() && r.name.to_lowercase().contains(&lower);
        // A number that is none of a device is no part of a name either: 4 is not a GeForce RTX 4090.
        let found = wanted.parse().map_or_else(|_| all.iter().find(named), |i: usize| all.get(i));
        let Some((device, report)) = found else {
            return Err(Error::NoDevice(format!("no device `{wanted}`; there are: {}", names())));
        };
        if !report.requirements.missing.is_empty() {
            return Err(Error::NoDevice(format!("{} lacks {}", report.name, report.requirements.missing.join(", "))));
        }
        return Ok((*device, report.clone()));
    }
    let best = all.iter().filter(|(_, r)| r.requirements.missing.is_empty()).min_by_key(|(_, r)| (r.kind, std::cmp::Reverse(r.version)));
    best.cloned().ok_or_else(|| {
        let lacking = all.iter().map(|(_, r)| format!("{} lacks {}", r.name, r.requirements.missing.join(", ")));
        Error::NoDevice(lacking.collect::<Vec<_>>().join("; "))
    })
}

impl Gpu {
    /// Opens a device and runs the self-test on it.
    ///
    /// # Errors
    /// [`Error::NoVulkan`], [`Error::NoDevice`] with what is missing, [`Error::SelfTest`], [`Error::Memory`],
    /// [`Error::Vulkan`] if a call fails, [`Error::Invalid`] for a target that does not fit the device.
    pub fn new(options: &GpuOptions) -> Result<Self> {
        let Session { entry, instance, debug } = open_instance()?;
        let made = choose(&instance, options.device.as_deref())
            .and_then(|(physical, report)| Ok((physical, make_device(&instance, physical, &report.requirements)?, report)));
        let (physical, device, report) = match made {
            Ok(made) => made,
            Err(e) => {
                // SAFETY: nothing made from the instance is left.
                unsafe { instance.destroy_instance(None) };
                return Err(e);
            }
        };
        let (family, _) = report.requirements.queue_family.unwrap_or_default();
        // SAFETY: the device was made with a queue of the family.
        let queue: Arc<dyn HostQueue> = Arc::new(Mutex::new(unsafe { device.get_device_queue(family, 0) }));
        let ours = Some(Ours { debug: if debug { DebugUtils::new(&entry, &instance) } else { None }, _entry: entry });
        let (allocator, pipeline_cache) = (None, None);
        Self::on(
            Foundation {
                instance,
                physical,
                device,
                report,
                family,
                queue: Some(queue),
                allocator,
                pipeline_cache,
                debug_utils: debug,
                ours,
            },
            options,
        )
    }
}

/// Creates a device with all preferred features and extensions that it supports.
fn make_device(instance: &ash::Instance, physical: vk::PhysicalDevice, requirements: &Requirements) -> Result<ash::Device> {
    let (family, _) = requirements.queue_family.unwrap_or_default();
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
    let extensions: Vec<_> = requirements.extensions.iter().chain(&requirements.ray_extensions).map(|e| e.as_ptr()).collect();
    let mut addresses = vk::PhysicalDeviceBufferDeviceAddressFeatures::default().buffer_device_address(true);
    let mut control = vk::PhysicalDeviceSubgroupSizeControlFeatures::default().subgroup_size_control(true).compute_full_subgroups(true);
    let core = vk::PhysicalDeviceFeatures::default().shader_int64(requirements.shader_int64);
    let mut info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&extensions).enabled_features(&core);
    if requirements.buffer_addresses {
        info = info.push_next(&mut addresses);
    }
    if requirements.subgroup_size_control {
        info = info.push_next(&mut control);
    }
    let mut structures = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
    let mut ray_queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
    let mut ray_pipelines = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default().ray_tracing_pipeline(true);
    if requirements.ray_tracing.any() {
        info = info.push_next(&mut structures);
    }
    if requirements.ray_tracing.queries {
        info = info.push_next(&mut ray_queries);
    }
    if requirements.ray_tracing.pipelines {
        info = info.push_next(&mut ray_pipelines);
    }
    // SAFETY: only features and extensions that the device reported are enabled; all structs outlive the call.
    unsafe { instance.create_device(physical, &info, None) }.map_err(failed("vkCreateDevice"))
}
