//! The host's pictures: the surfaces, in a first render pass, the volume that is blended over them, in a second one, and
//! what is needed to write pictures to a file.

use crate::host::{Host, HostBuffer, HostImage};
use anyhow::{Context, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use std::path::Path;

const COLOR: vk::Format = vk::Format::R8G8B8A8_UNORM;
const DEPTH: vk::Format = vk::Format::D32_SFLOAT;
/// The stages that push constants are for.
const STAGES: vk::ShaderStageFlags =
    vk::ShaderStageFlags::from_raw(vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw());

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

/// A render pass of one subpass, with the layout of its pipelines.
struct Pass {
    pass: vk::RenderPass,
    layout: vk::PipelineLayout,
}

/// The images of a slot, and its framebuffers in the two passes.
struct Target {
    color: HostImage,
    depth: HostImage,
    framebuffers: [vk::Framebuffer; 2],
}

pub struct Pictures {
    size: [u32; 2],
    surfaces: Pass,
    blending: Pass,
    surface: vk::Pipeline,
    cut: vk::Pipeline,
    blend: vk::Pipeline,
    targets: Vec<Target>,
    pub readback: Vec<HostBuffer>,
}

/// The two passes: the first one draws colours and depths, and the second one blends over the colours. Then the first
/// image, and after the first pass the depths, can be copied from.
fn passes(host: &Host) -> Result<[vk::RenderPass; 2]> {
    let output = vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT;
    let tests = vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS;
    let written = vk::AccessFlags::COLOR_ATTACHMENT_WRITE | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE;
    let attachment = |format, from, to| {
        let load = if from == vk::ImageLayout::UNDEFINED { vk::AttachmentLoadOp::CLEAR } else { vk::AttachmentLoadOp::LOAD };
        vk::AttachmentDescription::default()
            .format(format)
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(load)
            .store_op(vk::AttachmentStoreOp::STORE)
            .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
            .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
            .initial_layout(from)
            .final_layout(to)
    };
    let (color, copied) = (vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
    let first = [attachment(COLOR, vk::ImageLayout::UNDEFINED, color), attachment(DEPTH, vk::ImageLayout::UNDEFINED, copied)];
    let second = [attachment(COLOR, color, copied)];
    let colors = [vk::AttachmentReference { attachment: 0, layout: color }];
    let depth = vk::AttachmentReference { attachment: 1, layout: vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL };
    let blended = vk::SubpassDescription::default().pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS).color_attachments(&colors);
    let before = vk::SubpassDependency::default()
        .src_subpass(vk::SUBPASS_EXTERNAL)
        .src_stage_mask(output | tests | vk::PipelineStageFlags::TRANSFER)
        .src_access_mask(written)
        .dst_stage_mask(output | tests)
        .dst_access_mask(written | vk::AccessFlags::COLOR_ATTACHMENT_READ | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ);
    let behind = vk::SubpassDependency::default()
        .dst_subpass(vk::SUBPASS_EXTERNAL)
        .src_stage_mask(output | tests)
        .src_access_mask(written)
        .dst_stage_mask(vk::PipelineStageFlags::TRANSFER)
        .dst_access_mask(vk::AccessFlags::TRANSFER_READ);
    let dependencies = [before, behind];
    let pass = |attachments: &[vk::AttachmentDescription], subpass| {
        let subpasses = [subpass];
        let info = vk::RenderPassCreateInfo::default().attachments(attachments).subpasses(&subpasses).dependencies(&dependencies);
        // SAFETY: all structs outlive the call; `Pictures::free` destroys the pass.
        unsafe { host.device.create_render_pass(&info, None) }
    };
    Ok([pass(&first, blended.depth_stencil_attachment(&depth))?, pass(&second, blended)?])
}

impl Pictures {
    /// `sets` are the layouts of the set with the tree, if there is one, and of the set with the colours of the volume.
    pub fn new(
        host: &Host,
        size: [u32; 2],
        in_flight: usize,
        sets: (Option<vk::DescriptorSetLayout>, vk::DescriptorSetLayout),
    ) -> Result<Self> {
        let device = &host.device;
        let [width, height] = size;
        let descriptors = sets.0.is_some();
        let with_layout = |pass, set: Option<vk::DescriptorSetLayout>, bytes: usize| {
            let ranges = [vk::PushConstantRange::default().stage_flags(STAGES).size(bytes as u32)];
            let sets: Vec<_> = set.into_iter().collect();
            let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&ranges).set_layouts(&sets);
            // SAFETY: the info is complete; `free` destroys the layout.
            Ok::<_, vk::Result>(Pass { pass, layout: unsafe { device.create_pipeline_layout(&info, None) }? })
        };
        let [first, second] = passes(host)?;
        let (surfaces, blending) = (with_layout(first, sets.0, size_of::<Push>())?, with_layout(second, Some(sets.1), 4)?);
        let surface = pipeline(host, size, &surfaces, ["surface.vert", "surface.frag"], Kind::Vertices, descriptors)?;
        let cut = pipeline(host, size, &surfaces, ["cut.vert", "cut.frag"], Kind::Rectangle, descriptors)?;
        let blend = pipeline(host, size, &blending, ["blend.vert", "blend.frag"], Kind::Blended, false)?;
        let framebuffer = |pass, views: &[vk::ImageView]| {
            let info = vk::FramebufferCreateInfo::default().render_pass(pass).attachments(views).width(width).height(height).layers(1);
            // SAFETY: the views have this size and the formats of the pass; `free` destroys the framebuffer.
            unsafe { device.create_framebuffer(&info, None) }
        };
        let copied = vk::ImageUsageFlags::TRANSFER_SRC;
        let target = |_| {
            let color = host.image("color", size, COLOR, vk::ImageUsageFlags::COLOR_ATTACHMENT | copied)?;
            let depth = host.image("depth", size, DEPTH, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | copied)?;
            let framebuffers = [framebuffer(first, &[color.view, depth.view])?, framebuffer(second, &[color.view])?];
            Ok(Target { color, depth, framebuffers })
        };
        let targets = (0..in_flight).map(target).collect::<Result<_>>()?;
        let bytes = u64::from(width) * u64::from(height) * 4;
        let readback = |_| host.buffer("readback", bytes, vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu);
        let readback = (0..in_flight).map(readback).collect::<Result<_>>()?;
        Ok(Self { size, surfaces, blending, surface, cut, blend, targets, readback })
    }

    /// Records the surfaces, and a copy of their depths for olbvh. What they read must be visible to vertex input and fragment
    /// shaders. Ends with a barrier to compute shaders.
    pub fn record_surfaces(&self, host: &Host, commands: vk::CommandBuffer, slot: usize, d: &Drawing<'_>, depths: &HostBuffer) {
        let (device, layout, target) = (&host.device, self.surfaces.layout, &self.targets[slot]);
        let clear = [
            vk::ClearValue { color: vk::ClearColorValue { float32: [0.10, 0.11, 0.13, 1.0] } },
            vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 1.0, stencil: 0 } },
        ];
        let begin = vk::RenderPassBeginInfo::default().render_pass(self.surfaces.pass).framebuffer(target.framebuffers[0]);
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the command buffer is in the recording state; everything bound outlives its execution.
        unsafe {
            device.cmd_begin_render_pass(commands, &begin.render_area(self.area()).clear_values(&clear), vk::SubpassContents::INLINE);
            device.cmd_push_constants(commands, layout, STAGES, 0, bytemuck::bytes_of(&d.push));
            device.cmd_bind_pipeline(commands, graphics, self.surface);
            device.cmd_bind_vertex_buffers(commands, 0, &[d.positions.handle, d.values.handle], &[0, 0]);
            device.cmd_bind_index_buffer(commands, d.triangles.handle, 0, vk::IndexType::UINT32);
            device.cmd_draw_indexed(commands, d.indices, 1, 0, 0, 0);
            device.cmd_bind_pipeline(commands, graphics, self.cut);
            if let Some(set) = d.tree_set {
                device.cmd_bind_descriptor_sets(commands, graphics, layout, 0, &[set], &[]);
            }
            device.cmd_draw(commands, 4, 1, 0, 0);
            device.cmd_end_render_pass(commands);
        }
        self.copy(host, commands, &target.depth, vk::ImageAspectFlags::DEPTH, depths);
        let stages = (vk::PipelineStageFlags::TRANSFER, vk::PipelineStageFlags::COMPUTE_SHADER);
        host.barrier(commands, stages, (vk::AccessFlags::TRANSFER_WRITE, vk::AccessFlags::SHADER_READ));
    }

    /// Records the blending of the volume, which `colors` has, over the surfaces, and a copy of the picture to memory of the
    /// processor. The colours must be visible to fragment shaders.
    pub fn record_volume(&self, host: &Host, commands: vk::CommandBuffer, slot: usize, colors: vk::DescriptorSet) {
        let (device, layout, target) = (&host.device, self.blending.layout, &self.targets[slot]);
        let begin = vk::RenderPassBeginInfo::default().render_pass(self.blending.pass).framebuffer(target.framebuffers[1]);
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the command buffer is in the recording state; everything bound outlives its execution.
        unsafe {
            device.cmd_begin_render_pass(commands, &begin.render_area(self.area()), vk::SubpassContents::INLINE);
            device.cmd_bind_pipeline(commands, graphics, self.blend);
            device.cmd_push_constants(commands, layout, STAGES, 0, bytemuck::bytes_of(&self.size[0]));
            device.cmd_bind_descriptor_sets(commands, graphics, layout, 0, &[colors], &[]);
            device.cmd_draw(commands, 3, 1, 0, 0);
            device.cmd_end_render_pass(commands);
        }
        self.copy(host, commands, &target.color, vk::ImageAspectFlags::COLOR, &self.readback[slot]);
        let stages = (vk::PipelineStageFlags::TRANSFER, vk::PipelineStageFlags::HOST);
        host.barrier(commands, stages, (vk::AccessFlags::TRANSFER_WRITE, vk::AccessFlags::HOST_READ));
    }

    fn area(&self) -> vk::Rect2D {
        vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width: self.size[0], height: self.size[1] } }
    }

    /// Records the copy of an image, which a pass has left ready for it.
    fn copy(&self, host: &Host, commands: vk::CommandBuffer, from: &HostImage, aspect: vk::ImageAspectFlags, to: &HostBuffer) {
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(aspect).layer_count(1);
        let extent = vk::Extent3D { width: self.size[0], height: self.size[1], depth: 1 };
        let region = vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent);
        // SAFETY: the buffer holds four bytes per pixel, and both outlive the execution.
        unsafe { host.device.cmd_copy_image_to_buffer(commands, from.handle, vk::ImageLayout::TRANSFER_SRC_OPTIMAL, to.handle, &[region]) };
    }

    pub fn free(self, host: &Host) {
        // SAFETY: the device is idle.
        unsafe {
            [self.surface, self.cut, self.blend].into_iter().for_each(|p| host.device.destroy_pipeline(p, None));
            for Pass { pass, layout } in [self.surfaces, self.blending] {
                host.device.destroy_pipeline_layout(layout, None);
                host.device.destroy_render_pass(pass, None);
            }
            for Target { color, depth, framebuffers } in self.targets {
                framebuffers.into_iter().for_each(|f| host.device.destroy_framebuffer(f, None));
                [color, depth].into_iter().for_each(|i| host.free_image(i));
            }
        }
        self.readback.into_iter().for_each(|b| host.free(b));
    }
}

/// What a pipeline draws.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Triangles with vertices in buffers.
    Vertices,
    /// A rectangle that the vertex shader makes.
    Rectangle,
    /// A triangle that the vertex shader makes, blended over the picture whatever its depth.
    Blended,
}

/// A pipeline of a pass.
fn pipeline(
    host: &Host,
    [width, height]: [u32; 2],
    pass: &Pass,
    shaders: [&str; 2],
    kind: Kind,
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
    if kind == Kind::Vertices {
        input = input.vertex_binding_descriptions(&bindings).vertex_attribute_descriptions(&attributes);
    }
    let topology = if kind == Kind::Rectangle { vk::PrimitiveTopology::TRIANGLE_STRIP } else { vk::PrimitiveTopology::TRIANGLE_LIST };
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(topology);
    let viewports = [vk::Viewport { width: width as f32, height: height as f32, max_depth: 1.0, ..Default::default() }];
    let scissors = [vk::Rect2D { extent: vk::Extent2D { width, height }, ..Default::default() }];
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewports(&viewports).scissors(&scissors);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().polygon_mode(vk::PolygonMode::FILL).line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let (blended, tested) = (kind == Kind::Blended, kind != Kind::Blended);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default().depth_test_enable(tested).depth_write_enable(tested);
    let depth = depth.depth_compare_op(vk::CompareOp::LESS_OR_EQUAL);
    let (one, rest) = (vk::BlendFactor::ONE, vk::BlendFactor::ONE_MINUS_SRC_ALPHA);
    let blend = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA).blend_enable(blended);
    let blend = [blend.src_color_blend_factor(one).dst_color_blend_factor(rest).src_alpha_blend_factor(one).dst_alpha_blend_factor(rest)];
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
        .layout(pass.layout)
        .render_pass(pass.pass);
    // SAFETY: all structs outlive the call; the modules are needed only until then.
    unsafe {
        let made = host.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
        modules.into_iter().for_each(|m| host.device.destroy_shader_module(m, None));
        Ok(made.map_err(|(_, e)| e)?[0])
    }
}
