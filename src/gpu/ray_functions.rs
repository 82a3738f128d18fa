//! Functions and limits of the ray-tracing extensions.

use ash::vk;

/// Functions and limits of `VK_KHR_acceleration_structure`.
pub(super) struct Acceleration {
    pub functions: ash::khr::acceleration_structure::Device,
    pub scratch_alignment: u64,
    pub most_triangles: u64,
    /// Functions and limits of ray-tracing pipelines, if those are enabled too.
    pub pipelines: Option<RayFunctions>,
}

impl Acceleration {
    /// Loads the functions of a device with the extension enabled; `pipelines`: ray-tracing pipelines are enabled too.
    pub(super) fn new(instance: &ash::Instance, physical: vk::PhysicalDevice, device: &ash::Device, pipelines: bool) -> Self {
        let mut limits = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut limits);
        // SAFETY: the handle is one of this instance; the structs live until the call returns.
        unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
        Self {
            functions: ash::khr::acceleration_structure::Device::new(instance, device),
            scratch_alignment: u64::from(limits.min_acceleration_structure_scratch_offset_alignment.max(1)),
            most_triangles: limits.max_primitive_count,
            pipelines: pipelines.then(|| RayFunctions::new(instance, physical, device)),
        }
    }
}

/// Functions and limits of `VK_KHR_ray_tracing_pipeline`.
pub(super) struct RayFunctions {
    pub functions: ash::khr::ray_tracing_pipeline::Device,
    pub handle_bytes: u32,
    /// Required alignment of the shader binding tables, a multiple of the alignment of handles.
    pub alignment: u32,
    pub most_rays: u32,
}

impl RayFunctions {
    /// Loads the functions of a device with the extension enabled.
    pub(super) fn new(instance: &ash::Instance, physical: vk::PhysicalDevice, device: &ash::Device) -> Self {
        let mut limits = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut limits);
        // SAFETY: the handle is one of this instance; the structs live until the call returns.
        unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
        Self {
            functions: ash::khr::ray_tracing_pipeline::Device::new(instance, device),
            handle_bytes: limits.shader_group_handle_size,
            alignment: limits.shader_group_base_alignment.max(1),
            most_rays: limits.max_ray_dispatch_invocation_count,
        }
    }
}
