//! A program with its own Vulkan device, and what it records every frame.

#![allow(dead_code, unsafe_code, reason = "each test uses a part; a device is made by hand")]

pub mod baseline;
pub mod counted;
pub mod live;
pub mod queries;

use ash::vk;
use olbvh::build::{
    BuildScratch, Capacity, MeshArrays, MeshInput, MeshScratch, MeshView, TreeMemory, cmd_build, cmd_move_mesh, cmd_prepare_mesh,
};
use olbvh::gpu::{Arena, Buffer, EnabledFeatures, Gpu, HostDevice, RayTracing, Recorder, Requirements};
use olbvh::mesh::Mesh;
use olbvh::options::BuildOptions;
use olbvh::query::{LocateOptions, LocateOutput, PointInput, Scene, cmd_locate};
use std::ffi::c_void;
use std::sync::{Arc, Mutex};

/// An instance and a device as a host makes them, without anything that this crate merely prefers, except buffer
/// addresses and, if asked for, ray tracing. Under a validation layer, any message fails the test when the device is
/// destroyed.
pub struct Host {
    pub entry: ash::Entry,
    pub instance: ash::Instance,
    pub physical: vk::PhysicalDevice,
    pub device: ash::Device,
    pub family: u32,
    pub addresses: bool,
    pub int64: bool,
    pub control: bool,
    pub rays: RayTracing,
    watched: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Box<Messages>,
}

type Messages = Mutex<Vec<String>>;

unsafe extern "system" fn collect(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: `data` is the layer's valid callback data, with a string; `user` is the box of the host, which outlives
    // the messenger.
    let (text, messages) = unsafe { ((*data).message_as_c_str(), &*user.cast::<Messages>()) };
    messages.lock().unwrap().push(text.unwrap_or_default().to_string_lossy().into_owned());
    vk::FALSE
}

impl Host {
    pub fn new() -> Self {
        Self::with(false)
    }

    /// With everything that ray tracing needs, if the device has it.
    pub fn tracing() -> Self {
        Self::with(true)
    }

    fn with(rays: bool) -> Self {
        // SAFETY: objects are created as Vulkan asks for; `drop` destroys device and instance once.
        unsafe {
            let entry = ash::Entry::load().unwrap();
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_2);
            let names =
                if std::env::var_os("OLBVH_TEST_VALIDATION").is_some() { vec![ash::ext::debug_utils::NAME.as_ptr()] } else { vec![] };
            let info = vk::InstanceCreateInfo::default().application_info(&application).enabled_extension_names(&names);
            let instance = entry.create_instance(&info, None).unwrap();
            let messages = Box::<Messages>::default();
            let watched = (!names.is_empty()).then(|| {
                let functions = ash::ext::debug_utils::Instance::new(&entry, &instance);
                let severities = vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR;
                let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
                    .message_severity(severities)
                    .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
                    .pfn_user_callback(Some(collect))
                    .user_data((&raw const *messages).cast_mut().cast());
                let messenger = functions.create_debug_utils_messenger(&info, None).unwrap();
                (functions, messenger)
            });
            let physical = instance.enumerate_physical_devices().unwrap()[0];
            let needs = Requirements::check(&instance, physical);
            assert!(needs.missing.is_empty(), "{:?}", needs.missing);
            let family = needs.queue_family.unwrap().0;
            let flags = instance.get_physical_device_queue_family_properties(physical)[family as usize].queue_flags;
            let compute_only = std::env::var("OLBVH_TEST_DRIVER").is_ok_and(|name| name.starts_with("lavapipe25compute"));
            assert!(!compute_only || !flags.contains(vk::QueueFlags::GRAPHICS), "{flags:?}");
            let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
            let mut addresses = vk::PhysicalDeviceBufferDeviceAddressFeatures::default().buffer_device_address(needs.buffer_addresses);
            let mut control =
                vk::PhysicalDeviceSubgroupSizeControlFeatures::default().subgroup_size_control(true).compute_full_subgroups(true);
            let mut structures = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
            let mut ray_queries = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
            let mut ray_pipelines = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default().ray_tracing_pipeline(true);
            let rays = if rays { needs.ray_tracing } else { RayTracing::default() };
            let for_rays = if rays.any() { &needs.ray_extensions[..] } else { &[] };
            let extensions: Vec<_> = needs.extensions.iter().chain(for_rays).map(|e| e.as_ptr()).collect();
            let mut info =
                vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut addresses).enabled_extension_names(&extensions);
            let core = vk::PhysicalDeviceFeatures::default().shader_int64(needs.shader_int64);
            info = info.enabled_features(&core);
            if needs.subgroup_size_control {
                info = info.push_next(&mut control);
            }
            if rays.any() {
                info = info.push_next(&mut structures);
            }
            if rays.queries {
                info = info.push_next(&mut ray_queries);
            }
            if rays.pipelines {
                info = info.push_next(&mut ray_pipelines);
            }
            let device = instance.create_device(physical, &info, None).unwrap();
            let (addresses, int64, control) = (needs.buffer_addresses, needs.shader_int64, needs.subgroup_size_control);
            Self { entry, instance, physical, device, family, addresses, int64, control, rays, watched, messages }
        }
    }

    pub fn enabled(&self) -> EnabledFeatures {
        let (buffer_addresses, shader_int64, subgroup_size_control) = (self.addresses, self.int64, self.control);
        EnabledFeatures { buffer_addresses, shader_int64, subgroup_size_control, ray_tracing: self.rays, debug_utils: false }
    }

    pub fn queue(&self) -> Arc<Mutex<vk::Queue>> {
        // SAFETY: the family has a queue, which was requested above.
        Arc::new(Mutex::new(unsafe { self.device.get_device_queue(self.family, 0) }))
    }

    pub fn lend(&self) -> HostDevice {
        HostDevice {
            instance: self.instance.clone(),
            physical: self.physical,
            device: self.device.clone(),
            family: self.family,
            queue: Some(self.queue()),
            allocator: None,
            pipeline_cache: None,
            enabled: self.enabled(),
        }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: everything made from the device is already destroyed.
        unsafe {
            self.device.destroy_device(None);
            if let Some((functions, messenger)) = &self.watched {
                functions.destroy_debug_utils_messenger(*messenger, None);
            }
            self.instance.destroy_instance(None);
        }
        let messages = self.messages.lock().unwrap();
        assert!(messages.is_empty() || std::thread::panicking(), "{messages:#?}");
    }
}

/// A frame of a host: mesh, tree and location, all within memory that exists already.
pub struct Frame {
    pub input: MeshInput,
    pub arrays: MeshArrays,
    pub mesh_scratch: MeshScratch,
    pub tree: TreeMemory,
    pub build_scratch: BuildScratch,
    pub points: PointInput,
    pub output: LocateOutput,
    pub memory: Buffer,
    held: [Buffer; 2],
}

impl Frame {
    /// A frame for meshes with as many points and tetrahedra as this one.
    pub fn new(gpu: &Gpu, mesh: &Mesh) -> Self {
        let (points, tets) = (mesh.points.len() as u32, mesh.tets.len() as u32);
        let positions = gpu.upload("olbvh.test.positions", &mesh.points).unwrap();
        let cells = gpu.upload("olbvh.test.cells", &mesh.tets).unwrap();
        let options = BuildOptions::default();
        let capacity = Capacity::for_entries(20 * tets, 10);
        let carve = |a: &mut Arena| {
            let (arrays, mesh_scratch) = (MeshArrays::carve(a, points, tets)?, MeshScratch::carve(a, points, tets)?);
            let (tree, build_scratch) =
                (TreeMemory::carve(a, &capacity, &options)?, BuildScratch::carve(gpu, a, tets, &capacity, &options)?);
            let output = LocateOutput { owners: a.words(u64::from(points))?, barycentrics: a.take(16 * u64::from(points))? };
            Ok((arrays, mesh_scratch, tree, build_scratch, output))
        };
        let (memory, (arrays, mesh_scratch, tree, build_scratch, output)) = Arena::reserve(gpu, "olbvh.test.frame", carve).unwrap();
        let input = MeshInput { positions: positions.all(), stride: 3, points, cells: cells.all(), tets };
        let asked = PointInput { points: positions.all(), stride: 3, count: points, hints: None, order: None };
        Self { input, arrays, mesh_scratch, tree, build_scratch, points: asked, output, memory, held: [cells, positions] }
    }

    pub fn record(&self, r: &mut Recorder<'_>) -> olbvh::Result<()> {
        cmd_prepare_mesh(r, &self.input, &self.arrays, &self.mesh_scratch)?;
        self.record_tree(r)
    }

    /// For points that have moved since a frame was recorded into this memory.
    pub fn record_moved(&self, r: &mut Recorder<'_>) -> olbvh::Result<()> {
        cmd_move_mesh(r, &self.input, &self.arrays, &self.mesh_scratch)?;
        self.record_tree(r)
    }

    fn record_tree(&self, r: &mut Recorder<'_>) -> olbvh::Result<()> {
        r.barrier("frame.mesh → frame.tree");
        let mesh = MeshView { input: self.input, arrays: self.arrays };
        cmd_build(r, &mesh, &self.tree, &BuildOptions::default(), &self.build_scratch)?;
        let scene = Scene::recorded(mesh, self.tree);
        cmd_locate(r, &scene, &self.points, &self.output, &LocateOptions::default())
    }
}
