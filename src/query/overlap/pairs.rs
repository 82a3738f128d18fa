//! Recording functions for the pairs of tetrahedra that intersect: pairs are counted, then written into the memory
//! available.

use super::frames::{Frames, each_once, unfinished};
use crate::error::{Error, Result};
use crate::gpu::{Arena, BufferRef, Gpu, Groups, Recorder};
use crate::kernels::{OverlapPairs, OverlapPairsSpec};
use crate::layout::{OverlapStatus, SearchState};
use crate::options::Lists;
use crate::primitives::{Count, ScanScratch, cmd_exclusive_scan};
use crate::query::{Rounds, Scene, capacity_of};
use std::mem::offset_of;

/// Counters and scratch memory for pairs: 24 bytes per tetrahedron of A.
#[derive(Clone, Copy, Debug)]
pub struct PairMemory {
    /// [`crate::layout::OverlapStatus`]; its `pairs` is the number of pairs that touch, whether or not there was room
    /// for them.
    pub status: BufferRef,
    frames: Frames,
    states: BufferRef,
    counts: BufferRef,
    places: BufferRef,
    total: BufferRef,
    scan: ScanScratch,
}

impl PairMemory {
    /// Carves the memory for a first mesh of `tets` tetrahedra.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the arena is too small.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, tets: u32) -> Result<Self> {
        let n = u64::from(tets);
        let frames = Frames::carve(arena)?;
        Ok(Self {
            status: frames.status[0],
            frames,
            states: arena.take(size_of::<SearchState>() as u64 * n)?,
            counts: arena.words(n)?,
            places: arena.words(n)?,
            total: arena.words(1)?,
            scan: ScanScratch::carve(gpu, arena, tets)?,
        })
    }

    /// Rejects memory that was carved for fewer tetrahedra.
    fn check(&self, a: &Scene) -> Result<()> {
        self.states.check(size_of::<SearchState>() as u64 * u64::from(a.mesh.input.tets), "states of tetrahedra")
    }
}

/// Records the counting of pairs, a tetrahedron of A and one of B, that touch: [`crate::layout::OverlapStatus::pairs`],
/// complete once `unfinished` is 0. With filtered assignments a pair counts once per leaf that lists the tetrahedron of
/// B and lies in the quantized box of that of A. This call only records: nothing is submitted, waited for, allocated or
/// read back.
///
/// Entry: meshes and trees are read by compute shaders. First use of `memory`: transfer writes. Last use: compute reads
/// and writes; no barrier before or after. With [`Rounds::resume`] it continues with the tetrahedra that are not
/// finished. A tree over B with [`crate::options::Assign::Aabb`] spares the repeats.
///
/// # Errors
/// [`Error::Invalid`] for a tree over B without the lists that pairs are found by ([`Lists::All`]), for no rounds, or for
/// memory for fewer tetrahedra.
pub fn cmd_count_pairs(r: &mut Recorder<'_>, a: &Scene, b: &Scene, memory: &PairMemory, rounds: Rounds) -> Result<()> {
    rounds.check()?;
    memory.check(a)?;
    if b.tree.lists != Lists::All {
        return Err(Error::Invalid("pairs of cells are found by lists: build the tree over the second mesh with `Lists::All`".into()));
    }
    if !rounds.resume {
        [memory.states, memory.frames.status[0], memory.frames.status[1]].into_iter().for_each(|part| r.fill(part, 0));
        r.barrier("overlap.clear → overlap.frames");
        memory.frames.cmd(r, a, b)?;
    }
    for round in 0..rounds.count {
        if round > 0 {
            r.barrier("overlap.pairs → overlap.clear");
        }
        if round > 0 || rounds.resume {
            r.fill(unfinished(memory.status), 0);
        }
        r.barrier("overlap.clear → overlap.pairs");
        cmd_pairs(r, a, b, memory, 0, r.gpu().nothing())?;
    }
    Ok(())
}

/// Records the pairs themselves, after [`cmd_count_pairs`]: two words each in `found`, the tetrahedron of A and that of
/// B, ascending by A, and for one tetrahedron of A in the order of B's leaves. As many are written as `found` holds;
/// `pairs` of the status says how many there are. If 32 bits cannot number them, none is written. Complete once
/// [`crate::layout::OverlapStatus::unfilled`] is 0; with [`Rounds::resume`] it continues with the tetrahedra that are
/// not finished. A list is written once: for another one, count again.
///
/// Starts with a barrier (with [`Rounds::resume`]: with a transfer write of the status). Last use: compute reads and
/// writes; no barrier after.
///
/// # Errors
/// [`Error::Invalid`] for no rounds, or memory for fewer tetrahedra; [`Error::Vulkan`] if a pipeline cannot be made.
pub fn cmd_list_pairs(r: &mut Recorder<'_>, a: &Scene, b: &Scene, memory: &PairMemory, found: BufferRef, rounds: Rounds) -> Result<()> {
    rounds.check()?;
    memory.check(a)?;
    if !rounds.resume {
        cmd_exclusive_scan(r, memory.counts, memory.places, memory.total, Count::host(a.mesh.input.tets), &memory.scan)?;
    }
    for round in 0..rounds.count {
        if round > 0 {
            r.barrier("overlap.pairs → overlap.clear");
        }
        r.fill(memory.status.part(offset_of!(OverlapStatus, unfilled) as u64, 4), 0);
        r.barrier("overlap.clear → overlap.pairs");
        cmd_pairs(r, a, b, memory, 1, found)?;
    }
    Ok(())
}

fn cmd_pairs(r: &mut Recorder<'_>, a: &Scene, b: &Scene, memory: &PairMemory, fill: u32, found: BufferRef) -> Result<()> {
    let (tree, mesh, own) = (&b.tree, &b.mesh.input, &a.mesh.input);
    let workgroup = r.gpu().target().query;
    let arguments = OverlapPairs {
        grid: tree.grid,
        masks: tree.masks,
        co: tree.co,
        po: tree.po,
        p: tree.p,
        cells: mesh.cells,
        positions: mesh.positions,
        own_cells: own.cells,
        own_positions: own.positions,
        bad: a.mesh.arrays.bad,
        frame: memory.frames.of[1],
        states: memory.states,
        places: if fill == 0 { memory.counts } else { memory.places },
        found,
        status: memory.status,
        tets: own.tets,
        capacity: capacity_of(found, 8),
    };
    let (each_once, stride, own_stride) = (each_once(b), mesh.stride, own.stride);
    let spec = OverlapPairsSpec { workgroup, each_once, own_stride, stride, fill, ..Default::default() };
    r.stage("overlap.pairs", |r| r.dispatch(&arguments, spec, Groups::Count(own.tets.div_ceil(workgroup))))
}
