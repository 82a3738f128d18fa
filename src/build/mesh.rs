//! Stage 0: a mesh on the device. Finds bad tetrahedra, bounds and grid, normalised vertices, neighbours and boundary
//! bits (SPEC 2.1, 2.3).

use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferRef, Gpu, Groups, Recorder, StageTime};
use crate::kernels::{
    CheckCells, CheckCellsSpec, FindNeighbours, FindNeighboursSpec, MakeGrid, MakeGridSpec, MatchFaces, MatchFacesSpec, NormaliseVertices,
    NormaliseVerticesSpec,
};
use crate::layout::{Grid, MeshStatus};
use crate::mesh::Mesh;
use crate::primitives::{Arena, cmd_fill};
use crate::reference::boundary::{fault_of, set_bits};
use std::sync::Arc;

/// Most tetrahedra of one mesh: a face number must fit 31 bits.
pub const MAX_TETS: u32 = (1 << 29) - 2;
/// Most workgroups of a kernel that ends with a sum over all tetrahedra, as long as none of its invocations takes more
/// than [`SUMMING_ROWS`].
const SUMMING_GROUPS: u32 = 1024;
/// Most tetrahedra of one invocation, whose loops must stay short: some drivers end them after 65,535 passes, inner
/// loops included.
const SUMMING_ROWS: u32 = 512;

/// A mesh in device memory, owned by the caller or by this crate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshInput {
    /// 32-bit floats; point i starts at float `i * stride`.
    pub positions: BufferRef,
    /// Floats from one point to the next, at least 3.
    pub stride: u32,
    /// Number of points.
    pub points: u32,
    /// Four 32-bit vertex indices per tetrahedron, at an address that is a multiple of 16.
    pub cells: BufferRef,
    /// Number of tetrahedra.
    pub tets: u32,
}

/// The results of stage 0 for a mesh: parts of one range of memory, needed as long as trees and queries use the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshArrays {
    /// Counters: [`MeshStatus`].
    pub status: BufferRef,
    /// [`Grid`] at the finest level.
    pub grid: BufferRef,
    /// One bit per tetrahedron: bad, and left out of every tree.
    pub bad: BufferRef,
    /// One bit per tetrahedron: boundary tetrahedron.
    pub boundary: BufferRef,
    /// 16 bytes per point: normalised coordinates and the cell of the finest grid.
    pub vertices: BufferRef,
    /// 16 bytes per tetrahedron: the neighbour across the face opposite to each vertex, or `u32::MAX`.
    pub neighbours: BufferRef,
}

impl MeshArrays {
    /// Takes the arrays of a mesh of this size from an arena.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the arena is too small.
    pub fn carve(arena: &mut Arena, points: u32, tets: u32) -> Result<Self> {
        let bits = u64::from(tets).div_ceil(32);
        Ok(Self {
            status: arena.take(size_of::<MeshStatus>() as u64)?,
            grid: arena.take(size_of::<Grid>() as u64)?,
            bad: arena.words(bits)?,
            boundary: arena.words(bits)?,
            vertices: arena.take(16 * u64::from(points))?,
            neighbours: arena.take(16 * u64::from(tets))?,
        })
    }
}

/// A mesh as recording functions take it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshView {
    /// Points and cells.
    pub input: MeshInput,
    /// The results of stage 0.
    pub arrays: MeshArrays,
}

/// Scratch memory of stage 0: 20 bytes and a bit per tetrahedron, 4 bytes per point.
#[derive(Clone, Copy, Debug)]
pub struct MeshScratch {
    table: BufferRef,
    flat_cells: BufferRef,
    /// Thin corners at every vertex.
    thin: BufferRef,
}

impl MeshScratch {
    /// Takes the scratch memory from an arena. The table of faces is at most 4/5 full even if no two tetrahedra share a
    /// face. Beyond 429 million tetrahedra this holds only if most faces are shared, since the table is limited to 2^31
    /// words: an index is a signed word to shaders.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the arena is too small.
    pub fn carve(arena: &mut Arena, points: u32, tets: u32) -> Result<Self> {
        let tets = u64::from(tets);
        Ok(Self {
            table: arena.words((5 * tets + 16).min(1 << 31))?,
            flat_cells: arena.words(tets.div_ceil(32))?,
            thin: arena.words(u64::from(points))?,
        })
    }
}

/// How many consecutive tetrahedra one workgroup of a kernel that sums over all tetrahedra takes; at least one
/// workgroup's worth.
pub(crate) fn summing_share(tets: u32, workgroup: u32) -> u32 {
    tets.div_ceil(SUMMING_GROUPS).clamp(1, SUMMING_ROWS * workgroup).next_multiple_of(workgroup)
}

/// Rejects more tetrahedra than one mesh may have.
pub(crate) fn check_tets(tets: u32) -> Result<()> {
    if tets > MAX_TETS {
        return Err(Error::TooLarge(format!(
            "{tets} tetrahedra; one mesh holds {MAX_TETS} at most; more are taken in blocks, see `blocks`"
        )));
    }
    Ok(())
}

/// Rejects points that overlap, and more floats than shaders can number: an index is a signed word to them.
pub(crate) fn check_points(what: &str, count: u32, stride: u32) -> Result<()> {
    if stride < 3 {
        return Err(Error::Invalid(format!("{what} {stride} floats apart; a point has three")));
    }
    if u64::from(count) * u64::from(stride) > 1 << 31 {
        return Err(Error::TooLarge(format!("{count} {what} {stride} floats apart; shaders number 2^31 floats at most")));
    }
    Ok(())
}

/// Records stage 0. Reads `input` in compute shaders; writes `arrays` and `scratch` with transfers and compute shaders.
/// The caller makes `input` visible to compute shaders before, and records a barrier after.
///
/// # Errors
/// [`Error::TooLarge`] for more than [`MAX_TETS`] tetrahedra or 2^31 floats of positions; [`Error::Invalid`] for a
/// stride below 3.
pub fn cmd_prepare_mesh(r: &mut Recorder<'_>, input: &MeshInput, arrays: &MeshArrays, scratch: &MeshScratch) -> Result<()> {
    cmd_prepare(r, input, arrays, scratch, None)
}

/// Implements [`cmd_prepare_mesh`]. If `given` is a [`Grid`] over bounds that contain the mesh, that grid is used
/// instead of a new one.
fn cmd_prepare(
    r: &mut Recorder<'_>,
    input: &MeshInput,
    arrays: &MeshArrays,
    scratch: &MeshScratch,
    given: Option<BufferRef>,
) -> Result<()> {
    let MeshInput { positions, stride, points, cells, tets } = *input;
    check_tets(tets)?;
    check_points("positions", points, stride)?;
    let MeshArrays { status, grid, bad, boundary, vertices, neighbours } = *arrays;
    let MeshScratch { table, flat_cells, thin } = *scratch;
    let workgroup = r.gpu().target().each;
    let once = r.gpu().subgroup_size();
    let share = summing_share(tets, workgroup);
    let shares = Groups::Count(tets.div_ceil(share));
    r.stage("mesh.clear", |r| {
        r.fill(status, 0);
        r.fill(bad, 0);
        r.fill(boundary, 0);
        r.fill(flat_cells, 0);
        r.fill(thin, 0);
        cmd_fill(r, table, u32::MAX)?;
        cmd_fill(r, neighbours, 0)
    })?;
    r.barrier("mesh.clear → mesh.check_cells");
    r.stage("mesh.bounds", |r| {
        let spec = CheckCellsSpec { workgroup, ..Default::default() };
        r.dispatch(&CheckCells { positions, cells, bad, status, tets, points, stride, share }, spec, shares)?;
        r.barrier("mesh.check_cells → mesh.make_grid");
        if let Some(given) = given {
            r.copy(given, grid.part(0, given.size));
        } else {
            r.dispatch(&MakeGrid { status, grid, unused: 0 }, MakeGridSpec { workgroup: once, ..Default::default() }, Groups::Count(1))?;
        }
        r.barrier("mesh.make_grid → mesh.normalise_vertices");
        let spec = NormaliseVerticesSpec { workgroup, ..Default::default() };
        let groups = Groups::Count(points.div_ceil(workgroup));
        r.dispatch(&NormaliseVertices { grid, positions, vertices, points, stride }, spec, groups)
    })?;
    r.barrier("mesh.normalise_vertices → mesh.match_faces");
    r.stage("mesh.boundary", |r| {
        let slots = (table.size / 4) as u32;
        let near_slots = (slots / points.max(1)).max(1);
        let spec = MatchFacesSpec { workgroup, ..Default::default() };
        r.dispatch(
            &MatchFaces { vertices, cells, bad, table, mates: neighbours, status, flat_cells, thin, tets, slots, near_slots, share },
            spec,
            shares,
        )?;
        r.barrier("mesh.match_faces → mesh.find_neighbours");
        let spec = FindNeighboursSpec { workgroup, ..Default::default() };
        r.dispatch(&FindNeighbours { bad, flat_cells, neighbours, boundary, status, cells, thin, tets, share }, spec, shares)
    })
}

/// What to do with bad cells (SPEC 2.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BadCells {
    /// Leave them out and count them.
    #[default]
    Skip,
    /// Return an error that names the first few.
    Reject,
}

/// The location of a mesh, and a share in the ownership of its memory. While this exists, no other mesh can occupy that
/// location, so an equal view means the same mesh.
#[derive(Clone, Debug)]
pub(crate) struct KeptMesh {
    pub view: MeshView,
    memory: Arc<MeshMemory>,
}

#[derive(Debug)]
struct MeshMemory {
    _positions: Buffer,
    _cells: Buffer,
    arrays: Buffer,
}

/// A mesh in device memory owned by this crate, prepared for trees and queries. A tree built over it keeps that memory
/// alive, too.
#[derive(Debug)]
pub struct DeviceMesh {
    gpu: Gpu,
    kept: KeptMesh,
    grid: Grid,
    status: MeshStatus,
    stages: Vec<StageTime>,
}

impl DeviceMesh {
    /// Uploads a mesh and prepares it. If the tetrahedra are in no spatial order, [`Mesh::along_curve`] gives an order
    /// that is faster.
    ///
    /// # Errors
    /// [`Error::Memory`], [`Error::TooLarge`], or [`Error::BadCells`] if the policy rejects them.
    pub fn upload(gpu: &Gpu, mesh: &Mesh, policy: BadCells) -> Result<Self> {
        Self::upload_in(gpu, mesh, policy, None)
    }

    /// Uploads a mesh as [`DeviceMesh::upload`] does, optionally into a given grid at the finest level, whose bounds
    /// must contain the mesh. Parts of a mesh that are uploaded into the same grid have the same octree cells and
    /// normalised points.
    ///
    /// # Errors
    /// Those of [`DeviceMesh::upload`].
    pub fn upload_in(gpu: &Gpu, mesh: &Mesh, policy: BadCells, grid: Option<&Grid>) -> Result<Self> {
        let number = |n: usize| u32::try_from(n).map_err(|_| Error::TooLarge(format!("{n} points or tetrahedra; 32 bits number 2^32")));
        let (points, tets) = (number(mesh.points.len())?, number(mesh.tets.len())?);
        let given = grid.map(|grid| gpu.upload("olbvh.mesh.grid", &[*grid])).transpose()?;
        let positions = gpu.upload("olbvh.mesh.positions", &mesh.points)?;
        let cells = gpu.upload("olbvh.mesh.cells", &mesh.tets)?;
        let input = MeshInput { positions: positions.all(), stride: 3, points, cells: cells.all(), tets };
        let carve = |a: &mut Arena| MeshArrays::carve(a, points, tets);
        let (memory, arrays) = Arena::reserve(gpu, "olbvh.mesh.arrays", carve)?;
        let carve = |a: &mut Arena| MeshScratch::carve(a, points, tets);
        let (_memory, scratch) = Arena::reserve(gpu, "olbvh.mesh.scratch", carve)?;
        let ((), time) = gpu.submit("olbvh.mesh", |r| cmd_prepare(r, &input, &arrays, &scratch, given.as_ref().map(Buffer::all)))?;
        let status: MeshStatus = gpu.download_one(&memory, arrays.status)?;
        let grid: Grid = gpu.download_one(&memory, arrays.grid)?;
        if status.overflow != 0 {
            return Err(Error::TooLarge(format!(
                "the table of faces is full: too few of the {tets} tetrahedra share faces; they can be taken in blocks, see `blocks`"
            )));
        }
        let memory = Arc::new(MeshMemory { _positions: positions, _cells: cells, arrays: memory });
        let kept = KeptMesh { view: MeshView { input, arrays }, memory };
        let made = Self { gpu: gpu.clone(), kept, grid, status, stages: time.stages };
        if policy == BadCells::Reject && status.bad > 0 {
            let list = made.bad_cells()?;
            let named = |&t: &u32| fault_of(mesh, t).map(|fault| format!("cell {}: {fault}", mesh.cell_id(t)));
            let first = list.iter().take(5).filter_map(named).collect::<Vec<_>>().join(", ");
            return Err(Error::BadCells { count: list.len() as u64, first });
        }
        Ok(made)
    }

    /// The bad tetrahedra, which were left out, in ascending order.
    ///
    /// # Errors
    /// A failed transfer.
    pub fn bad_cells(&self) -> Result<Vec<u32>> {
        Ok(set_bits(self.download(self.arrays().bad, u64::from(self.input().tets).div_ceil(32))?))
    }

    /// One bit per tetrahedron: boundary tetrahedron.
    ///
    /// # Errors
    /// A failed transfer.
    pub fn boundary_bits(&self) -> Result<Vec<u32>> {
        self.download(self.arrays().boundary, u64::from(self.input().tets).div_ceil(32))
    }

    /// The four neighbours of every tetrahedron.
    ///
    /// # Errors
    /// A failed transfer.
    pub fn neighbours(&self) -> Result<Vec<[u32; 4]>> {
        self.gpu.download(&self.kept.memory.arrays, self.arrays().neighbours.part(0, 16 * u64::from(self.input().tets)))
    }

    /// Normalised coordinates x, y, z of every point; the bits of the last word are its cell of the finest grid, 10
    /// bits per axis, x lowest.
    ///
    /// # Errors
    /// A failed transfer.
    pub fn vertices(&self) -> Result<Vec<[f32; 4]>> {
        self.gpu.download(&self.kept.memory.arrays, self.arrays().vertices.part(0, 16 * u64::from(self.input().points)))
    }

    fn download(&self, array: BufferRef, words: u64) -> Result<Vec<u32>> {
        self.gpu.download(&self.kept.memory.arrays, array.part(0, 4 * words))
    }

    /// The device that the mesh lies on.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Numbers of points and tetrahedra.
    pub(crate) fn sizes(&self) -> [usize; 2] {
        [self.input().points as usize, self.input().tets as usize]
    }

    /// [`DeviceMesh::input`] and [`DeviceMesh::arrays`] together, as recording functions take them.
    pub fn view(&self) -> MeshView {
        self.kept.view
    }

    /// A share in the ownership of the mesh's memory, for trees over it.
    pub(crate) fn kept(&self) -> KeptMesh {
        self.kept.clone()
    }

    /// Rejects a tree that was built over another mesh. The view is that of a [`KeptMesh`].
    pub(crate) fn check(&self, built_over: &MeshView) -> Result<()> {
        if *built_over == self.view() {
            Ok(())
        } else {
            Err(Error::Invalid("a tree that was built over another mesh; build one over this mesh".into()))
        }
    }

    /// Rejects a device other than the mesh's.
    pub(crate) fn check_device(&self, gpu: &Gpu) -> Result<()> {
        if self.gpu.is_same_device(gpu) { Ok(()) } else { Err(Error::Invalid("the mesh lies on another device".into())) }
    }

    /// The points and tetrahedra in device memory.
    pub fn input(&self) -> &MeshInput {
        &self.kept.view.input
    }

    /// The results of stage 0 in device memory.
    pub fn arrays(&self) -> &MeshArrays {
        &self.kept.view.arrays
    }

    /// The grid over the bounds (or the given one), at the finest level.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Counts of bad, boundary, flat and negative tetrahedra.
    pub fn status(&self) -> &MeshStatus {
        &self.status
    }

    /// Device time of every part of stage 0, in order.
    pub fn stages(&self) -> &[StageTime] {
        &self.stages
    }

    /// Bytes of the neighbour table, which the sizes of a tree do not include.
    pub fn neighbour_bytes(&self) -> u64 {
        16 * u64::from(self.input().tets)
    }
}
