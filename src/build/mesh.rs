//! A mesh on the device, in memory of its own.

use super::prepare::{Given, MeshArrays, MeshInput, MeshScratch, MeshView, Stage0, check_tets};
use crate::error::{Error, Result};
use crate::gpu::{Arena, Buffer, BufferRef, Gpu, Recorder};
use crate::grid::MAX_LEVEL;
use crate::layout::{Grid, MeshStatus, set_bits};
use crate::mesh::{Mesh, fault_of};
use crate::reference::corners::MOST_THIN;
use crate::times::StageTimes;
use std::sync::Arc;

/// Meshes of this many tetrahedra are prepared in several submissions, since a system may end one that takes seconds.
const LARGE: u32 = 1 << 20;

/// What to do with bad cells (SPEC 2.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BadCells {
    /// Leave them out and count them.
    #[default]
    Skip,
    /// Return an error that names the first few.
    Reject,
}

/// The location of a mesh, and a share in the ownership of its memory.
#[derive(Clone, Debug)]
pub(crate) struct KeptMesh {
    pub view: MeshView,
    memory: Arc<MeshMemory>,
}

#[derive(Debug)]
struct MeshMemory {
    _positions: Buffer,
    cells: Arc<Buffer>,
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
    times: StageTimes,
}

impl DeviceMesh {
    /// Uploads a mesh and prepares it. If the tetrahedra are in no spatial order, [`Mesh::along_curve`] gives an order
    /// that is faster.
    ///
    /// # Errors
    /// [`Error::Memory`], [`Error::TooLarge`], or [`Error::BadCells`] if the policy rejects them.
    pub fn upload(gpu: &Gpu, mesh: &Mesh, policy: BadCells) -> Result<Self> {
        let made = Self::upload_slices(gpu, &mesh.points, &mesh.tets)?;
        if policy == BadCells::Reject && made.status.bad > 0 {
            let list = made.bad_cells()?;
            let named = |&t: &u32| fault_of(mesh, t).map(|fault| format!("cell {}: {fault}", mesh.cell_id(t)));
            let first = list.iter().take(5).filter_map(named).collect::<Vec<_>>().join(", ");
            return Err(Error::BadCells { count: list.len() as u64, first });
        }
        Ok(made)
    }

    /// As [`DeviceMesh::upload`], for points and vertices of tetrahedra in arrays of the caller. Bad tetrahedra are left out;
    /// [`DeviceMesh::bad_cells`] tells which.
    ///
    /// # Errors
    /// As [`DeviceMesh::upload`].
    pub fn upload_slices(gpu: &Gpu, points: &[[f32; 3]], tets: &[[u32; 4]]) -> Result<Self> {
        Self::upload_arrays(gpu, points, tets, None, &[])
    }

    /// [`DeviceMesh::upload_slices`], optionally into a given grid, whose bounds must contain the mesh and whose level does
    /// not matter: parts of a mesh in one grid have the same octree cells and normalised points. `crowded` points count
    /// as crowded, however many tetrahedra meet there.
    pub(crate) fn upload_arrays(gpu: &Gpu, points: &[[f32; 3]], tets: &[[u32; 4]], grid: Option<&Grid>, crowded: &[u32]) -> Result<Self> {
        let number = |n: usize| u32::try_from(n).map_err(|_| Error::TooLarge(format!("{n} points or tetrahedra; 32 bits number 2^32")));
        let (n_points, n_tets) = (number(points.len())?, number(tets.len())?);
        check_tets(n_tets)?;
        // Level and ids are those of a tree; each tree over the mesh sets its own.
        let finest = |grid: &Grid| Grid { level: MAX_LEVEL, first_leaf: 0, ids: u32::MAX, slabs: 0, longest: 0, ..*grid };
        let grid = grid.map(|grid| gpu.upload("olbvh.mesh.grid", &[finest(grid)])).transpose()?;
        let thin = || {
            let mut thin = vec![0; points.len()];
            crowded.iter().for_each(|&v| thin[v as usize] = MOST_THIN + 1);
            gpu.upload("olbvh.mesh.thin", &thin)
        };
        let thin = (!crowded.is_empty()).then(thin).transpose()?;
        let given = Given { grid: grid.as_ref().map(Buffer::all), thin: thin.as_ref().map(|thin| (thin.all(), crowded.len() as u32)) };
        let positions = gpu.upload("olbvh.mesh.positions", points)?;
        let cells = Arc::new(gpu.upload("olbvh.mesh.cells", tets)?);
        Self::new(gpu, positions, cells, [n_points, n_tets], |stage0, _| Self::prepare(gpu, stage0, given))
    }

    /// The same cells with their points elsewhere, as a simulation moves them: what [`DeviceMesh::upload_slices`] makes of
    /// these, without the search for neighbours, which takes most of its time, unless the mesh has bad tetrahedra. This mesh
    /// and its trees stay as they are; memory for the cells is shared.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another number of points, else as [`DeviceMesh::upload`].
    pub fn moved(&self, points: &[[f32; 3]]) -> Result<Self> {
        let MeshInput { points: n_points, tets, .. } = *self.input();
        if points.len() != n_points as usize {
            return Err(Error::Invalid(format!("{} points for a mesh of {n_points}", points.len())));
        }
        let positions = self.gpu.upload("olbvh.mesh.positions", points)?;
        // Tetrahedra that are or were bad lack neighbours that they would have now.
        let whole = self.status.bad == 0 && self.status.parted == 0;
        let (gpu, from) = (&self.gpu, self.arrays());
        Self::new(gpu, positions, self.kept.memory.cells.clone(), [n_points, tets], |stage0, to| {
            if !whole {
                return Self::prepare(gpu, stage0, Given::default());
            }
            let ((), times) = gpu.submit("olbvh.mesh.moved", |r| {
                r.stage("mesh.copy", |r| {
                    r.copy(from.status.part(0, size_of::<MeshStatus>() as u64), to.status);
                    r.copy(from.neighbours.part(0, 16 * u64::from(tets)), to.neighbours);
                    Ok(())
                })?;
                r.barrier("mesh.copy → mesh.clear");
                stage0.shift(r)
            })?;
            Ok(times)
        })
    }

    /// A mesh of these buffers, by a function that runs stage 0.
    fn new(
        gpu: &Gpu,
        positions: Buffer,
        cells: Arc<Buffer>,
        [points, tets]: [u32; 2],
        prepare: impl FnOnce(&Stage0<'_>, &MeshArrays) -> Result<StageTimes>,
    ) -> Result<Self> {
        let input = MeshInput { positions: positions.all(), stride: 3, points, cells: cells.all(), tets };
        let (memory, arrays) = Arena::reserve(gpu, "olbvh.mesh.arrays", |a: &mut Arena| MeshArrays::carve(a, points, tets))?;
        let (_memory, scratch) = Self::scratch(gpu, &input)?;
        let times = prepare(&Stage0::new(&input, &arrays, &scratch)?, &arrays)?;
        let status: MeshStatus = gpu.download_one(&memory, arrays.status)?;
        let grid: Grid = gpu.download_one(&memory, arrays.grid)?;
        if status.overflow != 0 {
            return Err(Error::TooLarge(format!(
                "the table of faces is full: too few of the {tets} tetrahedra share faces; they can be taken in blocks (`olbvh::blocks`)"
            )));
        }
        let memory = Arc::new(MeshMemory { _positions: positions, cells, arrays: memory });
        let kept = KeptMesh { view: MeshView { input, arrays }, memory };
        Ok(Self { gpu: gpu.clone(), kept, grid, status, times })
    }

    fn scratch(gpu: &Gpu, input: &MeshInput) -> Result<(Buffer, MeshScratch)> {
        Arena::reserve(gpu, "olbvh.mesh.scratch", |a: &mut Arena| MeshScratch::carve(a, input.points, input.tets))
    }

    /// Runs stage 0, and returns what it took.
    fn prepare(gpu: &Gpu, stage0: &Stage0<'_>, given: Given) -> Result<StageTimes> {
        let submit = |record: &dyn Fn(&mut Recorder<'_>) -> Result<()>| gpu.submit("olbvh.mesh", record).map(|((), times)| times);
        if stage0.tets() < LARGE {
            return submit(&|r| stage0.prepare(r, given));
        }
        let mut times = submit(&|r| stage0.begin(r, given))?;
        times.add(submit(&|r| stage0.match_faces(r))?);
        times.add(submit(&|r| stage0.boundary(r, 1))?);
        Ok(times)
    }

    /// A function that does all of stage 0 again in the memory of before, with the same results, and returns what it
    /// took. For meshes that were uploaded without a given grid.
    #[cfg(feature = "cli")]
    pub(crate) fn again(&self) -> Result<impl FnMut() -> Result<StageTimes>> {
        let (memory, scratch) = Self::scratch(&self.gpu, self.input())?;
        Ok(move || {
            let _held = &memory;
            Self::prepare(&self.gpu, &Stage0::new(self.input(), self.arrays(), &scratch)?, Given::default())
        })
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

    /// [`DeviceMesh::input`] and [`DeviceMesh::arrays`] together, as recording functions take them.
    pub fn view(&self) -> MeshView {
        self.kept.view
    }

    /// A share in the ownership of the mesh's memory, for trees over it.
    pub(crate) fn kept(&self) -> KeptMesh {
        self.kept.clone()
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

    /// What stage 0 took.
    pub fn times(&self) -> &StageTimes {
        &self.times
    }

    /// Bytes of the neighbour table, which the sizes of a tree do not include.
    pub fn neighbour_bytes(&self) -> u64 {
        16 * u64::from(self.input().tets)
    }
}
