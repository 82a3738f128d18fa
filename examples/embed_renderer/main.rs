//! A renderer with its own Vulkan device embeds olbvh. A body is deformed every frame, its tree is rebuilt in the
//! renderer's command buffer and memory. The far half of the body is drawn by the renderer: a fragment shader asks the tree
//! for the field in the cut. The near half is drawn by olbvh, as a volume in front of what the renderer has drawn. Nothing
//! is read back but the pictures.
//!
//! ```text
//! cargo run --release --example embed_renderer -- [FRAMES] [OUT.png] [--descriptors]
//! ```

#![allow(unsafe_code, reason = "a Vulkan program")]
#![allow(clippy::unwrap_used, missing_docs, reason = "an example: what cannot go on may stop")]

mod body;
mod host;
mod pictures;
mod volume;

use anyhow::{Context, Result};
use ash::vk;
use body::{Body, Deformed};
use glam::camera::rh::proj::vulkan;
use glam::camera::rh::view::look_at_mat4;
use glam::{Mat4, Vec3};
use host::Host;
use olbvh::gpu::{EnabledFeatures, Gpu, GpuOptions, HostDevice, Recorder};
use pictures::{Drawing, Pictures, Push};
use std::io::BufWriter;
use std::time::Instant;
use volume::Volume;

const SIZE: [u32; 2] = [480, 360];
/// The number of frames in flight, each of which has its own positions and tree.
const SLOTS: usize = 2;

fn main() -> Result<()> {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let descriptors = words.iter().position(|w| w == "--descriptors").map(|i| words.remove(i)).is_some();
    let frames: u32 = words.first().map_or(Ok(60), |w| w.parse()).context("FRAMES is a number")?;
    let out = words.get(1).map_or("embed_renderer.png", String::as_str);

    let host = Host::new(!descriptors)?;
    let lent = HostDevice {
        instance: host.instance.clone(),
        physical: host.physical,
        device: host.device.clone(),
        family: host.family,
        queue: None,
        allocator: Some(host.allocator().clone()),
        pipeline_cache: None,
        enabled: EnabledFeatures {
            buffer_addresses: host.addresses,
            shader_int64: host.int64,
            subgroup_size_control: host.size_control,
            debug_utils: host.debug.is_some(),
            ..EnabledFeatures::default()
        },
    };
    // SAFETY: the handles belong together, and `gpu` is dropped before `host`, while the device is idle.
    let gpu = unsafe { Gpu::from_raw(lent, &GpuOptions::default()) }?;
    let mut body = Body::load(&host, &gpu, SLOTS)?;
    let volume = Volume::new(&host, &gpu, &body, SIZE, camera(&body))?;
    let pictures = Pictures::new(&host, SIZE, SLOTS, (body.set_layout(), volume.set_layout))?;
    let mut flight = Flight::new(&host)?;
    let result = animate(&host, &gpu, &mut body, (&pictures, &volume), &mut flight, frames, out);
    // SAFETY: this waits for what is still in flight, also after an error.
    let idle = unsafe { host.device.device_wait_idle() };
    flight.free(&host);
    pictures.free(&host);
    volume.free(&host);
    body.free(&host);
    result?;
    idle?;
    drop(gpu);
    host.check()
}

/// What the frames in flight are recorded with. It is freed once the device is idle.
struct Flight<'a> {
    pool: vk::CommandPool,
    commands: Vec<vk::CommandBuffer>,
    fences: Vec<vk::Fence>,
    /// The recorders of frames that are being executed, which own the descriptor sets, if there are any.
    recorders: Vec<Vec<Recorder<'a>>>,
}

impl Flight<'_> {
    fn new(host: &Host) -> Result<Self> {
        let device = &host.device;
        // SAFETY: objects are created as Vulkan asks for; `free` destroys each of them once.
        unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(host.family);
            let pool = device.create_command_pool(&info.flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER), None)?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(SLOTS as u32);
            let commands = device.allocate_command_buffers(&info)?;
            let fences = (0..SLOTS).map(|_| device.create_fence(&vk::FenceCreateInfo::default(), None)).collect::<Result<_, _>>()?;
            Ok(Self { pool, commands, fences, recorders: (0..SLOTS).map(|_| Vec::new()).collect() })
        }
    }

    fn free(self, host: &Host) {
        // SAFETY: the device is idle.
        unsafe {
            self.fences.into_iter().for_each(|f| host.device.destroy_fence(f, None));
            host.device.destroy_command_pool(self.pool, None);
        }
    }
}

/// The matrix from the body's coordinates to clip space.
fn camera(body: &Body) -> Mat4 {
    let (centre, radius) = (body.centre, body.radius);
    let eye = centre + radius * Vec3::new(1.8, -2.6, 1.7);
    let lens = vulkan::perspective(0.6, SIZE[0] as f32 / SIZE[1] as f32, 0.1 * radius, 10.0 * radius);
    lens * look_at_mat4(eye, centre, Vec3::Z)
}

/// The camera, the plane of the cut, and the square that is drawn in it.
fn view(body: &Body, tree: [u32; 2]) -> Push {
    let (centre, radius) = (body.centre, body.radius);
    let normal = Vec3::new(0.0, 1.0, 0.0);
    let right = Vec3::new(3.0 * radius, 0.0, 0.0);
    let corner = centre - 0.5 * right - 0.5 * normal.cross(right);
    Push {
        camera: camera(body).to_cols_array_2d(),
        plane: normal.extend(-normal.dot(centre)).to_array(),
        corner: corner.extend(0.0).to_array(),
        right: right.extend(0.0).to_array(),
        tree,
    }
}

fn animate<'a>(
    host: &Host,
    gpu: &'a Gpu,
    body: &mut Body,
    (pictures, volume): (&Pictures, &Volume),
    flight: &mut Flight<'a>,
    frames: u32,
    out: &str,
) -> Result<()> {
    let device = &host.device;
    let Flight { commands, fences, recorders, .. } = flight;
    let file = BufWriter::new(std::fs::File::create(out).with_context(|| out.to_owned())?);
    let mut encoder = png::Encoder::new(file, SIZE[0], SIZE[1]);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_animated(frames.max(1), 0)?;
    encoder.set_frame_delay(1, 20)?;
    let mut writer = encoder.write_header()?;

    // The recording of a slot's first and later frames is rehearsed, so that nothing is compiled later.
    let mut rehearsal = Recorder::rehearse(gpu);
    body.record(&mut rehearsal, 0, true)?;
    body.record(&mut rehearsal, 0, false)?;
    volume.record(&mut rehearsal, body, 0)?;
    rehearsal.finish()?;

    // SAFETY: what a slot uses is kept until the device is idle, and used again only after the slot's fence is
    // signalled.
    unsafe {
        let start = Instant::now();
        for frame in 0..frames + SLOTS as u32 {
            let slot = frame as usize % SLOTS;
            if frame >= SLOTS as u32 {
                device.wait_for_fences(&[fences[slot]], true, u64::MAX)?;
                device.reset_fences(&[fences[slot]])?;
                recorders[slot].clear();
                writer.write_image_data(pictures.readback[slot].bytes())?;
            }
            if frame >= frames {
                continue;
            }
            body.deform(slot, frame as f32 / frames as f32);
            let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            device.begin_command_buffer(commands[slot], &begin)?;
            let mut recorder = Recorder::new(gpu, commands[slot], None);
            body.record(&mut recorder, slot, frame < SLOTS as u32)?;
            recorder.finish()?;
            recorders[slot].push(recorder);
            let computed = vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::TRANSFER;
            let written = vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::TRANSFER_WRITE;
            let read = vk::AccessFlags::SHADER_READ | vk::AccessFlags::TRANSFER_READ;
            host.barrier(commands[slot], (computed, computed | vk::PipelineStageFlags::FRAGMENT_SHADER), (written, read));
            let Deformed { positions, tree, set, .. } = &body.slots[slot];
            let (values, triangles, indices) = (&body.values, &body.triangles, body.indices);
            let push = view(body, [tree.address as u32, (tree.address >> 32) as u32]);
            let (depths, colors) = volume.slot(slot);
            let drawing = Drawing { positions, values, triangles, indices, tree_set: *set, push };
            pictures.record_surfaces(host, commands[slot], slot, &drawing, depths);
            let mut recorder = Recorder::new(gpu, commands[slot], None);
            volume.record(&mut recorder, body, slot)?;
            recorder.finish()?;
            recorders[slot].push(recorder);
            host.barrier(commands[slot], (computed, vk::PipelineStageFlags::FRAGMENT_SHADER), (written, vk::AccessFlags::SHADER_READ));
            pictures.record_volume(host, commands[slot], slot, colors);
            device.end_command_buffer(commands[slot])?;
            let submit = [vk::SubmitInfo::default().command_buffers(std::slice::from_ref(&commands[slot]))];
            device.queue_submit(*host.queue.lock().unwrap(), &submit, fences[slot])?;
        }
        println!("{frames} frames of {} tetrahedra in {:.1} s, tree rebuilt in each: {out}", body.tets, start.elapsed().as_secs_f64());
    }
    Ok(writer.finish()?)
}
