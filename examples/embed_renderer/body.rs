//! The body: a mesh in the host's memory, deformed every frame, and the arrays of olbvh for it.

use crate::host::{Host, HostBuffer, storage_set};
use anyhow::{Context, Result};
use ash::vk;
use glam::Vec3;
use gpu_allocator::MemoryLocation;
use olbvh::build::{PlacedScene, ScenePlan};
use olbvh::glsl::SceneBuffers;
use olbvh::gpu::{Gpu, Recorder};
use olbvh::mesh::Mesh;
use olbvh::query::Scene;
use std::path::Path;

/// What each frame in flight has of its own.
pub struct Deformed {
    pub positions: HostBuffer,
    /// The addresses that the shaders receive; see `olbvh.glsl`.
    pub tree: HostBuffer,
    pub set: Option<vk::DescriptorSet>,
    memory: HostBuffer,
    scene: PlacedScene,
}

pub struct Body {
    mesh: Mesh,
    pub tets: u32,
    pub centre: Vec3,
    pub radius: f32,
    pub values: HostBuffer,
    pub triangles: HostBuffer,
    pub indices: u32,
    pub slots: Vec<Deformed>,
    cells: HostBuffer,
    scratch: HostBuffer,
    sets: Option<(vk::DescriptorPool, vk::DescriptorSetLayout)>,
}

/// The faces that belong to only one tetrahedron.
fn surface(tets: &[[u32; 4]]) -> Vec<u32> {
    let mut faces: Vec<([u32; 3], [u32; 3])> = tets
        .iter()
        .flat_map(|t| [[t[1], t[2], t[3]], [t[0], t[3], t[2]], [t[0], t[1], t[3]], [t[0], t[2], t[1]]])
        .map(|face| {
            let mut key = face;
            key.sort_unstable();
            (key, face)
        })
        .collect();
    faces.sort_unstable();
    faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).flat_map(|same| same[0].1).collect()
}

impl Body {
    pub fn load(host: &Host, gpu: &Gpu, slots: usize) -> Result<Self> {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bracket_50k.vtu");
        let mesh = olbvh::formats::load(&file, &olbvh::formats::LoadOptions::default())?.mesh;
        let field = mesh.field("temperature").context("the mesh has no temperature")?;
        let [lo, hi] = field.range().context("no finite temperature")?;
        let values: Vec<f32> = field.values.iter().map(|v| (v - lo) / (hi - lo)).collect();
        let fold = |pick: fn(Vec3, Vec3) -> Vec3| mesh.points.iter().map(|p| Vec3::from(*p)).reduce(pick).unwrap_or_default();
        let (low, high) = (fold(Vec3::min), fold(Vec3::max));
        let (points, tets) = (mesh.points.len() as u32, mesh.tets.len() as u32);

        let usage = gpu.usage();
        let values = host.filled("values", &values, usage | vk::BufferUsageFlags::VERTEX_BUFFER)?;
        let cells = host.filled("cells", &mesh.tets, usage)?;
        let faces = surface(&mesh.tets);
        let triangles = host.filled("triangles", &faces, vk::BufferUsageFlags::INDEX_BUFFER)?;

        // Sizes come first: those that most trees need. If the tree of a deformed body needs more, the device builds a
        // coarser one.
        let plan = ScenePlan::usual(points, tets, 7);
        let bytes = plan.bytes(gpu)?;
        let device_buffer = |name: &str, size| host.buffer(name, size, usage, MemoryLocation::GpuOnly);
        let scratch = device_buffer("scratch", bytes.scratch)?;
        let sets = if host.addresses { None } else { Some(host.storage_sets(SceneBuffers::COUNT, slots)?) };
        let slots = (0..slots).map(|_| {
            let positions = host.filled("positions", &mesh.points, usage | vk::BufferUsageFlags::VERTEX_BUFFER)?;
            let memory = device_buffer("tree", bytes.memory)?;
            let scene = plan.place(gpu, positions.part(), cells.part(), memory.part(), scratch.part())?;
            let buffers = SceneBuffers::new(&scene.mesh, &scene.tree, Some(values.part()))?;
            let tree = host.filled("addresses", &[buffers.addresses()], usage)?;
            let set = sets.map(|(pool, layout)| storage_set(host, pool, layout, &buffers.list(tree.part()))).transpose()?;
            Ok(Deformed { positions, tree, set, memory, scene })
        });
        let slots = slots.collect::<Result<Vec<_>>>()?;
        let (centre, radius) = ((low + high) * 0.5, (high - low).length() * 0.5);
        let indices = faces.len() as u32;
        Ok(Self { mesh, tets, centre, radius, values, triangles, indices, slots, cells, scratch, sets })
    }

    /// What the body's coordinates are relative to, in those of its file.
    pub fn origin(&self) -> [f64; 3] {
        self.mesh.origin
    }

    /// The body and its tree in a slot, for queries.
    pub fn scene(&self, slot: usize) -> Scene {
        let PlacedScene { mesh, tree, .. } = self.slots[slot].scene;
        Scene::recorded(mesh, tree)
    }

    pub fn set_layout(&self) -> Option<vk::DescriptorSetLayout> {
        self.sets.map(|s| s.1)
    }

    /// Twists and sways the body; `time` from 0 to 1 is one period.
    pub fn deform(&mut self, slot: usize, time: f32) {
        let (centre, radius) = (self.centre, self.radius);
        let swing = (time * std::f32::consts::TAU).sin();
        let moved = self.mesh.points.iter().map(|p| {
            let x = Vec3::from(*p) - centre;
            let turn = glam::Quat::from_rotation_z(0.6 * swing * x.z / radius);
            let sway = Vec3::X * 0.12 * radius * swing * (2.5 * x.z / radius).sin();
            (centre + turn * x + sway).to_array()
        });
        let moved: Vec<[f32; 3]> = moved.collect();
        self.slots[slot].positions.write(&moved);
    }

    /// Records the construction of a slot's tree. Which tetrahedra are neighbours is found out in the
    /// slot's first frame only: it stays so, however the body moves.
    pub fn record(&self, r: &mut Recorder<'_>, slot: usize, first: bool) -> olbvh::Result<()> {
        let scene = &self.slots[slot].scene;
        // The frame before used the same scratch memory.
        r.barrier("frame.before → frame.mesh");
        if first { scene.cmd_build(r) } else { scene.cmd_rebuild(r) }
    }

    pub fn free(self, host: &Host) {
        if let Some((pool, layout)) = self.sets {
            host.free_sets(pool, layout);
        }
        for slot in self.slots {
            [slot.positions, slot.tree, slot.memory].into_iter().for_each(|b| host.free(b));
        }
        [self.values, self.triangles, self.cells, self.scratch].into_iter().for_each(|b| host.free(b));
    }
}
