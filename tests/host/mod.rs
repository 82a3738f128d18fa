//! A program with a Vulkan device of its own, and what it records every frame.

#![allow(dead_code, unsafe_code, reason = "each test uses a part; a device is made by hand")]

pub mod counted;
pub mod queries;

use ash::vk;
use olbvh::build::{BuildScratch, Capacity, MeshArrays, MeshInput, MeshScratch, MeshView, TreeMemory, cmd_build, cmd_prepare_mesh};
use olbvh::gpu::{Buffer, Enabled, Gpu, HostDevice, Recorder, Requirements};
use olbvh::mesh::Mesh;
use olbvh::options::BuildOptions;
use olbvh::primitives::Arena;
use olbvh::query::{LocateOptions, LocateOutput, PointInput, Scene, cmd_locate};
use std::sync::{Arc, Mutex};

/// An instance and a device as a host makes them, without anything that the engine merely prefers except buffer addresses.
pub struct Host {
    pub entry: ash::Entry,
    pub instance: ash::Instance,
    pub physical: vk::PhysicalDevice,
    pub device: ash::Device,
    pub family: u32,
    pub addresses: bool,
    pub control: bool,
}

impl Host {
    pub fn new() -> Self {
        // SAFETY: plain creation; `drop` destroys device and instance once.
        unsafe {
            let entry = ash::Entry::load().unwrap();
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_2);
            let instance = entry.create_instance(&vk::InstanceCreateInfo::default().application_info(&application), None).unwrap();
            let physical = instance.enumerate_physical_devices().unwrap()[0];
            let needs = Requirements::check(&instance, physical);
            assert!(needs.missing.is_empty(), "{:?}", needs.missing);
            let family = needs.queue_family.unwrap().0;
            let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
            let mut addresses = vk::PhysicalDeviceBufferDeviceAddressFeatures::default().buffer_device_address(needs.buffer_addresses);
            let mut control =
                vk::PhysicalDeviceSubgroupSizeControlFeatures::default().subgroup_size_control(true).compute_full_subgroups(true);
            let extensions = [ash::ext::subgroup_size_control::NAME.as_ptr()];
            let mut info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut addresses);
            if needs.subgroup_size_control {
                info = info.push_next(&mut control).enabled_extension_names(&extensions);
            }
            let device = instance.create_device(physical, &info, None).unwrap();
            let (addresses, control) = (needs.buffer_addresses, needs.subgroup_size_control);
            Self { entry, instance, physical, device, family, addresses, control }
        }
    }

    pub fn enabled(&self) -> Enabled {
        Enabled { buffer_addresses: self.addresses, subgroup_size_control: self.control, ..Enabled::default() }
    }

    pub fn queue(&self) -> Arc<Mutex<vk::Queue>> {
        // SAFETY: the family has a queue, it was asked for above.
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
        // SAFETY: whatever was made from the device is gone.
        unsafe {
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// What a frame of a host does: mesh, tree, location, all within memory that is there.
pub struct Frame {
    pub input: MeshInput,
    pub arrays: MeshArrays,
    pub mesh_scratch: MeshScratch,
    pub tree: TreeMemory,
    pub build_scratch: BuildScratch,
    pub capacity: Capacity,
    pub points: PointInput,
    pub output: LocateOutput,
    pub memory: Buffer,
    held: [Buffer; 2],
}

impl Frame {
    /// For meshes with the points and cells of this one.
    pub fn new(gpu: &Gpu, mesh: &Mesh) -> Self {
        let (points, tets) = (mesh.points.len() as u32, mesh.tets.len() as u32);
        let positions = gpu.upload("olbvh.test.positions", &mesh.points).unwrap();
        let cells = gpu.upload("olbvh.test.cells", &mesh.tets).unwrap();
        let options = BuildOptions::default();
        let capacity = Capacity::for_entries(20 * tets, 10);
        let carve = |a: &mut Arena| {
            let (arrays, mesh_scratch) = (MeshArrays::carve(a, points, tets)?, MeshScratch::carve(a, tets)?);
            let (tree, build_scratch) =
                (TreeMemory::carve(a, &capacity, &options)?, BuildScratch::carve(gpu, a, tets, &capacity, &options)?);
            let output = LocateOutput { owners: a.words(u64::from(points))?, barycentrics: a.take(16 * u64::from(points))? };
            Ok((arrays, mesh_scratch, tree, build_scratch, output))
        };
        let memory = gpu.buffer("olbvh.test.frame", Arena::measure(carve).unwrap()).unwrap();
        let (arrays, mesh_scratch, tree, build_scratch, output) = carve(&mut Arena::new(memory.all())).unwrap();
        let input = MeshInput { positions: positions.all(), stride: 3, points, cells: cells.all(), tets };
        let asked = PointInput { points: positions.all(), stride: 3, count: points, hints: None };
        Self { input, arrays, mesh_scratch, tree, build_scratch, capacity, points: asked, output, memory, held: [cells, positions] }
    }

    pub fn record(&self, r: &mut Recorder<'_>) -> olbvh::Result<()> {
        cmd_prepare_mesh(r, &self.input, &self.arrays, &self.mesh_scratch)?;
        r.barrier("frame.mesh → frame.tree");
        let mesh = MeshView { input: self.input, arrays: self.arrays };
        cmd_build(r, &mesh, &self.tree, &self.capacity, &BuildOptions::default(), &self.build_scratch)?;
        let scene = Scene { mesh, tree: self.tree, longest_leaf: self.input.tets };
        cmd_locate(r, &scene, &self.points, &self.output, &LocateOptions::default())
    }
}
