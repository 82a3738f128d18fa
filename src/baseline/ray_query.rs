//! Point location by ray tracing hardware (or the driver's own tracing), where the device has `VK_KHR_ray_query`: an acceleration structure over
//! the faces of a mesh, each with the tetrahedra on either side, and a short ray per point (Wald et al. 2019).
//!
//! It is **not watertight**: the device's intersections are rounded, so a ray may slip past an edge, or meet a face that is not the first. Every
//! answer is verified and does hold its point; a point whose ray went wrong is lost. Points on faces get any of their cells.

use crate::build::{DeviceMesh, MeshInput};
use crate::error::Result;
use crate::gpu::{AccelerationStructure, Buffer, BufferRef, Gpu, Groups, Recorder, StageTime, Triangles};
use crate::kernels::{ListFaces, ListFacesSpec, LocateByRay, LocateByRaySpec};
use crate::primitives::{Arena, Count, ScanScratch, cmd_exclusive_scan};
use crate::query::{LocateOutput, Located, PointInput};

/// From normalised coordinates to those of the scene, [0, 2): safe for whatever the device multiplies.
const SCALE: f32 = f32::from_bits((127 - 40) << 23);

/// An acceleration structure over the faces of a mesh.
#[derive(Debug)]
pub struct RayQuery {
    gpu: Gpu,
    structure: AccelerationStructure,
    faces: u32,
    sides: Buffer,
    longest: BufferRef,
    stages: Vec<StageTime>,
    _memory: Buffer,
}

impl RayQuery {
    /// Lists the faces and builds the structure over them. `None` where the device has no ray queries.
    ///
    /// # Errors
    /// [`crate::Error::Memory`], [`crate::Error::TooLarge`] for more faces than the device's structures hold, or a failed Vulkan call.
    pub fn build(gpu: &Gpu, mesh: &DeviceMesh) -> Result<Option<Self>> {
        if !gpu.report().requirements.ray_query() {
            return Ok(None);
        }
        let (input, arrays) = (mesh.input(), mesh.arrays());
        let MeshInput { cells, tets, points, .. } = *input;
        let vertices = arrays.vertices;
        let carve = |a: &mut Arena| Ok((a.words(u64::from(tets))?, a.words(1)?, ScanScratch::carve(gpu, a, tets)?));
        let counts = gpu.buffer("olbvh.ray_query.counts", Arena::measure(carve)?)?;
        let (places, total, scan) = carve(&mut Arena::new(counts.all()))?;
        let memory = gpu.buffer("olbvh.ray_query.longest", 4)?;
        let longest = memory.all();
        let list = |r: &mut Recorder<'_>, fill: u32, indices: BufferRef, sides: BufferRef| {
            let workgroup = gpu.target().each;
            let (bad, neighbours) = (arrays.bad, arrays.neighbours);
            let arguments = ListFaces { vertices, cells, bad, neighbours, places, indices, sides, longest, tets };
            let spec = ListFacesSpec { workgroup, fill, ..Default::default() };
            r.stage("ray_query.faces", |r| r.dispatch(&arguments, spec, Groups::Count(tets.div_ceil(workgroup))))
        };
        let ((), time) = gpu.run("olbvh.ray_query.count", |r| {
            r.fill(longest, 0);
            r.barrier("clear → ray_query.faces");
            list(r, 0, gpu.nothing(), gpu.nothing())?;
            cmd_exclusive_scan(r, places, places, total, Count::host(tets), &scan)
        })?;
        let mut stages = time.stages;
        let faces = gpu.download::<u32>(&counts, total.part(0, 4))?.first().copied().unwrap_or(0);
        let indices = gpu.buffer("olbvh.ray_query.indices", 12 * u64::from(faces))?;
        let sides = gpu.buffer("olbvh.ray_query.sides", 8 * u64::from(faces))?;
        let ((), time) = gpu.run("olbvh.ray_query.list", |r| list(r, 1, indices.all(), sides.all()))?;
        stages.extend(time.stages);
        let triangles = Triangles { vertices, points, indices: indices.all(), count: faces, scale: SCALE };
        let structure = AccelerationStructure::build(gpu, &triangles)?;
        stages.extend_from_slice(structure.stages());
        Ok(Some(Self { gpu: gpu.clone(), structure, faces, sides, longest, stages, _memory: memory }))
    }

    /// The acceleration structure.
    pub fn structure(&self) -> &AccelerationStructure {
        &self.structure
    }

    /// Number of faces.
    pub fn faces(&self) -> u32 {
        self.faces
    }

    /// Bytes of the compacted structure, its scene, and the two tetrahedra of every face.
    pub fn bytes(&self) -> u64 {
        self.structure.bytes() + self.sides.size()
    }

    /// Device time of every stage, in order.
    pub fn stages(&self) -> &[StageTime] {
        &self.stages
    }

    /// Records point location, without hints: a tetrahedron that holds the point, or all ones if the point is outside or lost. Reads mesh and points
    /// in compute shaders, writes `output` in compute shaders; no barrier before or after.
    ///
    /// # Errors
    /// [`crate::Error::Vulkan`] if the pipeline cannot be made.
    pub fn cmd_locate(&self, r: &mut Recorder<'_>, mesh: &DeviceMesh, input: &PointInput, output: &LocateOutput) -> Result<()> {
        let workgroup = r.gpu().target().query;
        let arguments = LocateByRay {
            grid: mesh.arrays().grid,
            sides: self.sides.all(),
            longest: self.longest,
            cells: mesh.input().cells,
            vertices: mesh.arrays().vertices,
            points: input.points,
            owners: output.owners,
            barycentrics: output.barycentrics,
            scene: self.structure.address(),
            count: input.count,
            stride: input.stride,
        };
        let spec = LocateByRaySpec { workgroup, ..Default::default() };
        r.stage("ray_query.locate", |r| r.dispatch(&arguments, spec, Groups::Count(input.count.div_ceil(workgroup))))
    }

    /// Locates points (relative to the mesh's origin): a tetrahedron that holds each, or all ones if it is outside or lost.
    ///
    /// # Errors
    /// [`crate::Error::Memory`], or a failed Vulkan call.
    pub fn locate(&self, mesh: &DeviceMesh, points: &[[f32; 3]]) -> Result<Located> {
        let n = points.len() as u64;
        let uploaded = self.gpu.upload("olbvh.ray_query.points", points)?;
        let carve = |a: &mut Arena| Ok((a.words(n)?, a.take(16 * n)?));
        let memory = self.gpu.buffer("olbvh.ray_query.located", Arena::measure(carve)?)?;
        let (owners, barycentrics) = carve(&mut Arena::new(memory.all()))?;
        let input = PointInput { points: uploaded.all(), stride: 3, count: points.len() as u32, hints: None };
        let output = LocateOutput { owners, barycentrics };
        let ((), time) = self.gpu.run("olbvh.ray_query.locate", |r| self.cmd_locate(r, mesh, &input, &output))?;
        Ok(Located {
            owners: self.gpu.download(&memory, owners.part(0, 4 * n))?,
            barycentrics: self.gpu.download(&memory, barycentrics.part(0, 16 * n))?,
            stages: time.stages,
            ..Located::default()
        })
    }
}
