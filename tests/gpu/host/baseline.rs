//! Construction of the baselines and location in them, recorded.

use olbvh::baseline::BinaryTree;
use olbvh::baseline::{LbvhScratch, RayMethod, Rays, cmd_build_lbvh, cmd_locate_lbvh};
use olbvh::build::{BadCells, DeviceMesh};
use olbvh::gpu::{Arena, Buffer, BufferRef, Gpu, Recorder};
use olbvh::mesh::Mesh;
use olbvh::query::{LocateOutput, PointInput, Rounds};

/// The memory of both baselines over a mesh, whose points are located.
pub struct Baseline {
    pub output: LocateOutput,
    pub unfinished: BufferRef,
    mesh: DeviceMesh,
    points: Buffer,
    tree: BinaryTree,
    scratch: LbvhScratch,
    /// One per method by which the device traces rays.
    rays: Vec<Rays>,
    _memory: Buffer,
}

impl Baseline {
    pub fn new(gpu: &Gpu, mesh: &Mesh) -> Self {
        let points = gpu.upload("olbvh.test.points", &mesh.points).unwrap();
        let (asked, mesh) = (mesh.points.len() as u64, DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap());
        let tets = mesh.input().tets;
        let carve = |a: &mut Arena| {
            let output = LocateOutput { owners: a.words(asked)?, barycentrics: a.words(4 * asked)? };
            Ok((BinaryTree::carve(a, tets)?, LbvhScratch::carve(gpu, a, tets)?, output, a.words(1)?))
        };
        let (memory, (tree, scratch, output, unfinished)) = Arena::reserve(gpu, "olbvh.test.lbvh", carve).unwrap();
        let rays = RayMethod::EVERY.into_iter().filter_map(|method| Rays::build(gpu, &mesh, method).unwrap()).collect();
        Self { output, unfinished, mesh, points, tree, scratch, rays, _memory: memory }
    }

    /// The number of methods of tracing rays that are recorded.
    pub fn ray_methods(&self) -> usize {
        self.rays.len()
    }

    pub fn record_lbvh(&self, r: &mut Recorder<'_>) -> olbvh::Result<()> {
        let view = self.mesh.view();
        cmd_build_lbvh(r, &view, &self.tree, &self.scratch)?;
        let asked = (self.points.all(), self.mesh.input().points);
        cmd_locate_lbvh(r, (&view, &self.tree), asked, &self.output, self.unfinished, 0.0, Rounds::begin(2))
    }

    pub fn record_rays(&self, r: &mut Recorder<'_>) -> olbvh::Result<()> {
        let input = PointInput { points: self.points.all(), stride: 3, count: self.mesh.input().points, hints: None, order: None };
        for rays in &self.rays {
            r.barrier("located → rays.locate");
            rays.cmd_locate(r, &input, &self.output)?;
        }
        Ok(())
    }
}
