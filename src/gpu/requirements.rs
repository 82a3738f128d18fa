//! Requirements on a physical device, checked before a logical device is created.

use crate::gpu::WorkgroupLimits;
use crate::named::named;
use ash::vk;
use std::ffi::{CStr, c_char};

/// Vendor id of Intel.
pub(super) const INTEL: u32 = 0x8086;

/// The extensions that are enabled where the device has them. The second must be enabled on a device that does not implement all of Vulkan, such as MoltenVK's.
const WANTED: [&CStr; 2] = [ash::ext::subgroup_size_control::NAME, ash::khr::portability_subset::NAME];

/// Ways in which a device supports ray tracing; only a baseline uses it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayTracing {
    /// Ray queries in any shader (`VK_KHR_ray_query`).
    pub queries: bool,
    /// Ray-tracing pipelines (`VK_KHR_ray_tracing_pipeline`).
    pub pipelines: bool,
}

impl RayTracing {
    /// Whether either is supported.
    pub fn any(self) -> bool {
        self.queries || self.pipelines
    }
}

/// The requirements, checked against a physical device.
#[derive(Clone, Debug)]
pub struct Requirements {
    /// What the device lacks; empty if it meets the requirements.
    pub missing: Vec<String>,
    /// Device extensions to enable: those of use that the device supports.
    pub extensions: Vec<&'static CStr>,
    /// More extensions, for the ray tracing that the library's own measurements compare with.
    pub ray_extensions: Vec<&'static CStr>,
    /// Whether buffers can be passed by address; otherwise descriptors are used.
    pub buffer_addresses: bool,
    /// Whether kernels can compute with 64-bit integers; a driver that runs on a processor then reads cells and
    /// vertices in half as many loads.
    pub shader_int64: bool,
    /// Whether a pipeline can require a subgroup size and full subgroups.
    pub subgroup_size_control: bool,
    /// Ways in which the device supports ray tracing.
    pub ray_tracing: RayTracing,
    /// Smallest, usual and largest subgroup size.
    pub subgroup_sizes: [u32; 3],
    /// Most subgroups of a workgroup if a subgroup size is required.
    pub(crate) workgroup_subgroups: u32,
    /// The queue family that this crate would take for itself, preferably one without graphics, and the number of valid
    /// bits of its timestamps. A host may take any with compute, and a renderer wants one with graphics.
    pub queue_family: Option<(u32, u32)>,
}

/// Kinds of devices, in the order in which they are preferred.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A GPU with memory of its own.
    Discrete,
    /// A GPU in the host's memory.
    Integrated,
    /// A part of a GPU in a virtual machine.
    Virtual,
    /// None of these.
    Other,
    /// A driver that runs on the host's processor, such as Mesa lavapipe.
    Cpu,
}

named!(
    DeviceKind,
    "kind of device",
    [Discrete = "discrete", Integrated = "integrated", Virtual = "virtual", Other = "other", Cpu = "cpu",]
);

/// A Vulkan device as listed by the `devices` command.
#[derive(Clone, Debug)]
pub struct DeviceReport {
    /// Name reported by the driver.
    pub name: String,
    /// Driver name and version.
    pub driver: String,
    /// Highest API version.
    pub api: String,
    /// Versions of API and driver, used to prefer the newer of two drivers for one device.
    pub(crate) version: [u32; 2],
    /// Subgroup size that kernels are compiled for, except those of queries.
    pub subgroup: u32,
    /// Subgroup size that the kernels of queries are compiled for.
    pub query_subgroup: u32,
    /// Limits of a workgroup.
    pub room: WorkgroupLimits,
    /// Vendor id: a PCI id, or one assigned by Khronos.
    pub vendor: u32,
    /// Driver id, `VkDriverId`.
    pub driver_id: i32,
    /// Kind of device.
    pub kind: DeviceKind,
    /// Bytes of the largest device-local heap.
    pub memory: u64,
    /// Bytes of the largest buffer; `u64::MAX` before Vulkan 1.3, where it is not stated.
    pub largest_buffer: u64,
    /// Bytes that one allocation is sure to be given, if there are as many; some drivers give more.
    pub largest_allocation: u64,
    /// The requirements, checked against the device.
    pub requirements: Requirements,
}

/// Text of a fixed-size C string in a properties struct.
pub(crate) fn text(chars: &[c_char]) -> String {
    let bytes: Vec<u8> = chars.iter().map(|&c| c as u8).take_while(|&b| b != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The properties of a device that decide whether it meets the requirements.
struct Offer {
    api: u32,
    driver: vk::DriverId,
    invocations: u32,
    shared_bytes: u32,
    /// Of a subgroup; 0 where the instance is too old to be told.
    lanes: u32,
    /// Subgroup operations supported in compute shaders.
    subgroup: vk::SubgroupFeatureFlags,
    compute_queue: bool,
}

/// The requirements that an offer lacks, in words.
fn missing(offer: &Offer) -> Vec<String> {
    let mut missing = Vec::new();
    let (major, minor) = (vk::api_version_major(offer.api), vk::api_version_minor(offer.api));
    if (major, minor) < (1, 2) {
        missing.push(format!("Vulkan 1.2 (has {major}.{minor})"));
    }
    // Kernels size arrays by specialization constants, which it heeds since the version that brought Vulkan 1.3.
    if offer.driver == vk::DriverId::MOLTENVK && (major, minor) < (1, 3) {
        missing.push("MoltenVK 1.3".into());
    }
    if offer.invocations < 256 {
        missing.push(format!("256 invocations per workgroup (has {})", offer.invocations));
    }
    if offer.shared_bytes < 16384 {
        missing.push(format!("16 KiB of shared memory (has {} bytes)", offer.shared_bytes));
    }
    let operations = [
        (vk::SubgroupFeatureFlags::BASIC, "basic"),
        (vk::SubgroupFeatureFlags::VOTE, "vote"),
        (vk::SubgroupFeatureFlags::ARITHMETIC, "arithmetic"),
        (vk::SubgroupFeatureFlags::BALLOT, "ballot"),
    ];
    if offer.lanes == 0 && (major, minor) >= (1, 1) {
        missing.push("an instance whose ApplicationInfo asks for Vulkan 1.2 or later: others are not told of subgroups".into());
    } else {
        let lacking = operations.into_iter().filter(|&(flag, _)| !offer.subgroup.contains(flag));
        missing.extend(lacking.map(|(_, name)| format!("subgroup {name} operations in compute")));
    }
    if !offer.compute_queue {
        missing.push("a compute queue".into());
    }
    missing
}

/// The queue family to use: preferably one without graphics, so that the desktop does not wait for long work. One
/// without timestamps could not tell what takes how long.
fn compute_family(families: &[vk::QueueFamilyProperties]) -> Option<usize> {
    let has = |f: &vk::QueueFamilyProperties, flags| f.queue_flags.contains(flags);
    let computes = |f: &vk::QueueFamilyProperties| has(f, vk::QueueFlags::COMPUTE);
    let alone = families.iter().position(|f| computes(f) && !has(f, vk::QueueFlags::GRAPHICS) && f.timestamp_valid_bits > 0);
    alone.or_else(|| families.iter().position(computes))
}

/// The subgroup size that kernels are compiled for: the usual one. Intel's usual size is the largest, 32, which leaves
/// each lane 32 or 64 words of registers; where sizes can be required, half that size gives each lane twice as many.
fn subgroup_of(vendor: u32, [least, usual, most]: [u32; 3], control: bool) -> u32 {
    let size = if vendor == INTEL && control { usual.min(16).clamp(least, most) } else { usual };
    size.max(1)
}

/// The subgroup size that the kernels of queries are compiled for, where the others have size `usual`: the smallest that
/// can be required, but not below 8. Queries go different ways in neighbouring lanes, which then wait for each other,
/// and they hold a tetrahedron and more per lane: with 16 lanes on Intel's GPUs before Xe2, a lane has 64 registers, and
/// location spills registers 317 times as compiled by Mesa; with 8 lanes, twice.
fn query_subgroup_of(usual: u32, least: u32, control: bool) -> u32 {
    if control { least.max(8).min(usual) } else { usual }
}

/// A device whose extensions cannot be listed counts as one without any.
fn no_extensions(error: vk::Result) -> Vec<vk::ExtensionProperties> {
    log::warn!("vkEnumerateDeviceExtensionProperties failed: {error:?}; no extension is used");
    Vec::new()
}

impl Requirements {
    /// Whether the driver may choose the size of subgroups.
    pub(super) fn sizes_vary(&self) -> bool {
        self.subgroup_sizes[0] != self.subgroup_sizes[2]
    }

    /// Checks a physical device. Required are Vulkan 1.2, a compute queue, basic, vote, arithmetic and ballot subgroup
    /// operations in compute shaders, 256 invocations per workgroup, and 16 KiB of shared memory. Buffer addresses are
    /// preferred, subgroup size control is wanted where sizes vary, and ray tracing is optional.
    ///
    /// # Safety
    /// `device` is a physical device of `instance`, which has not been destroyed.
    pub unsafe fn check(instance: &ash::Instance, device: vk::PhysicalDevice) -> Self {
        let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
        let mut control = vk::PhysicalDeviceSubgroupSizeControlProperties::default();
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        // SAFETY: the caller promises that the handle is one of this instance; the structs live until the calls return.
        let (properties, listed, families) = unsafe {
            let mut properties =
                vk::PhysicalDeviceProperties2::default().push_next(&mut subgroup).push_next(&mut control).push_next(&mut driver);
            instance.get_physical_device_properties2(device, &mut properties);
            (
                properties.properties,
                instance.enumerate_device_extension_properties(device).unwrap_or_else(no_extensions),
                instance.get_physical_device_queue_family_properties(device),
            )
        };
        let queue_family = compute_family(&families).map(|i| (i as u32, families[i].timestamp_valid_bits));
        let in_compute = subgroup.supported_stages.contains(vk::ShaderStageFlags::COMPUTE);
        let missing = missing(&Offer {
            api: properties.api_version,
            driver: driver.driver_id,
            invocations: properties.limits.max_compute_work_group_invocations,
            shared_bytes: properties.limits.max_compute_shared_memory_size,
            lanes: subgroup.subgroup_size,
            subgroup: if in_compute { subgroup.supported_operations } else { vk::SubgroupFeatureFlags::empty() },
            compute_queue: queue_family.is_some(),
        });
        let has = |name: &CStr| listed.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        let mut addresses = vk::PhysicalDeviceBufferDeviceAddressFeatures::default();
        let mut size_control = vk::PhysicalDeviceSubgroupSizeControlFeatures::default();
        // Part of Vulkan 1.3, so a driver of that version need not list the extension.
        let can_control = properties.api_version >= vk::API_VERSION_1_3 || has(ash::ext::subgroup_size_control::NAME);
        // SAFETY: the caller promises that the handle is one of this instance; the structs live until the call returns,
        // and the one of size control is chained only if the device knows it.
        let core = unsafe {
            let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut addresses);
            if can_control {
                features = features.push_next(&mut size_control);
            }
            instance.get_physical_device_features2(device, &mut features);
            features.features
        };
        let for_structures = [ash::khr::acceleration_structure::NAME, ash::khr::deferred_host_operations::NAME];
        let can_trace = addresses.buffer_device_address != 0 && for_structures.iter().all(|e| has(e));
        let listed_ways = RayTracing {
            queries: can_trace && has(ash::khr::ray_query::NAME),
            pipelines: can_trace && has(ash::khr::ray_tracing_pipeline::NAME),
        };
        // SAFETY: the caller promises that the handle is one of this instance.
        let ray_tracing = unsafe { traces_rays(instance, device, listed_ways) };
        // Metal chooses subgroup sizes itself: MoltenVK reports the features, but no stage accepts a required size.
        let can_require = control.required_subgroup_size_stages.contains(vk::ShaderStageFlags::COMPUTE);
        let subgroup_size_control =
            can_control && can_require && size_control.subgroup_size_control != 0 && size_control.compute_full_subgroups != 0;
        let sizes = if can_control {
            [control.min_subgroup_size, subgroup.subgroup_size, control.max_subgroup_size]
        } else {
            [subgroup.subgroup_size; 3]
        };
        let mut ray_extensions = if ray_tracing.any() { for_structures.to_vec() } else { Vec::new() };
        ray_extensions.extend(ray_tracing.queries.then_some(ash::khr::ray_query::NAME));
        ray_extensions.extend(ray_tracing.pipelines.then_some(ash::khr::ray_tracing_pipeline::NAME));
        Self {
            missing,
            extensions: WANTED.into_iter().filter(|e| has(e)).collect(),
            ray_extensions,
            buffer_addresses: addresses.buffer_device_address != 0,
            shader_int64: core.shader_int64 != 0,
            subgroup_size_control,
            ray_tracing,
            subgroup_sizes: sizes,
            workgroup_subgroups: if subgroup_size_control && sizes[0] != sizes[2] {
                control.max_compute_workgroup_subgroups
            } else {
                u32::MAX
            },
            queue_family,
        }
    }
}

/// The listed ways of ray tracing whose features are supported as well.
///
/// # Safety
/// As for [`Requirements::check`].
unsafe fn traces_rays(instance: &ash::Instance, device: vk::PhysicalDevice, listed: RayTracing) -> RayTracing {
    let mut structures = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
    let mut queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
    let mut pipelines = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default();
    let mut features = vk::PhysicalDeviceFeatures2::default();
    if listed.any() {
        features = features.push_next(&mut structures);
    }
    if listed.queries {
        features = features.push_next(&mut queries);
    }
    if listed.pipelines {
        features = features.push_next(&mut pipelines);
    }
    // SAFETY: the caller promises that the handle is one of this instance; the structs live until the call returns, and
    // are chained only where the extension exists.
    unsafe { instance.get_physical_device_features2(device, &mut features) };
    let structures = structures.acceleration_structure != 0;
    RayTracing { queries: structures && queries.ray_query != 0, pipelines: structures && pipelines.ray_tracing_pipeline != 0 }
}

impl DeviceReport {
    /// Reads a device's properties. Its requirements are as checked, or reduced to what is enabled.
    ///
    /// # Safety
    /// As for [`Requirements::check`].
    pub(super) unsafe fn of(instance: &ash::Instance, device: vk::PhysicalDevice, requirements: Requirements) -> Self {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut allocations = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut buffers = vk::PhysicalDeviceMaintenance4Properties::default().max_buffer_size(u64::MAX);
        // SAFETY: the caller promises that the handle is one of this instance; the structs live until the calls return,
        // and the one of buffers is chained only if the device knows it.
        let (properties, memory) = unsafe {
            let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut allocations);
            instance.get_physical_device_properties2(device, &mut properties);
            let properties = properties.properties;
            if properties.api_version >= vk::API_VERSION_1_3 {
                instance.get_physical_device_properties2(device, &mut vk::PhysicalDeviceProperties2::default().push_next(&mut buffers));
            }
            (properties, instance.get_physical_device_memory_properties(device))
        };
        let (version, limits) = (properties.api_version, properties.limits);
        let subgroup = subgroup_of(properties.vendor_id, requirements.subgroup_sizes, requirements.subgroup_size_control);
        // The kernels' shared arrays hold the sums of at most 128 subgroups.
        let subgroups = requirements.workgroup_subgroups.min(128);
        let query_subgroup = query_subgroup_of(subgroup, requirements.subgroup_sizes[0], requirements.subgroup_size_control);
        let of_subgroups = query_subgroup.saturating_mul(subgroups);
        let invocations = limits.max_compute_work_group_invocations.min(limits.max_compute_work_group_size[0]).min(of_subgroups);
        let heaps = &memory.memory_heaps[..memory.memory_heap_count as usize];
        Self {
            name: text(&properties.device_name),
            driver: format!("{} {}", text(&driver.driver_name), text(&driver.driver_info)).trim().to_string(),
            api: format!("{}.{}.{}", vk::api_version_major(version), vk::api_version_minor(version), vk::api_version_patch(version)),
            version: [version, properties.driver_version],
            subgroup,
            query_subgroup,
            room: WorkgroupLimits {
                subgroup,
                invocations: invocations / subgroup * subgroup,
                shared_bytes: limits.max_compute_shared_memory_size,
            },
            vendor: properties.vendor_id,
            driver_id: driver.driver_id.as_raw(),
            kind: match properties.device_type {
                vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
                vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
                vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
                vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
                _ => DeviceKind::Other,
            },
            memory: heaps.iter().filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL)).map(|h| h.size).max().unwrap_or(0),
            largest_buffer: buffers.max_buffer_size,
            largest_allocation: allocations.max_memory_allocation_size,
            requirements,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_are_compiled_for_sizes_that_there_are() {
        assert_eq!(subgroup_of(INTEL, [8, 32, 32], true), 16);
        assert_eq!(subgroup_of(INTEL, [16, 32, 32], true), 16);
        assert_eq!(subgroup_of(INTEL, [32, 32, 32], true), 32);
        assert_eq!(subgroup_of(INTEL, [8, 32, 32], false), 32, "the driver chooses");
        assert_eq!(subgroup_of(0x1002, [32, 64, 64], true), 64);
        assert_eq!(subgroup_of(0, [0, 0, 0], false), 1);
    }

    #[test]
    fn queries_run_in_narrow_subgroups() {
        assert_eq!(query_subgroup_of(16, 8, true), 8, "Intel before Xe2");
        assert_eq!(query_subgroup_of(16, 16, true), 16, "Xe2");
        assert_eq!(query_subgroup_of(64, 32, true), 32, "RDNA");
        assert_eq!(query_subgroup_of(64, 64, true), 64, "GCN");
        assert_eq!(query_subgroup_of(32, 1, true), 8);
        assert_eq!(query_subgroup_of(4, 4, true), 4);
        assert_eq!(query_subgroup_of(64, 32, false), 64, "the driver chooses");
    }

    #[test]
    fn a_family_without_graphics_is_preferred() {
        let (graphics, compute, transfer) = (vk::QueueFlags::GRAPHICS, vk::QueueFlags::COMPUTE, vk::QueueFlags::TRANSFER);
        let family = |(flags, bits)| vk::QueueFamilyProperties { queue_flags: flags, timestamp_valid_bits: bits, ..Default::default() };
        let chosen = |families: &[(vk::QueueFlags, u32)]| compute_family(&families.iter().copied().map(family).collect::<Vec<_>>());
        assert_eq!(chosen(&[(graphics | compute, 64), (transfer, 64), (compute | transfer, 64)]), Some(2));
        assert_eq!(chosen(&[(graphics | compute, 64), (compute, 0)]), Some(0), "the other one has no timestamps");
        assert_eq!(chosen(&[(graphics, 64), (compute, 0)]), Some(1));
        assert_eq!(chosen(&[(graphics, 64), (transfer, 64)]), None);
    }

    #[test]
    fn what_is_missing_is_named() {
        let least = || Offer {
            api: vk::API_VERSION_1_2,
            driver: vk::DriverId::default(),
            invocations: 256,
            shared_bytes: 16384,
            lanes: 32,
            subgroup: vk::SubgroupFeatureFlags::BASIC
                | vk::SubgroupFeatureFlags::VOTE
                | vk::SubgroupFeatureFlags::ARITHMETIC
                | vk::SubgroupFeatureFlags::BALLOT,
            compute_queue: true,
        };
        assert!(missing(&least()).is_empty());
        assert_eq!(missing(&Offer { api: vk::API_VERSION_1_1, ..least() }), ["Vulkan 1.2 (has 1.1)"]);
        assert_eq!(missing(&Offer { invocations: 128, ..least() }), ["256 invocations per workgroup (has 128)"]);
        assert_eq!(missing(&Offer { shared_bytes: 8192, ..least() }), ["16 KiB of shared memory (has 8192 bytes)"]);
        let no_ballot = least().subgroup & !vk::SubgroupFeatureFlags::BALLOT;
        assert_eq!(missing(&Offer { subgroup: no_ballot, ..least() }), ["subgroup ballot operations in compute"]);
        assert_eq!(missing(&Offer { driver: vk::DriverId::MOLTENVK, ..least() }), ["MoltenVK 1.3"]);
        assert!(missing(&Offer { driver: vk::DriverId::MOLTENVK, api: vk::API_VERSION_1_3, ..least() }).is_empty());
        let subgroup = vk::SubgroupFeatureFlags::empty();
        let untold = missing(&Offer { lanes: 0, subgroup, ..least() });
        assert!(untold.len() == 1 && untold[0].contains("ApplicationInfo"), "{untold:?}");
        let nothing = Offer { api: 0, invocations: 0, shared_bytes: 0, subgroup, compute_queue: false, ..least() };
        assert_eq!(missing(&nothing).len(), 8);
    }
}
