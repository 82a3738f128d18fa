//! Recording functions for the sets of tetrahedra that intersect the other mesh, both directions side by side.

use super::frames::{Frames, each_once, unfinished};
use crate::build::MeshInput;
use crate::error::Result;
use crate::gpu::{Arena, BufferRef, Groups, Recorder};
use crate::kernels::{
    OverlapCollect, OverlapCollectSpec, OverlapPlaces, OverlapPlacesSpec, OverlapSearch, OverlapSearchSpec, OverlapUsed, OverlapUsedSpec,
};
use crate::layout::SearchState;
use crate::primitives::Count;
use crate::query::{Rounds, Scene, list_parts};

/// Arrays of one direction: the tetrahedra of one mesh against the tree of the other.
#[derive(Clone, Copy, Debug)]
struct Arrays {
    used: BufferRef,
    places: BufferRef,
    around: BufferRef,
    hits: BufferRef,
    waiting: BufferRef,
    states: BufferRef,
    status: BufferRef,
    frame: BufferRef,
    groups: BufferRef,
}

impl Arrays {
    fn carve(arena: &mut Arena, own: &Scene, other: &Scene, status: BufferRef, frame: BufferRef) -> Result<Self> {
        let (points, tets) = (u64::from(own.mesh.input.points), u64::from(own.mesh.input.tets));
        Ok(Self {
            used: arena.words(points.div_ceil(32))?,
            places: arena.words(points)?,
            around: arena.words(u64::from(other.mesh.input.tets).div_ceil(32))?,
            hits: arena.words(tets.div_ceil(32))?,
            waiting: arena.words(tets)?,
            states: arena.take(size_of::<SearchState>() as u64 * tets)?,
            status,
            frame,
            groups: arena.words(3)?,
        })
    }

    /// Rejects memory that was carved for fewer points or tetrahedra.
    fn check(&self, own: &MeshInput, other: &MeshInput) -> Result<()> {
        self.places.check(4 * u64::from(own.points), "places of vertices")?;
        self.states.check(size_of::<SearchState>() as u64 * u64::from(own.tets), "states of tetrahedra")?;
        self.around.check(4 * u64::from(other.tets.div_ceil(32)), "tetrahedra around vertices")
    }
}

/// Answers and scratch memory for the sets of two meshes: about 20 bytes per tetrahedron and 4 per point.
#[derive(Clone, Copy, Debug)]
pub struct OverlapMemory {
    /// One bit per tetrahedron, set if it intersects the other mesh: first for A, then for B.
    pub hits: [BufferRef; 2],
    /// [`crate::layout::OverlapStatus`] of A against B, then of B against A.
    pub status: [BufferRef; 2],
    pub(super) frames: Frames,
    directions: [Arrays; 2],
}

impl OverlapMemory {
    /// Carves the memory for these two meshes, or others with the same numbers of points and tetrahedra.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(arena: &mut Arena, a: &Scene, b: &Scene) -> Result<Self> {
        let frames = Frames::carve(arena)?;
        let [forth, back] = frames.status;
        let directions = [Arrays::carve(arena, a, b, forth, frames.of[1])?, Arrays::carve(arena, b, a, back, frames.of[0])?];
        Ok(Self { hits: directions.map(|w| w.hits), status: frames.status, frames, directions })
    }
}

/// Records which tetrahedra of A intersect B and which of B intersect A; the points of both lie in one space. This call
/// only records: nothing is submitted, waited for, allocated or read back.
///
/// Each round visits a limited number of nodes and entries per tetrahedron; three rounds suffice for most. After the
/// recorded rounds [`crate::layout::OverlapStatus::unfinished`] says how many tetrahedra are undecided; their bits are
/// still zero. Recording again with [`Rounds::resume`] (same scenes, same memory) continues the search. Trees with
/// [`crate::options::Lists::Boundary`] suffice.
///
/// Entry: meshes and trees are read by compute shaders. First use of `memory`: transfer writes. Last use: compute reads
/// and writes. There is no barrier before or after, so the caller records one from compute shader writes to whatever
/// reads the answers.
///
/// # Errors
/// [`crate::Error::Invalid`] for no rounds, or memory for fewer points or tetrahedra; [`crate::Error::Vulkan`] if a
/// pipeline cannot be made.
pub fn cmd_overlap(r: &mut Recorder<'_>, a: &Scene, b: &Scene, memory: &OverlapMemory, rounds: Rounds) -> Result<()> {
    rounds.check()?;
    let [forth, back] = memory.directions;
    forth.check(&a.mesh.input, &b.mesh.input)?;
    back.check(&b.mesh.input, &a.mesh.input)?;
    let directions = [
        Direction { own: *a, other: *b, arrays: forth, held: back.around },
        Direction { own: *b, other: *a, arrays: back, held: forth.around },
    ];
    if !rounds.resume {
        directions.iter().for_each(|w| w.cmd_clear(r));
        r.barrier("overlap.clear → overlap.used");
        r.stage("overlap.vertices", |r| {
            memory.frames.cmd(r, a, b)?;
            directions.iter().try_for_each(|w| w.cmd_used(r))?;
            let parts = directions.each_ref().map(|d| list_parts(r.gpu().report().kind, d.other.longest_leaf));
            for part in 0..parts[0].1.max(parts[1].1) {
                r.barrier("overlap.used → overlap.places");
                for (direction, (length, _)) in directions.iter().zip(parts).filter(|(_, (_, count))| part < *count) {
                    direction.cmd_places(r, part, length)?;
                }
            }
            Ok(())
        })?;
        r.barrier("overlap.places → overlap.collect");
        r.stage("overlap.collect", |r| directions.iter().try_for_each(|w| w.cmd_collect(r)))?;
        r.barrier("overlap.collect → overlap.search");
    }
    r.stage("overlap.search", |r| {
        let groups = [directions[0].groups(r)?, directions[1].groups(r)?];
        for round in 0..rounds.count {
            if round > 0 {
                r.barrier("overlap.search → overlap.clear");
            }
            directions.iter().for_each(|w| r.fill(unfinished(w.arrays.status), 0));
            r.barrier("overlap.clear → overlap.search");
            directions.iter().zip(groups).try_for_each(|(w, groups)| w.cmd_search(r, groups))?;
        }
        Ok(())
    })
}

/// One direction, as the kernels see it.
struct Direction {
    own: Scene,
    other: Scene,
    arrays: Arrays,
    /// The tetrahedra of `own` that contain a vertex of the other mesh, which the other direction determines.
    held: BufferRef,
}

impl Direction {
    fn cmd_clear(&self, r: &mut Recorder<'_>) {
        for range in [self.arrays.used, self.arrays.around, self.arrays.states, self.arrays.status] {
            r.fill(range, 0);
        }
    }

    fn cmd_used(&self, r: &mut Recorder<'_>) -> Result<()> {
        let (workgroup, tets) = (r.gpu().target().query, self.own.mesh.input.tets);
        let arguments = OverlapUsed { bad: self.own.mesh.arrays.bad, cells: self.own.mesh.input.cells, used: self.arrays.used, tets };
        r.dispatch(&arguments, OverlapUsedSpec { workgroup, ..Default::default() }, Groups::Count(tets.div_ceil(workgroup)))
    }

    fn cmd_places(&self, r: &mut Recorder<'_>, part: u32, part_length: u32) -> Result<()> {
        let (tree, mesh, own) = (&self.other.tree, &self.other.mesh, &self.own.mesh.input);
        let workgroup = r.gpu().target().query;
        let arguments = OverlapPlaces {
            grid: tree.grid,
            masks: tree.masks,
            co: tree.co,
            po: tree.po,
            p: tree.p,
            flags: tree.flags,
            cells: mesh.input.cells,
            vertices: mesh.arrays.vertices,
            own_positions: own.positions,
            used: self.arrays.used,
            places: self.arrays.places,
            around: self.arrays.around,
            status: self.arrays.status,
            points: own.points,
            stride: own.stride,
            part,
        };
        let spec = OverlapPlacesSpec { workgroup, part_length, ..Default::default() };
        r.dispatch(&arguments, spec, Groups::Count(own.points.div_ceil(workgroup)))
    }

    fn cmd_collect(&self, r: &mut Recorder<'_>) -> Result<()> {
        let (workgroup, own) = (r.gpu().target().query, &self.own.mesh.input);
        let arguments = OverlapCollect {
            grid: self.other.tree.grid,
            own_positions: own.positions,
            own_cells: own.cells,
            bad: self.own.mesh.arrays.bad,
            places: self.arrays.places,
            around: self.held,
            hits: self.arrays.hits,
            waiting: self.arrays.waiting,
            status: self.arrays.status,
            tets: own.tets,
            stride: own.stride,
        };
        let spec = OverlapCollectSpec { workgroup, ..Default::default() };
        r.dispatch(&arguments, spec, Groups::Count(own.tets.div_ceil(32).div_ceil(workgroup)))
    }

    /// Records the computation of the search's workgroups. The number of waiting tetrahedra must be visible already;
    /// there is no barrier.
    fn groups(&self, r: &mut Recorder<'_>) -> Result<Groups> {
        let waiting = Count::device(self.own.mesh.input.tets, self.arrays.status.word(0));
        waiting.arguments(r, r.gpu().target().query, self.arrays.groups)
    }

    fn cmd_search(&self, r: &mut Recorder<'_>, groups: Groups) -> Result<()> {
        let (tree, mesh, own) = (&self.other.tree, &self.other.mesh, &self.own.mesh.input);
        let workgroup = r.gpu().target().query;
        let arguments = OverlapSearch {
            grid: tree.grid,
            masks: tree.masks,
            co: tree.co,
            po: tree.po,
            p: tree.p,
            flags: tree.flags,
            cells: mesh.input.cells,
            positions: mesh.input.positions,
            own_cells: own.cells,
            own_positions: own.positions,
            frame: self.arrays.frame,
            waiting: self.arrays.waiting,
            states: self.arrays.states,
            hits: self.arrays.hits,
            status: self.arrays.status,
            most: own.tets,
        };
        let (each_once, stride, own_stride) = (each_once(&self.other), mesh.input.stride, own.stride);
        let spec = OverlapSearchSpec { workgroup, each_once, own_stride, stride, ..Default::default() };
        r.dispatch(&arguments, spec, groups)
    }
}
