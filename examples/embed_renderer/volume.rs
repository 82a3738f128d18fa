//! The half of the body that is cut away, drawn by olbvh as a volume among the surfaces that the host has drawn.

use crate::body::Body;
use crate::host::{Host, HostBuffer, storage_set};
use anyhow::Result;
use ash::vk;
use glam::Mat4;
use gpu_allocator::MemoryLocation;
use olbvh::build::{cmd_ranges, range_bytes};
use olbvh::gpu::{Arena, BufferRef, Gpu, Recorder};
use olbvh::mesh::{Bounds, On};
use olbvh::query::{RenderInput, RenderMemory, Rounds, Visibility, cmd_render};
use olbvh::render::{PicturePlan, ProjectedView, RenderSettings, TransferFunction};

/// What each frame in flight has of its own.
struct Frame {
    /// A copy of the depth attachment.
    depth: HostBuffer,
    memory: HostBuffer,
    picture: RenderMemory,
    /// The range of the field's values in every node of the tree.
    ranges: BufferRef,
    /// For the shader that blends the colours.
    set: vk::DescriptorSet,
}

pub struct Volume {
    plan: PicturePlan,
    view: HostBuffer,
    table: HostBuffer,
    visible: HostBuffer,
    frames: Vec<Frame>,
    pool: vk::DescriptorPool,
    pub set_layout: vk::DescriptorSetLayout,
}

impl Volume {
    /// Prepares pictures that are seen like those of the renderer: `camera` is its matrix to clip space.
    pub fn new(host: &Host, gpu: &Gpu, body: &Body, size: [u32; 2], camera: Mat4) -> Result<Self> {
        // Cold values are nearly transparent, and hot ones show.
        let transfer = TransferFunction::named("coolwarm")?.with_opacity(vec![(0.0, 0.02), (0.3, 0.03), (1.0, 0.3)])?;
        let settings = RenderSettings { size, transfer, range: Some([0.0, 1.0]), shading: false, ..RenderSettings::default() };
        // A box that holds the body in every frame, see `Body::deform`.
        let reach = 1.2 * body.radius;
        let bounds = Bounds { lo: (body.centre - reach).to_array(), hi: (body.centre + reach).to_array() };
        let view = ProjectedView { to_clip: camera.as_dmat4(), reversed: false };
        let plan = PicturePlan::with_projected(&settings, &view, &bounds, body.origin(), None)?;

        let usage = gpu.usage();
        let view = host.filled("view", &[plan.view()], usage)?;
        let table = host.filled("table", &plan.table, usage)?;
        let visible = host.filled("visible values", &plan.visible_values, usage)?;
        let (pool, set_layout) = host.storage_sets(1, body.slots.len())?;
        let frame = |slot: usize| {
            let tree = body.scene(slot).tree;
            let carve =
                |a: &mut Arena| Ok((RenderMemory::carve(a, size, Some(&tree.capacity))?, a.take(range_bytes(tree.capacity.nodes))?));
            let depth = host.buffer("depths", 4 * u64::from(size[0] * size[1]), usage, MemoryLocation::GpuOnly)?;
            let memory = host.buffer("volume", Arena::measure(carve)?, usage, MemoryLocation::GpuOnly)?;
            let (picture, ranges) = carve(&mut Arena::new(memory.part()))?;
            let set = storage_set(host, pool, set_layout, &[picture.colors])?;
            Ok(Frame { depth, memory, picture, ranges, set })
        };
        let frames = (0..body.slots.len()).map(frame).collect::<Result<_>>()?;
        Ok(Self { plan, view, table, visible, frames, pool, set_layout })
    }

    /// Where a slot's depth attachment is copied to, and the set with its colours.
    pub fn slot(&self, slot: usize) -> (&HostBuffer, vk::DescriptorSet) {
        (&self.frames[slot].depth, self.frames[slot].set)
    }

    /// Records the picture of a slot, whose tree and depths must be visible to compute shaders, and the tree to transfers.
    pub fn record(&self, r: &mut Recorder<'_>, body: &Body, slot: usize) -> olbvh::Result<()> {
        let (scene, Frame { depth, picture, ranges, .. }) = (body.scene(slot), &self.frames[slot]);
        let field = (body.values.part(), On::Points);
        cmd_ranges(r, &scene.mesh, &scene.tree, field, *ranges)?;
        let values = self.visible.part();
        let visibility = Some(Visibility { ranges: *ranges, values, count: self.plan.visible_values.len() as u32 });
        let whole = RenderInput::of(&self.plan, self.view.part(), self.table.part(), field);
        cmd_render(r, &scene, &RenderInput { depth: Some(depth.part()), visibility, ..whole }, picture, Rounds::begin(2))
    }

    pub fn free(self, host: &Host) {
        host.free_sets(self.pool, self.set_layout);
        self.frames.into_iter().flat_map(|frame| [frame.depth, frame.memory]).for_each(|b| host.free(b));
        [self.view, self.table, self.visible].into_iter().for_each(|b| host.free(b));
    }
}
