//! The body: a mesh that wgpu moves, the arrays of olbvh for it, and the pixels of a cut through it.

use anyhow::{Context, Result};
use olbvh::build::{PlacedScene, ScenePlan};
use olbvh::gpu::{Buffer, Gpu, Recorder};
use olbvh::mesh::{Mesh, On};
use olbvh::query::{LocateOptions, LocateOutput, PointInput, Scene, cmd_interpolate, cmd_locate};

/// The size of the picture. Its rows are multiples of 256 bytes, as wgpu copies them.
pub const SIZE: [u32; 2] = [320, 240];

pub struct Body {
    pub positions: Buffer,
    pub owners: Buffer,
    pub values: Buffer,
    /// The points of the pixels, row by row.
    pub places: Vec<[f32; 3]>,
    /// One value per point, from 0 to 1.
    pub field: Vec<f32>,
    pub centre: [f32; 3],
    pub radius: f32,
    scene: PlacedScene,
    input: PointInput,
    output: LocateOutput,
    /// Field, cells, places, and memory of olbvh.
    held: [Buffer; 6],
}

impl Body {
    pub fn new(gpu: &Gpu, mesh: &Mesh) -> Result<Self> {
        let field = mesh.fields.first().context("the mesh has no field")?;
        let [least, most] = field.range().context("no finite value")?;
        let field: Vec<f32> = field.values.iter().map(|v| (v - least) / (most - least)).collect();
        let end = |axis: usize, pick: fn(f32, f32) -> f32| mesh.points.iter().map(|p| p[axis]).reduce(pick).unwrap_or_default();
        let (lo, hi) = ([0, 1, 2].map(|c| end(c, f32::min)), [0, 1, 2].map(|c| end(c, f32::max)));
        let centre = [0, 1, 2].map(|c| 0.5 * (lo[c] + hi[c]));
        let radius = [0, 1, 2].map(|c| 0.5 * (hi[c] - lo[c])).iter().map(|h| h * h).sum::<f32>().sqrt();
        let step = 2.0 * radius / SIZE[0] as f32;
        let along = |i: u32, n: u32| (i as f32 + 0.5 - 0.5 * n as f32) * step;
        let places: Vec<[f32; 3]> = (0..SIZE[0] * SIZE[1])
            .map(|i| [centre[0] + along(i % SIZE[0], SIZE[0]), centre[1], centre[2] - along(i / SIZE[0], SIZE[1])])
            .collect();

        let (points, tets, pixels) = (mesh.points.len() as u32, mesh.tets.len() as u32, u64::from(SIZE[0] * SIZE[1]));
        let buffer = |name: &str, bytes: u64| gpu.buffer(&format!("wgpu_frame.{name}"), bytes);
        let [positions, owners, values] = [("positions", 12 * u64::from(points)), ("owners", 4 * pixels), ("values", 4 * pixels)]
            .map(|(name, bytes)| buffer(name, bytes));
        let (positions, owners, values) = (positions?, owners?, values?);
        let cells = gpu.upload("wgpu_frame.cells", &mesh.tets)?;
        let asked = gpu.upload("wgpu_frame.places", &places)?;
        let on_device = gpu.upload("wgpu_frame.field", &field)?;

        // Sizes come first: those that most trees need. If the tree of the moved body needs more, the device builds a
        // coarser one.
        let plan = ScenePlan::usual(points, tets, 7);
        let bytes = plan.bytes(gpu)?;
        let (memory, scratch) = (buffer("memory", bytes.memory)?, buffer("scratch", bytes.scratch)?);
        let scene = plan.place(gpu, positions.all(), cells.all(), memory.all(), scratch.all())?;
        let barycentrics = buffer("barycentrics", 16 * pixels)?;
        let input = PointInput { points: asked.all(), stride: 3, count: pixels as u32, hints: None, order: None };
        let output = LocateOutput { owners: owners.all(), barycentrics: barycentrics.all() };
        let held = [on_device, cells, asked, memory, scratch, barycentrics];
        Ok(Self { positions, owners, values, places, field, centre, radius, scene, input, output, held })
    }

    /// Records the work of olbvh in a frame. It reads the positions and writes owners and values, all in compute
    /// shaders. Which tetrahedra are neighbours is found out in the first frame only.
    pub fn record(&self, r: &mut Recorder<'_>, first: bool) -> olbvh::Result<()> {
        let Self { scene, input, output, .. } = self;
        // The frame before used the same memory.
        r.barrier("frame.before → frame.mesh");
        if first {
            scene.cmd_build(r)?
        } else {
            scene.cmd_rebuild(r)?
        }
        let scene = Scene::recorded(scene.mesh, scene.tree);
        cmd_locate(r, &scene, input, output, &LocateOptions::default())?;
        r.barrier("frame.owners → frame.values");
        cmd_interpolate(r, &scene, (self.held[0].all(), On::Points), 1, output, (self.values.all(), input.count))
    }
}
