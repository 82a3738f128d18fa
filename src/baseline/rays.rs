//! Point location by ray tracing hardware (or the driver's ray tracing), on devices that support it: an acceleration
//! structure over the faces of a mesh, with the tetrahedra on either side of each, and a short ray per point (Wald et
//! al. 2019), traced by ray queries or a ray-tracing pipeline.
//!
//! It is **not watertight**: the device's intersections are rounded, so a ray may slip past an edge, or hit a face that
//! is not the first. Every answer is verified to contain its point; a point whose ray went wrong is lost. A point on a
//! face gets any of the tetrahedra at that face.

use crate::build::{DeviceMesh, KeptMesh, MeshArrays, MeshInput, MeshView};
use crate::error::Result;
use crate::gpu::{AccelerationStructure, Arena, Buffer, BufferRef, Gpu, Groups, RayPipeline, Recorder, Triangles};
use crate::kernels::{FaceHit, FaceMissed, ListFaces, ListFacesSpec, LocateByPipeline, LocateByQuery, LocateByQuerySpec};
use crate::layout::constants::locate_by_ray::SCALE;
use crate::named::named;
use crate::primitives::{Count, ScanScratch, cmd_exclusive_scan};
use crate::query::{LocateOutput, Located, PointInput, numbered};
use crate::times::StageTimes;

/// The way in which rays are traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayMethod {
    /// Ray queries in a compute shader, `VK_KHR_ray_query`.
    Query,
    /// A ray-tracing pipeline, `VK_KHR_ray_tracing_pipeline`.
    Pipeline,
}

named!(RayMethod, "way to trace rays", [Query = "ray query", Pipeline = "ray pipeline"]);

impl RayMethod {
    /// Whether the device supports the method.
    pub fn of(self, gpu: &Gpu) -> bool {
        let ways = gpu.report().requirements.ray_tracing;
        if self == Self::Query { ways.queries } else { ways.pipelines }
    }
}

/// An acceleration structure over the faces of a mesh.
#[derive(Debug)]
pub struct Rays {
    gpu: Gpu,
    /// `None`: ray queries.
    pipeline: Option<Box<RayPipeline>>,
    mesh: KeptMesh,
    structure: AccelerationStructure,
    faces: u32,
    sides: Buffer,
    longest: BufferRef,
    times: StageTimes,
    _memory: Buffer,
}

impl Rays {
    /// Lists the faces and builds the structure over them. `None` if the device does not support the method.
    ///
    /// # Errors
    /// [`crate::Error::Memory`], [`crate::Error::TooLarge`] for more faces than the device's structures hold, or a
    /// failed Vulkan call.
    pub fn build(gpu: &Gpu, mesh: &DeviceMesh, method: RayMethod) -> Result<Option<Self>> {
        mesh.check_device(gpu)?;
        if !method.of(gpu) {
            return Ok(None);
        }
        let (input, arrays) = (mesh.input(), mesh.arrays());
        let MeshInput { cells, tets, points, .. } = *input;
        let vertices = arrays.vertices;
        let carve = |a: &mut Arena| Ok((a.words(u64::from(tets))?, a.words(1)?, ScanScratch::carve(gpu, a, tets)?));
        let (counts, (places, total, scan)) = Arena::reserve(gpu, "olbvh.rays.counts", carve)?;
        let memory = gpu.buffer("olbvh.rays.longest", 4)?;
        let longest = memory.all();
        let list = |r: &mut Recorder<'_>, fill: u32, indices: BufferRef, sides: BufferRef| {
            let workgroup = gpu.target().each;
            let (bad, neighbours) = (arrays.bad, arrays.neighbours);
            let arguments = ListFaces { vertices, cells, bad, neighbours, places, indices, sides, longest, tets };
            let spec = ListFacesSpec { workgroup, fill, ..Default::default() };
            r.stage("rays.faces", |r| r.dispatch(&arguments, spec, Groups::Count(tets.div_ceil(workgroup))))
        };
        let ((), mut times) = gpu.submit("olbvh.rays.count", |r| {
            r.fill(longest, 0);
            r.barrier("clear → rays.faces");
            list(r, 0, gpu.nothing(), gpu.nothing())?;
            cmd_exclusive_scan(r, places, places, total, Count::host(tets), &scan)
        })?;
        let faces: u32 = gpu.download_one(&counts, total)?;
        let indices = gpu.buffer("olbvh.rays.indices", 12 * u64::from(faces))?;
        let sides = gpu.buffer("olbvh.rays.sides", 8 * u64::from(faces))?;
        let ((), time) = gpu.submit("olbvh.rays.list", |r| list(r, 1, indices.all(), sides.all()))?;
        times.add(time);
        let triangles = Triangles { vertices, points, indices: indices.all(), count: faces, scale: SCALE };
        let structure = AccelerationStructure::build(gpu, &triangles)?;
        times.add(structure.times().clone());
        let pipeline = match method {
            RayMethod::Query => None,
            RayMethod::Pipeline => Some(Box::new(RayPipeline::new::<LocateByPipeline, FaceMissed, FaceHit>(gpu)?)),
        };
        Ok(Some(Self { gpu: gpu.clone(), mesh: mesh.kept(), pipeline, structure, faces, sides, longest, times, _memory: memory }))
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

    /// What the build took.
    pub fn times(&self) -> &StageTimes {
        &self.times
    }

    /// Records point location in the mesh of the structure, without hints. The result is a tetrahedron that contains the
    /// point, or `u32::MAX` if the point is outside or lost. Reads mesh and points in compute shaders, and writes `output`
    /// in compute shaders, without a barrier before or after. A ray-tracing pipeline adds a barrier before, from compute
    /// shaders and transfers, and one after, to these and the host.
    ///
    /// # Errors
    /// [`crate::Error::Vulkan`] if the pipeline cannot be made, [`crate::Error::TooLarge`] for more points than a
    /// ray-tracing pipeline can launch rays, and those of [`crate::query::cmd_locate`].
    pub fn cmd_locate(&self, r: &mut Recorder<'_>, input: &PointInput, output: &LocateOutput) -> Result<()> {
        input.check()?;
        output.check(input.count)?;
        let MeshView { input: MeshInput { cells, .. }, arrays: MeshArrays { grid, vertices, .. } } = self.mesh.view;
        let (sides, longest, scene) = (self.sides.all(), self.longest, self.structure.address());
        let PointInput { points, stride, count, .. } = *input;
        let LocateOutput { owners, barycentrics } = *output;
        r.stage("rays.locate", |r| {
            if let Some(pipeline) = &self.pipeline {
                let arguments =
                    LocateByPipeline { grid, sides, longest, cells, vertices, points, owners, barycentrics, scene, count, stride };
                return pipeline.record(r, &arguments, count);
            }
            let workgroup = r.gpu().target().query;
            let arguments = LocateByQuery { grid, sides, longest, cells, vertices, points, owners, barycentrics, scene, count, stride };
            let spec = LocateByQuerySpec { workgroup, ..Default::default() };
            r.dispatch(&arguments, spec, Groups::Count(count.div_ceil(workgroup)))
        })
    }

    /// Locates points (relative to the mesh's origin). The result is a tetrahedron that contains each point, or
    /// `u32::MAX` if it is outside or lost.
    ///
    /// # Errors
    /// [`crate::Error::Memory`], or a failed Vulkan call.
    pub fn locate(&self, points: &[[f32; 3]]) -> Result<Located> {
        let (n, count) = (points.len() as u64, numbered(points.len())?);
        let uploaded = self.gpu.upload("olbvh.rays.points", points)?;
        let carve = |a: &mut Arena| Ok((a.words(n)?, a.take(16 * n)?));
        let (memory, (owners, barycentrics)) = Arena::reserve(&self.gpu, "olbvh.rays.located", carve)?;
        let input = PointInput { points: uploaded.all(), stride: 3, count, hints: None, order: None };
        let output = LocateOutput { owners, barycentrics };
        let ((), times) = self.gpu.submit("olbvh.rays.locate", |r| self.cmd_locate(r, &input, &output))?;
        Ok(Located {
            owners: self.gpu.download(&memory, owners.part(0, 4 * n))?,
            barycentrics: self.gpu.download(&memory, barycentrics.part(0, 16 * n))?,
            times,
            ..Located::default()
        })
    }
}
