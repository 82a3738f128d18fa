//! The host: a small offscreen Vulkan renderer that knows nothing about olbvh, with instance, device, one graphics
//! queue, an allocator, images and buffers.

use anyhow::{Context, Result, bail};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};
use std::ffi::c_void;
use std::sync::{Arc, Mutex};

/// Messages of a validation layer, if one is loaded.
type Messages = Mutex<Vec<String>>;

unsafe extern "system" fn collect(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes valid callback data; `user` is the box that `Host` keeps until the messenger is destroyed.
    let (data, messages) = unsafe { (&*data, &*user.cast::<Messages>()) };
    // SAFETY: the message is a C string that is valid for the duration of the call.
    let text = unsafe { data.message_as_c_str() }.map(|t| t.to_string_lossy().into_owned()).unwrap_or_default();
    if !text.contains("loader") {
        messages.lock().unwrap().push(text);
    }
    vk::FALSE
}

pub struct Host {
    _entry: ash::Entry,
    pub instance: ash::Instance,
    pub physical: vk::PhysicalDevice,
    pub device: ash::Device,
    pub family: u32,
    pub queue: Arc<Mutex<vk::Queue>>,
    allocator: Option<Arc<Mutex<Allocator>>>,
    pub debug: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT, Box<Messages>)>,
    pub addresses: bool,
    pub int64: bool,
    pub size_control: bool,
}

impl Host {
    pub fn new(addresses: bool) -> Result<Self> {
        // SAFETY: objects are created as Vulkan asks for; `drop` destroys each of them once, children first.
        unsafe {
            let entry = ash::Entry::load()?;
            let has_debug = entry
                .enumerate_instance_extension_properties(None)?
                .iter()
                .any(|e| e.extension_name_as_c_str() == Ok(ash::ext::debug_utils::NAME));
            let extensions: Vec<_> = has_debug.then_some(ash::ext::debug_utils::NAME.as_ptr()).into_iter().collect();
            let application = vk::ApplicationInfo::default().application_name(c"embed_renderer").api_version(vk::API_VERSION_1_2);
            let info = vk::InstanceCreateInfo::default().application_info(&application).enabled_extension_names(&extensions);
            let instance = entry.create_instance(&info, None)?;
            let debug = has_debug.then(|| {
                let functions = ash::ext::debug_utils::Instance::new(&entry, &instance);
                let messages = Box::new(Messages::default());
                let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
                    .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
                    .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
                    .pfn_user_callback(Some(collect))
                    .user_data((&raw const *messages).cast_mut().cast());
                functions.create_debug_utils_messenger(&info, None).map(|m| (functions, m, messages))
            });
            let debug = debug.transpose()?;
            let physical = *instance.enumerate_physical_devices()?.first().context("no Vulkan device")?;
            let families = instance.get_physical_device_queue_family_properties(physical);
            let both = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
            let family = families.iter().position(|f| f.queue_flags.contains(both)).context("no queue for graphics and compute")? as u32;
            // What olbvh would like to have enabled, asked before there is a device.
            let wanted = olbvh::gpu::Requirements::check(&instance, physical);
            if !wanted.missing.is_empty() {
                bail!("the device lacks {}", wanted.missing.join(", "));
            }
            let (addresses, size_control) = (addresses && wanted.buffer_addresses, wanted.subgroup_size_control);
            let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
            let names: Vec<_> = wanted.extensions.iter().map(|name| name.as_ptr()).collect();
            let mut address = vk::PhysicalDeviceBufferDeviceAddressFeatures::default().buffer_device_address(addresses);
            let mut control =
                vk::PhysicalDeviceSubgroupSizeControlFeatures::default().subgroup_size_control(true).compute_full_subgroups(true);
            let features = vk::PhysicalDeviceFeatures::default().shader_clip_distance(true).shader_int64(wanted.shader_int64);
            let mut info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&names);
            info = info.enabled_features(&features).push_next(&mut address);
            if size_control {
                info = info.push_next(&mut control);
            }
            let device = instance.create_device(physical, &info, None)?;
            let queue = Arc::new(Mutex::new(device.get_device_queue(family, 0)));
            let allocator = Allocator::new(&AllocatorCreateDesc {
                instance: instance.clone(),
                device: device.clone(),
                physical_device: physical,
                debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
                buffer_device_address: addresses,
                allocation_sizes: gpu_allocator::AllocationSizes::default(),
            })?;
            let allocator = Some(Arc::new(Mutex::new(allocator)));
            Ok(Self {
                _entry: entry,
                instance,
                physical,
                device,
                family,
                queue,
                allocator,
                debug,
                addresses,
                int64: wanted.shader_int64,
                size_control,
            })
        }
    }

    pub fn allocator(&self) -> &Arc<Mutex<Allocator>> {
        self.allocator.as_ref().expect("taken in drop only")
    }

    /// Fails if a validation layer reported anything.
    pub fn check(&self) -> Result<()> {
        let messages = self.debug.as_ref().map(|d| d.2.lock().unwrap().clone()).unwrap_or_default();
        if messages.is_empty() { Ok(()) } else { bail!("validation: {}", messages.join("\n")) }
    }

    fn allocate(&self, name: &str, requirements: vk::MemoryRequirements, location: MemoryLocation, linear: bool) -> Result<Allocation> {
        let description =
            AllocationCreateDesc { name, requirements, location, linear, allocation_scheme: AllocationScheme::GpuAllocatorManaged };
        Ok(self.allocator().lock().unwrap().allocate(&description)?)
    }

    pub fn buffer(&self, name: &str, size: u64, usage: vk::BufferUsageFlags, location: MemoryLocation) -> Result<HostBuffer> {
        // SAFETY: fresh memory of the right requirements, bound once.
        unsafe {
            let handle = self.device.create_buffer(&vk::BufferCreateInfo::default().size(size).usage(usage), None)?;
            let allocation = self.allocate(name, self.device.get_buffer_memory_requirements(handle), location, true)?;
            self.device.bind_buffer_memory(handle, allocation.memory(), allocation.offset())?;
            let info = vk::BufferDeviceAddressInfo::default().buffer(handle);
            let address =
                if usage.contains(vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS) { self.device.get_buffer_device_address(&info) } else { 0 };
            Ok(HostBuffer { handle, size, address, allocation })
        }
    }

    /// A buffer that the processor writes, filled with `data`.
    pub fn filled<T: bytemuck::Pod>(&self, name: &str, data: &[T], usage: vk::BufferUsageFlags) -> Result<HostBuffer> {
        let mut buffer = self.buffer(name, size_of_val(data) as u64, usage, MemoryLocation::CpuToGpu)?;
        buffer.write(data);
        Ok(buffer)
    }

    pub fn image(&self, name: &str, size: [u32; 2], format: vk::Format, usage: vk::ImageUsageFlags) -> Result<HostImage> {
        let aspect = if format == vk::Format::D32_SFLOAT { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR };
        let extent = vk::Extent3D { width: size[0], height: size[1], depth: 1 };
        let info = vk::ImageCreateInfo::default().image_type(vk::ImageType::TYPE_2D).format(format).extent(extent);
        let info = info.mip_levels(1).array_layers(1).samples(vk::SampleCountFlags::TYPE_1).usage(usage);
        // SAFETY: fresh memory of the right requirements, bound once.
        unsafe {
            let handle = self.device.create_image(&info, None)?;
            let requirements = self.device.get_image_memory_requirements(handle);
            let allocation = self.allocate(name, requirements, MemoryLocation::GpuOnly, false)?;
            self.device.bind_image_memory(handle, allocation.memory(), allocation.offset())?;
            let range = vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1);
            let info = vk::ImageViewCreateInfo::default().image(handle).view_type(vk::ImageViewType::TYPE_2D).format(format);
            let view = self.device.create_image_view(&info.subresource_range(range), None)?;
            Ok(HostImage { handle, view, allocation })
        }
    }

    /// Records a barrier from and to these stages and accesses.
    pub fn barrier(
        &self,
        commands: vk::CommandBuffer,
        (from, to): (vk::PipelineStageFlags, vk::PipelineStageFlags),
        (written, read): (vk::AccessFlags, vk::AccessFlags),
    ) {
        let barrier = [vk::MemoryBarrier::default().src_access_mask(written).dst_access_mask(read)];
        // SAFETY: the command buffer is in the recording state, outside of a render pass.
        unsafe { self.device.cmd_pipeline_barrier(commands, from, to, vk::DependencyFlags::empty(), &barrier, &[], &[]) };
    }

    /// A layout and a pool for sets of so many storage buffers.
    pub fn storage_sets(&self, buffers: usize, sets: usize) -> Result<(vk::DescriptorPool, vk::DescriptorSetLayout)> {
        let bindings: Vec<_> = (0..buffers as u32)
            .map(|i| {
                let binding = vk::DescriptorSetLayoutBinding::default().binding(i).descriptor_count(1);
                binding.descriptor_type(vk::DescriptorType::STORAGE_BUFFER).stage_flags(vk::ShaderStageFlags::FRAGMENT)
            })
            .collect();
        let sizes = [vk::DescriptorPoolSize { ty: vk::DescriptorType::STORAGE_BUFFER, descriptor_count: (buffers * sets) as u32 }];
        // SAFETY: objects are created as Vulkan asks for; `free_sets` destroys both.
        unsafe {
            let layout =
                self.device.create_descriptor_set_layout(&vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings), None)?;
            let info = vk::DescriptorPoolCreateInfo::default().max_sets(sets as u32).pool_sizes(&sizes);
            Ok((self.device.create_descriptor_pool(&info, None)?, layout))
        }
    }

    pub fn free_sets(&self, pool: vk::DescriptorPool, layout: vk::DescriptorSetLayout) {
        // SAFETY: the device is idle when the renderer frees its sets.
        unsafe {
            self.device.destroy_descriptor_pool(pool, None);
            self.device.destroy_descriptor_set_layout(layout, None);
        }
    }

    pub fn free(&self, buffer: HostBuffer) {
        // SAFETY: the device is idle when the renderer frees its buffers.
        unsafe { self.device.destroy_buffer(buffer.handle, None) };
        let _ = self.allocator().lock().unwrap().free(buffer.allocation);
    }

    pub fn free_image(&self, image: HostImage) {
        // SAFETY: the device is idle when the renderer frees its images.
        unsafe {
            self.device.destroy_image_view(image.view, None);
            self.device.destroy_image(image.handle, None);
        }
        let _ = self.allocator().lock().unwrap().free(image.allocation);
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: nothing uses the device any more; the allocator frees its blocks before the device is destroyed.
        unsafe {
            let _ = self.device.device_wait_idle();
            drop(self.allocator.take());
            self.device.destroy_device(None);
            if let Some((functions, messenger, _)) = &self.debug {
                functions.destroy_debug_utils_messenger(*messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

pub struct HostBuffer {
    pub handle: vk::Buffer,
    pub size: u64,
    pub address: u64,
    allocation: Allocation,
}

impl HostBuffer {
    pub fn write<T: bytemuck::Pod>(&mut self, data: &[T]) {
        let bytes = bytemuck::cast_slice(data);
        self.allocation.mapped_slice_mut().expect("written by the processor")[..bytes.len()].copy_from_slice(bytes);
    }

    pub fn bytes(&self) -> &[u8] {
        &self.allocation.mapped_slice().expect("read by the processor")[..self.size as usize]
    }

    /// The buffer in the form that olbvh takes.
    pub fn part(&self) -> olbvh::gpu::BufferRef {
        // SAFETY: this is the whole buffer, made with the usage that olbvh asks for.
        unsafe { olbvh::gpu::BufferRef::from_raw(self.handle, 0, self.size, self.address) }
    }
}

pub struct HostImage {
    pub handle: vk::Image,
    pub view: vk::ImageView,
    allocation: Allocation,
}

/// A set with these buffers, which outlive it.
pub fn storage_set(
    host: &Host,
    pool: vk::DescriptorPool,
    layout: vk::DescriptorSetLayout,
    buffers: &[olbvh::gpu::BufferRef],
) -> Result<vk::DescriptorSet> {
    let layouts = [layout];
    let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
    let range = |b: &olbvh::gpu::BufferRef| [vk::DescriptorBufferInfo { buffer: b.buffer(), offset: b.offset(), range: b.size() }];
    let infos: Vec<_> = buffers.iter().map(range).collect();
    // SAFETY: the pool has room for the set, and the infos outlive the call.
    unsafe {
        let set = host.device.allocate_descriptor_sets(&info)?[0];
        let writes: Vec<_> = (0..)
            .zip(&infos)
            .map(|(i, info)| {
                let write = vk::WriteDescriptorSet::default().dst_set(set).dst_binding(i);
                write.descriptor_type(vk::DescriptorType::STORAGE_BUFFER).buffer_info(info)
            })
            .collect();
        host.device.update_descriptor_sets(&writes, &[]);
        Ok(set)
    }
}
