//! Stage 0, for a mesh in anybody's memory: finds bad tetrahedra, bounds and grid, normalised vertices, neighbours and
//! boundary bits (SPEC 2.1, 2.3).

use crate::error::{Error, Result};
use crate::gpu::{Arena, BufferRef, Groups, Recorder};
use crate::kernels::{
    CheckCells, CheckCellsSpec, FindBoundary, FindBoundarySpec, MakeGrid, MakeGridSpec, MatchFaces, MatchFacesSpec, MatchFacesTiled,
    MatchFacesTiledSpec, MeasureCells, MeasureCellsSpec, NormaliseVertices, NormaliseVerticesSpec,
};
use crate::layout::{Grid, MeshStatus};
use crate::primitives::cmd_fill;
use std::mem::offset_of;

/// Most tetrahedra of one mesh: the number of a face must fit 31 bits.
pub const MAX_TETS: u32 = (1 << 29) - 2;
/// Most workgroups of a kernel that ends with a sum over all tetrahedra, as long as none of its invocations takes more
/// than [`SUMMING_ROWS`].
const SUMMING_GROUPS: u32 = 1024;
/// Most tetrahedra of one invocation, whose loops must stay short: some drivers end them after 65,535 passes, inner
/// loops included.
const SUMMING_ROWS: u32 = 512;

/// Tetrahedra of one invocation of the kernels that look at neighbours. Few, so that the workgroups at work at a time,
/// which start in order, are close together in the mesh and find in caches what others have used (H100: 3.1 → 1.8 ms for
/// the faces of 12 million tetrahedra); more than one, since processors take time for every workgroup.
const MATCHING_ROWS: u32 = 4;
/// Most tetrahedra whose faces a workgroup pairs in shared memory, of which each takes 64 bytes (H100: 32 to 256 differ by
/// 6%).
const MATCHING_TILE: u32 = 128;

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

impl MeshInput {
    /// Numbers of points and tetrahedra.
    pub(crate) fn sizes(&self) -> [usize; 2] {
        [self.points as usize, self.tets as usize]
    }

    /// Rejects sizes that shaders cannot number, and parts that are too small.
    pub(super) fn check(&self) -> Result<()> {
        check_tets(self.tets)?;
        check_points("positions", self.points, self.stride)?;
        if let Some(others) = self.points.checked_sub(1) {
            self.positions.check(4 * (u64::from(self.stride) * u64::from(others) + 3), "positions")?;
        }
        self.cells.check(16 * u64::from(self.tets), "cells")
    }
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

/// Scratch memory of stage 0: 20 bytes and six bits per tetrahedron, 4 bytes per point.
#[derive(Clone, Copy, Debug)]
pub struct MeshScratch {
    /// Faces that are looked for.
    table: BufferRef,
    /// On which side of its faces every tetrahedron lies.
    shapes: BufferRef,
    /// Thin corners at every vertex.
    thin: BufferRef,
    /// Marks of faces that more than two tetrahedra share.
    branches: BufferRef,
}

impl MeshScratch {
    /// Takes the scratch memory from an arena. The table of faces is at most 4/5 full even if no two tetrahedra share a
    /// face. Beyond 429 million tetrahedra this holds only if most faces are shared, since the table has fewer than 2^31
    /// words: an index is a signed word to shaders, and bit 31 above the number of a slot must not make NONE of it.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the arena is too small.
    pub fn carve(arena: &mut Arena, points: u32, tets: u32) -> Result<Self> {
        let tets = u64::from(tets);
        Ok(Self {
            table: arena.words((5 * tets + 16).min((1 << 31) - 1))?,
            shapes: arena.words(tets.div_ceil(16))?,
            thin: arena.words(u64::from(points))?,
            branches: arena.words(tets.div_ceil(8))?,
        })
    }
}

/// How many consecutive tetrahedra one workgroup of a kernel that sums over all tetrahedra takes; at least one
/// workgroup's worth.
pub(crate) fn summing_tile(tets: u32, workgroup: u32) -> u32 {
    tets.div_ceil(SUMMING_GROUPS).clamp(1, SUMMING_ROWS * workgroup).next_multiple_of(workgroup)
}

/// Rejects more tetrahedra than one mesh may have.
pub(crate) fn check_tets(tets: u32) -> Result<()> {
    if tets > MAX_TETS {
        return Err(Error::TooLarge(format!(
            "{tets} tetrahedra; one mesh holds {MAX_TETS} at most; more are taken in blocks (`olbvh::blocks`)"
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
    Stage0::new(input, arrays, scratch)?.prepare(r, Given::default())
}

/// Records stage 0 for a mesh whose points have moved: [`cmd_prepare_mesh`] without the search for neighbours, which
/// takes most of its time. `arrays` hold what either function has written for the same cells; `input` may have its
/// positions elsewhere. Visibility and errors are those of [`cmd_prepare_mesh`].
///
/// So are the results, as long as the same tetrahedra are bad. One that becomes bad, since a point of it is no longer
/// finite, loses its neighbours, and they lose it, until [`cmd_prepare_mesh`] is recorded again. Until then these count
/// as boundary tetrahedra, so no point is lost, but the tree is larger, and closest places may be taken for those of the
/// surface that lie inside. [`MeshStatus::parted`] tells, also when no tetrahedron is bad any more.
///
/// # Errors
/// Those of [`cmd_prepare_mesh`].
pub fn cmd_move_mesh(r: &mut Recorder<'_>, input: &MeshInput, arrays: &MeshArrays, scratch: &MeshScratch) -> Result<()> {
    Stage0::new(input, arrays, scratch)?.shift(r)
}

/// What is known of a mesh beforehand, since it is a part of another one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Given {
    /// A [`Grid`] over bounds that contain the mesh, which is used instead of a new one.
    pub grid: Option<BufferRef>,
    /// Thin corners at every vertex that the mesh itself does not have, and at how many vertices they are too many.
    pub thin: Option<(BufferRef, u32)>,
}

/// The parts of stage 0, in order.
pub(super) struct Stage0<'a> {
    input: &'a MeshInput,
    arrays: &'a MeshArrays,
    scratch: &'a MeshScratch,
}

impl<'a> Stage0<'a> {
    pub fn new(input: &'a MeshInput, arrays: &'a MeshArrays, scratch: &'a MeshScratch) -> Result<Self> {
        input.check()?;
        arrays.vertices.check(16 * u64::from(input.points), "the mesh's vertices")?;
        arrays.neighbours.check(16 * u64::from(input.tets), "the mesh's neighbours")?;
        Ok(Self { input, arrays, scratch })
    }

    pub fn tets(&self) -> u32 {
        self.input.tets
    }

    /// Everything.
    pub fn prepare(&self, r: &mut Recorder<'_>, given: Given) -> Result<()> {
        self.begin(r, given)?;
        self.match_faces(r)?;
        self.boundary(r, 1)
    }

    /// Everything before the search for neighbours.
    pub fn begin(&self, r: &mut Recorder<'_>, given: Given) -> Result<()> {
        let &MeshArrays { status, .. } = self.arrays;
        r.stage("mesh.clear", |r| {
            if let Some((_, many)) = given.thin {
                // Kernels look for crowded vertices only if there are any.
                let (at, size) = (offset_of!(MeshStatus, crowded) as u64, size_of::<MeshStatus>() as u64);
                r.fill(status.part(0, at), 0);
                r.fill(status.part(at, 4), many);
                r.fill(status.part(at + 4, size - at - 4), 0);
            } else {
                r.fill(status, 0);
            }
            self.clear(r, given.thin.map(|(thin, _)| thin));
            r.fill(self.scratch.branches, 0);
            cmd_fill(r, self.scratch.table, u32::MAX)
        })?;
        self.measure(r, given.grid)
    }

    /// Everything but the search for neighbours.
    pub fn shift(&self, r: &mut Recorder<'_>) -> Result<()> {
        r.stage("mesh.clear", |r| {
            r.fill(self.arrays.status.part(0, offset_of!(MeshStatus, overflow) as u64), 0); // that and what follows stay as they were
            self.clear(r, None);
            Ok(())
        })?;
        self.measure(r, None)?;
        self.boundary(r, 0)
    }

    fn clear(&self, r: &mut Recorder<'_>, thin: Option<BufferRef>) {
        for array in [self.arrays.bad, self.arrays.boundary, self.scratch.shapes] {
            r.fill(array, 0);
        }
        match thin {
            Some(given) => r.copy(given, self.scratch.thin.part(0, given.size)),
            None => r.fill(self.scratch.thin, 0),
        }
    }

    /// Workgroups of a kernel that takes tiles of this many tetrahedra.
    fn groups(&self, tile: u32) -> Groups {
        Groups::Count(self.input.tets.div_ceil(tile))
    }

    /// Bad cells, bounds, normalised vertices, and what the boundary needs to know of every tetrahedron.
    fn measure(&self, r: &mut Recorder<'_>, given: Option<BufferRef>) -> Result<()> {
        let MeshInput { positions, stride, points, cells, tets } = *self.input;
        let MeshArrays { status, grid, bad, vertices, .. } = *self.arrays;
        let MeshScratch { shapes, thin, .. } = *self.scratch;
        let workgroup = r.gpu().target().each;
        let tile = summing_tile(tets, workgroup);
        let tiles = self.groups(tile);
        r.barrier("mesh.clear → mesh.check_cells");
        r.stage("mesh.bounds", |r| {
            let spec = CheckCellsSpec { workgroup, ..Default::default() };
            r.dispatch(&CheckCells { positions, cells, bad, status, tets, points, stride, tile }, spec, tiles)?;
            r.barrier("mesh.check_cells → mesh.make_grid");
            if let Some(given) = given {
                r.copy(given, grid.part(0, given.size));
            } else {
                let make = MakeGrid { status, grid, positions, cells, bad, tets, stride };
                r.dispatch(&make, MakeGridSpec { workgroup, ..Default::default() }, Groups::Count(1))?;
            }
            r.barrier("mesh.make_grid → mesh.normalise_vertices");
            let spec = NormaliseVerticesSpec { workgroup, ..Default::default() };
            let groups = Groups::Count(points.div_ceil(workgroup));
            r.dispatch(&NormaliseVertices { grid, positions, vertices, points, stride }, spec, groups)
        })?;
        r.barrier("mesh.normalise_vertices → mesh.measure_cells");
        r.stage("mesh.shapes", |r| {
            let spec = MeasureCellsSpec { workgroup, ..Default::default() };
            r.dispatch(&MeasureCells { vertices, cells, bad, shapes, thin, status, tets, tile }, spec, tiles)
        })
    }

    /// The mates of faces, in the place of neighbours.
    pub fn match_faces(&self, r: &mut Recorder<'_>) -> Result<()> {
        let MeshInput { points, cells, tets, .. } = *self.input;
        let MeshArrays { status, bad, neighbours, .. } = *self.arrays;
        let MeshScratch { table, branches, .. } = *self.scratch;
        let workgroup = r.gpu().target().each;
        let tile = MATCHING_ROWS * workgroup;
        r.barrier("mesh.measure_cells → mesh.match_faces");
        r.stage("mesh.faces", |r| {
            let slots = (table.size / 4) as u32;
            let near_slots = (slots / points.max(1)).max(1);
            let mates = neighbours;
            if r.gpu().target().is_processor() {
                let kernel = MatchFaces { cells, bad, table, mates, status, branches, tets, slots, near_slots, tile };
                r.dispatch(&kernel, MatchFacesSpec { workgroup, ..Default::default() }, self.groups(tile))
            } else {
                let workgroup = workgroup.min(MATCHING_TILE);
                let kernel = MatchFacesTiled { cells, bad, table, mates, status, branches, tets, slots, near_slots };
                r.dispatch(&kernel, MatchFacesTiledSpec { workgroup, ..Default::default() }, self.groups(workgroup))
            }
        })
    }

    /// Boundary bits; `mates`: 1 if the neighbours are mates of faces that are still to be named, else 0.
    pub fn boundary(&self, r: &mut Recorder<'_>, mates: u32) -> Result<()> {
        let MeshInput { cells, tets, .. } = *self.input;
        let MeshArrays { status, bad, boundary, neighbours, .. } = *self.arrays;
        let MeshScratch { table, shapes, thin, branches } = *self.scratch;
        let workgroup = r.gpu().target().each;
        let tile = MATCHING_ROWS * workgroup;
        r.barrier("mesh.faces → mesh.find_boundary");
        r.stage("mesh.boundary", |r| {
            let spec = FindBoundarySpec { workgroup, mates, ..Default::default() };
            r.dispatch(
                &FindBoundary { bad, shapes, neighbours, boundary, status, cells, thin, branches, table, tets, tile },
                spec,
                self.groups(tile),
            )
        })
    }
}
