//! A program whose Vulkan device belongs to wgpu builds trees on it. In each frame, wgpu moves the points of a body,
//! olbvh records the construction of its tree and the location of every pixel of a cut into a command buffer of wgpu,
//! and wgpu draws the cut from the results, all in one submission.
//!
//! ```text
//! cargo run --manifest-path examples/wgpu/Cargo.toml --target-dir target/wgpu -- [FRAMES] [OUT.png] [--descriptors]
//! ```

mod body;
mod device;

use anyhow::{Context, Result, ensure};
use body::{Body, SIZE};
use device::{Device, Messages};
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{DescriptorPools, Gpu, Recorder};
use olbvh::mesh::{Mesh, On};
use olbvh::options::BuildOptions;
use olbvh::query::{LocateOptions, SILENT, locate};
use std::io::BufWriter;
use wgpu::hal::api::Vulkan;
use wgpu::util::DeviceExt;

fn main() -> Result<()> {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let descriptors = words.iter().position(|w| w == "--descriptors").map(|i| words.remove(i)).is_some();
    let frames: u32 = words.first().map_or(Ok(12), |w| w.parse()).context("FRAMES is a number")?;
    let out = words.get(1).map_or("wgpu_frame.png", String::as_str);
    Messages::collect()?;
    let host = Device::open(!descriptors)?;
    // SAFETY: `host` outlives everything that is made from `gpu`, and only this thread submits.
    let gpu = unsafe { host.gpu() }?;
    let mesh = olbvh::mesh::graded(20)?;
    draw(&host, &gpu, &mesh, frames, out)?;
    Messages::none()
}

/// A buffer of wgpu that shares a storage buffer of olbvh.
fn share(device: &wgpu::Device, label: &str, buffer: &olbvh::gpu::Buffer) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::STORAGE;
    let descriptor = wgpu::BufferDescriptor { label: Some(label), size: buffer.size(), usage, mapped_at_creation: false };
    // SAFETY: the buffer is a storage buffer of this device, and outlives its use by wgpu, which does not destroy it.
    unsafe {
        let shared = wgpu::hal::vulkan::Buffer::from_raw_externally_owned(buffer.all().buffer(), Box::new(|| ()));
        device.create_buffer_from_hal::<Vulkan>(shared, &descriptor)
    }
}

fn draw(host: &Device, gpu: &Gpu, mesh: &Mesh, frames: u32, out: &str) -> Result<()> {
    let Device { device, queue, .. } = host;
    let body = Body::new(gpu, mesh)?;
    let [positions, owners, values] =
        [("positions", &body.positions), ("owners", &body.owners), ("values", &body.values)].map(|(name, b)| share(device, name, b));
    let rest = bytemuck::cast_slice(&mesh.points);
    let rest = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("rest"),
        contents: rest,
        usage: wgpu::BufferUsages::STORAGE,
    });
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    let uniform = device.create_buffer(&wgpu::BufferDescriptor { label: Some("frame"), size: 32, usage, mapped_at_creation: false });

    // wgpu's pipelines, pictures and bindings.
    let module = device.create_shader_module(wgpu::include_wgsl!("frame.wgsl"));
    let deform = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("deform"),
        layout: None,
        module: &module,
        entry_point: Some("deform"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let show = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("show"),
        layout: None,
        vertex: wgpu::VertexState { module: &module, entry_point: Some("corner"), compilation_options: Default::default(), buffers: &[] },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("colour"),
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let bind = |layout: wgpu::BindGroupLayout, buffers: &[(u32, &wgpu::Buffer)]| {
        let entries: Vec<_> =
            buffers.iter().map(|(binding, b)| wgpu::BindGroupEntry { binding: *binding, resource: b.as_entire_binding() }).collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries })
    };
    let moved = bind(deform.get_bind_group_layout(0), &[(0, &uniform), (1, &rest), (2, &positions)]);
    let found = bind(show.get_bind_group_layout(0), &[(0, &uniform), (3, &owners), (4, &values)]);
    let size = wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 };
    let picture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = picture.create_view(&wgpu::TextureViewDescriptor::default());
    let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
    let bytes = u64::from(4 * SIZE[0] * SIZE[1]);
    let readback = device.create_buffer(&wgpu::BufferDescriptor { label: Some("readback"), size: bytes, usage, mapped_at_creation: false });

    // The recording of the first and of later frames is rehearsed, so that nothing is created later.
    let mut rehearsal = Recorder::rehearse(gpu);
    body.record(&mut rehearsal, true)?;
    body.record(&mut rehearsal, false)?;
    rehearsal.finish()?;
    let mut pools = DescriptorPools::new(gpu);
    pools.reserve(rehearsal.descriptor_room())?;

    let mut encoder = png::Encoder::new(BufWriter::new(std::fs::File::create(out).with_context(|| out.to_owned())?), SIZE[0], SIZE[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_animated(frames.max(1), 0)?;
    encoder.set_frame_delay(1, 20)?;
    let mut writer = encoder.write_header()?;
    for frame in 0..frames.max(1) {
        let swing = (std::f32::consts::TAU * (frame as f32 + 0.25) / frames.max(1) as f32).sin();
        let [x, y, z] = body.centre;
        queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&[x, y, z, body.radius, swing, f32::from_bits(SIZE[0]), 0.0, 0.0]));
        let [mut before, mut ours, mut after] =
            ["before", "olbvh", "after"].map(|l| device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(l) }));

        let mut pass = before.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&deform);
        pass.set_bind_group(0, &moved, &[]);
        pass.dispatch_workgroups((mesh.points.len() as u32).div_ceil(64), 1, 1);
        drop(pass);
        // wgpu must know what olbvh does to the buffers, so that it sets its barriers accordingly.
        let (read, written) = (wgpu::BufferUses::STORAGE_READ_ONLY, wgpu::BufferUses::STORAGE_READ_WRITE);
        let used = [(&positions, read), (&owners, written), (&values, written)];
        before.transition_resources(used.map(|(buffer, state)| wgpu::BufferTransition { buffer, state }).into_iter(), std::iter::empty());

        // SAFETY: the encoder records no commands of wgpu; the pools are reset after the frame is done.
        unsafe {
            ours.as_hal_mut::<Vulkan, _, Result<()>>(|encoder| {
                let commands = encoder.context("no command buffer of Vulkan's")?.raw_handle();
                let mut recorder = Recorder::new(gpu, commands, None).with_pools(&mut pools)?;
                body.record(&mut recorder, frame == 0)?;
                Ok(recorder.finish()?)
            })
        }?;

        let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store };
        let attachment = wgpu::RenderPassColorAttachment { view: &view, depth_slice: None, resolve_target: None, ops };
        let mut pass =
            after.begin_render_pass(&wgpu::RenderPassDescriptor { color_attachments: &[Some(attachment)], ..Default::default() });
        pass.set_pipeline(&show);
        pass.set_bind_group(0, &found, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * SIZE[0]), rows_per_image: None };
        after.copy_texture_to_buffer(picture.as_image_copy(), wgpu::TexelCopyBufferInfo { buffer: &readback, layout }, size);

        queue.submit([before, ours, after].map(wgpu::CommandEncoder::finish));
        readback.map_async(wgpu::MapMode::Read, .., |_| ());
        device.poll(wgpu::PollType::wait_indefinitely())?;
        writer.write_image_data(&readback.get_mapped_range(..)?)?;
        readback.unmap();
        // SAFETY: the frame is done.
        unsafe { pools.reset() }?;
        check(gpu, mesh, &body)?;
    }
    println!("{frames} frames of {} tetrahedra on wgpu's device, {:?}: {out}", mesh.tets.len(), gpu.binding());
    Ok(writer.finish()?)
}

/// Compares the results of the last frame with those of the owning functions, for the points as wgpu moved them.
fn check(gpu: &Gpu, mesh: &Mesh, body: &Body) -> Result<()> {
    let moved: Vec<[f32; 3]> = gpu.download(&body.positions, body.positions.all())?;
    ensure!(moved.len() == mesh.points.len() && moved.iter().zip(&mesh.points).any(|(a, b)| a != b), "nothing has moved");
    let moved = Mesh::new(moved, mesh.tets.clone());
    let device = DeviceMesh::upload(gpu, &moved, BadCells::Skip)?;
    let tree = Tree::build(gpu, &device, &BuildOptions::default())?;
    let expected = locate(&tree, &body.places, Some((&body.field, On::Points)), &LocateOptions::default(), SILENT)?;
    let owners: Vec<u32> = gpu.download(&body.owners, body.owners.all())?;
    let values: Vec<u32> = gpu.download(&body.values, body.values.all())?;
    ensure!(owners == expected.owners, "the recorded frame has other owners than the owning functions");
    ensure!(values.iter().zip(&expected.values).zip(&owners).all(|((v, e), o)| *o == u32::MAX || *v == e.to_bits()), "other values");
    let inside = owners.iter().filter(|o| **o != u32::MAX).count();
    ensure!(inside > owners.len() / 10, "{inside} of {} pixels inside", owners.len());
    Ok(())
}
