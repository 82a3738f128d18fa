//! The host's pictures: render pass, two pipelines, and what is needed to write pictures to a file.

use crate::host::{Host, HostBuffer, HostImage};
use anyhow::{Context, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use std::path::Path;

const COLOR: vk::Format = vk::Format::R8G8B8A8_UNORM;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// Compiles a shader of this folder. `olbvh.glsl` is the file that the crate exports.
fn compile(host: &Host, name: &str, kind: shaderc::ShaderKind, descriptors: bool) -> Result<vk::ShaderModule> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/embed_renderer/shaders");
    let text = std::fs::read_to_string(folder.join(name)).with_context(|| name.to_owned())?;
    let compiler = shaderc::Compiler::new()?;
    let mut options = shaderc::CompileOptions::new()?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    options.set_include_callback(|wanted, _, _, _| {
        let content = match wanted {
            "olbvh.glsl" => olbvh::glsl::OLBVH.to_owned(),
            file => std::fs::read_to_string(folder.join(file)).map_err(|e| e.to_string())?,
        };
        Ok(shaderc::ResolvedInclude { resolved_name: wanted.to_owned(), content })
    });
    if descriptors {
        options.add_macro_definition("OLBVH_DESCRIPTORS", None);
    }
    let code = compiler.compile_into_spirv(&text, kind, name, "main", Some(&options))?;
    // SAFETY: the SPIR-V comes from the compiler.
    Ok(unsafe { host.device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(code.as_binary()), None) }?)
}

/// The push constants of the shaders: see `shaders/cut.vert`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Push {
    pub camera: [[f32; 4]; 4],
    pub plane: [f32; 4],
    pub corner: [f32; 4],
    pub right: [f32; 4],
    /// The address of the tree, two words.
    pub tree: [u32; 2],
}

/// What a frame draws.
pub struct Drawing<'a> {
    pub positions: &'a HostBuffer,
    pub values: &'a HostBuffer,
    pub triangles: &'a HostBuffer,
    pub indices: u32,
    pub tree_set: Option<vk::DescriptorSet>,
    pub push: Push,
}

pub struct Pictures {
    size: [u32; 2],
    pass: vk::RenderPass,
    layout: vk::PipelineLayout,
    surface: vk::Pipeline,
    cut: vk::Pipeline,
    depth: Vec<HostImage>,
    color: Vec<HostImage>,
    framebuffers: Vec<vk::Framebuffer>,
    pub readback: Vec<HostBuffer>,
}

impl Pictures {
    pub fn new(host: &Host, size: [u32; 2], in_flight: usize, tree_set: Option<vk::DescriptorSetLayout>) -> Result<Self> {
        let device = &host.device;
        // SAFETY: objects are created as Vulkan asks for; `free` destroys each of them once.
        unsafe {
            let attachment = |format, layout| {
                vk::AttachmentDescription::default()
                    .format(format)
                    .samples(vk::SampleCountFlags::TYPE_1)
                    .load_op(vk::AttachmentLoadOp::CLEAR)
                    .store_op(vk::AttachmentStoreOp::STORE)
                    .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
                    .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
                    .final_layout(layout)
            };
            let attachments = [
                attachment(COLOR, vk::ImageLayout::TRANSFER_SRC_OPTIMAL),
                attachment(DEPTH, vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL),
            ];
            let colors = [vk::AttachmentReference { attachment: 0, layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL }];
            let depth = vk::AttachmentReference { attachment: 1, layout: vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL };
            let subpasses = [vk::SubpassDescription::default()
                .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
                .color_attachments(&colors)
                .depth_stencil_attachment(&depth)];
            let output = vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT;
            let tests = vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS;
            let written = vk::AccessFlags::COLOR_ATTACHMENT_WRITE | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE;
            let dependencies = [
                vk::SubpassDependency::default()
                    .src_subpass(vk::SUBPASS_EXTERNAL)
                    .src_stage_mask(output | tests | vk::PipelineStageFlags::TRANSFER)
                    .src_access_mask(written)
                    .dst_stage_mask(output | tests)
                    .dst_access_mask(written | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ),
                vk::SubpassDependency::default()
                    .dst_subpass(vk::SUBPASS_EXTERNAL)
                    .src_stage_mask(output)
                    .src_access_mask(vk::AccessFlags::COLOR_ATTACHMENT_WRITE)
                    .dst_stage_mask(vk::PipelineStageFlags::TRANSFER)
                    .dst_access_mask(vk::AccessFlags::TRANSFER_READ),
            ];
            let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses).dependencies(&dependencies);
            let pass = device.create_render_pass(&info, None)?;
            let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
            let ranges = [vk::PushConstantRange::default().stage_flags(stages).size(size_of::<Push>() as u32)];
            let sets: Vec<_> = tree_set.into_iter().collect();
            let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges).set_layouts(&sets);
            let layout = device.create_pipeline_layout(&info, None)?;
            let descriptors = tree_set.is_some();
            let surface = pipeline(host, size, (pass, layout), ["surface.vert", "surface.frag"], true, descriptors)?;
            let cut = pipeline(host, size, (pass, layout), ["cut.vert", "cut.frag"], false, descriptors)?;
            let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
            let (mut color, mut depth, mut framebuffers, mut readback) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
            for _ in 0..in_flight {
                color.push(host.image("color", size, COLOR, usage)?);
                depth.push(host.image("depth", size, DEPTH, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT)?);
                let views = [color[color.len() - 1].view, depth[depth.len() - 1].view];
                let info = vk::FramebufferCreateInfo::default().render_pass(pass).attachments(&views);
                framebuffers.push(device.create_framebuffer(&info.width(size[0]).height(size[1]).layers(1), None)?);
                let bytes = u64::from(size[0]) * u64::from(size[1]) * 4;
                readback.push(host.buffer("readback", bytes, vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu)?);
            }
            Ok(Self { size, pass, layout, surface, cut, depth, color, framebuffers, readback })
        }
    }

    /// Records a picture and its copy to memory of the processor. What it reads must be visible to vertex input and
    /// fragment shaders.
    pub fn record(&self, host: &Host, commands: vk::CommandBuffer, slot: usize, d: &Drawing<'_>) {
        let (device, [width, height]) = (&host.device, self.size);
        let clear = [
            vk::ClearValue { color: vk::ClearColorValue { float32: [0.10, 0.11, 0.13, 1.0] } },
            vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 } },
        ];
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let begin = vk::RenderPassBeginInfo::default().render_pass(self.pass).framebuffer(self.framebuffers[slot]);
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        // SAFETY: the command buffer is in the recording state; everything bound outlives its execution.
        unsafe {
            device.cmd_begin_render_pass(commands, &begin.render_area(area).clear_values(&clear), vk::SubpassContents::INLINE);
            device.cmd_push_constants(commands, self.layout, stages, 0, bytemuck::bytes_of(&d.push));
            device.cmd_bind_pipeline(commands, graphics, self.surface);
            device.cmd_bind_vertex_buffers(commands, 0, &[d.positions.handle, d.values.handle], &[0, 0]);
            device.cmd_bind_index_buffer(commands, d.triangles.handle, 0, vk::IndexType::UINT32);
            device.cmd_draw_indexed(commands, d.indices, 1, 0, 0, 0);
            device.cmd_bind_pipeline(commands, graphics, self.cut);
            if let Some(set) = d.tree_set {
                device.cmd_bind_descriptor_sets(commands, graphics, self.layout, 0, &[set], &[]);
            }
            device.cmd_draw(commands, 4, 1, 0, 0);
            device.cmd_end_render_pass(commands);
            let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
            let region = vk::BufferImageCopy::default().image_subresource(layers).image_extent(vk::Extent3D { width, height, depth: 1 });
            let (image, to) = (self.color[slot].handle, self.readback[slot].handle);
            device.cmd_copy_image_to_buffer(commands, image, vk::ImageLayout::TRANSFER_SRC_OPTIMAL, to, &[region]);
            let seen =
                [vk::MemoryBarrier::default().src_access_mask(vk::AccessFlags::TRANSFER_WRITE).dst_access_mask(vk::AccessFlags::HOST_READ)];
            let (from, to) = (vk::PipelineStageFlags::TRANSFER, vk::PipelineStageFlags::HOST);
            device.cmd_pipeline_barrier(commands, from, to, vk::DependencyFlags::empty(), &seen, &[], &[]);
        }
    }

    pub fn free(self, host: &Host) {
        // SAFETY: the device is idle.
        unsafe {
            self.framebuffers.into_iter().for_each(|f| host.device.destroy_framebuffer(f, None));
            [self.surface, self.cut].into_iter().for_each(|p| host.device.destroy_pipeline(p, None));
            host.device.destroy_pipeline_layout(self.layout, None);
            host.device.destroy_render_pass(self.pass, None);
        }
        self.readback.into_iter().for_each(|b| host.free(b));
        self.color.into_iter().chain(self.depth).for_each(|i| host.free_image(i));
    }
}

/// The pipeline of the surface, with vertices, or of the rectangle of the cut, without.
fn pipeline(
    host: &Host,
    [width, height]: [u32; 2],
    (pass, layout): (vk::RenderPass, vk::PipelineLayout),
    shaders: [&str; 2],
    vertices: bool,
    descriptors: bool,
) -> Result<vk::Pipeline> {
    let modules = [
        compile(host, shaders[0], shaderc::ShaderKind::Vertex, descriptors)?,
        compile(host, shaders[1], shaderc::ShaderKind::Fragment, descriptors)?,
    ];
    let stage = |stage, module| vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main");
    let stages = [stage(vk::ShaderStageFlags::VERTEX, modules[0]), stage(vk::ShaderStageFlags::FRAGMENT, modules[1])];
    let bindings = [12, 4].map(|stride| vk::VertexInputBindingDescription { binding: 0, stride, ..Default::default() });
    let bindings = [bindings[0], vk::VertexInputBindingDescription { binding: 1, ..bindings[1] }];
    let attributes = [
        vk::VertexInputAttributeDescription { location: 0, binding: 0, format: vk::Format::R32G32B32_SFLOAT, offset: 0 },
        vk::VertexInputAttributeDescription { location: 1, binding: 1, format: vk::Format::R32_SFLOAT, offset: 0 },
    ];
    let mut input = vk::PipelineVertexInputStateCreateInfo::default();
    if vertices {
        input = input.vertex_binding_descriptions(&bindings).vertex_attribute_descriptions(&attributes);
    }
    let topology = if vertices { vk::PrimitiveTopology::TRIANGLE_LIST } else { vk::PrimitiveTopology::TRIANGLE_STRIP };
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(topology);
    let viewports = [vk::Viewport { width: width as f32, height: height as f32, max_depth: 1.0, ..Default::default() }];
    let scissors = [vk::Rect2D { extent: vk::Extent2D { width, height }, ..Default::default() }];
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&viewports).scissors(&scissors);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().polygon_mode(vk::PolygonMode::FILL).line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(true).depth_write_enable(true);
    let depth = depth.depth_compare_op(vk::CompareOp::LESS_OR_EQUAL);
    let blend = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blend);
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .layout(layout)
        .render_pass(pass);
    // SAFETY: all structs outlive the call; the modules are needed only until then.
    unsafe {
        let made = host.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
        modules.into_iter().for_each(|m| host.device.destroy_shader_module(m, None));
        Ok(made.map_err(|(_, e)| e)?[0])
    }
}
