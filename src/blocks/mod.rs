//! Meshes that do not fit the device's memory, processed in blocks: these are built, queried and dropped one after
//! another, each within the memory limit of the given handle.
//!
//! Each block is a box of octree cells on the tree's level; a box is cut in two by numbers of tetrahedra. A block
//! contains its *core*, which is every tetrahedron whose quantized box meets these cells, and the tetrahedra that share
//! a face with the core. A leaf in the block's own cells therefore has the same list as in the tree over the whole
//! mesh, and the same boundary flag, since all neighbours of the core are present. The ids of points and tetrahedra
//! keep their order, the grid is that of the whole mesh, and the level is that of the whole tree
//! ([`crate::options::BuildOptions::level`]). Hence each point is located in one block, and **answers equal those of
//! the whole tree**, including the tolerance and gaps between tetrahedra.
//!
//! - A voxel's centre lies in one block, but its box may reach into several: each block reports the closest tetrahedron
//!   that it lists in its own cells.
//! - Every block reports the closest place of the surface in its own cells, and the closest of all is taken.
//! - A sample of a ray lies in one block, and the samples of a block are consecutive. Blocks are rendered front to
//!   back.
//! - Two meshes overlap where their blocks overlap.
//!
//! Memory and limits:
//! - A mesh that fits is not cut. Whether a block fits is first estimated; a block that turns out to be larger is
//!   abandoned and cut again.
//! - The limit is that of the handle ([`Gpu::with_memory`]), which counts every buffer, transfer buffers included.
//! - The mesh itself is in host memory as a whole, with an additional 6 bytes per point and 4 per tetrahedron.
//!   Rendering adds normals (12 bytes per point), rays (52 bytes each), and at the start neighbours (16 bytes per
//!   tetrahedron, and about three times that while they are matched).
//! - The level may be coarser than requested, if one bit for each of its cells would take more than an eighth of the
//!   memory, or if the largest tetrahedra would meet so many of them that no block with these fitted. It may be finer
//!   where lists may be long ([`crate::options::BuildOptions::fineness`]): a plate would be a single cell, which cannot
//!   be cut. Where tetrahedra overlap, [`crate::options::Lists::Boundary`] may report another of
//!   those that contain a point, as it may without blocks.

mod cut;
mod locate;
mod nearest;
mod overlap;
mod render;
mod size;
mod slice;

pub use locate::{LocateRequest, locate, locate_all};
pub use nearest::nearest;
pub use overlap::{OverlapRequest, overlap};
pub use render::{Picture, RenderRequest, render};
pub use slice::{SliceRequest, slice};

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::mesh::{Mesh, On};
use crate::options::BuildOptions;
use cut::{Block, Placed, Source};
use std::time::Instant;

/// An answer, and its cost.
#[derive(Clone, Debug, Default)]
pub struct InBlocks<T = ()> {
    /// The answer, equal to that of the whole mesh.
    pub answer: T,
    /// Number of trees built for it; 1 per mesh if that fitted as a whole.
    pub trees: u32,
    /// The most bytes that buffers of the given handle took simultaneously.
    pub peak: u64,
    /// Seconds spent on building trees, transfers included.
    pub build_seconds: f64,
    /// Number of bad tetrahedra, which are left out: of the mesh, or of each of two meshes.
    pub bad_cells: [u32; 2],
}

impl<T> InBlocks<T> {
    /// Splits off the answer.
    pub fn into_parts(self) -> (T, InBlocks) {
        let Self { answer, trees, peak, build_seconds, bad_cells } = self;
        (answer, InBlocks { answer: (), trees, peak, build_seconds, bad_cells })
    }
}

impl InBlocks {
    /// Adds an answer.
    #[must_use]
    pub fn with<T>(self, answer: T) -> InBlocks<T> {
        let Self { answer: (), trees, peak, build_seconds, bad_cells } = self;
        InBlocks { answer, trees, peak, build_seconds, bad_cells }
    }

    /// Builds a tree and adds its cost.
    fn build<T>(&mut self, build: impl FnOnce() -> Result<T>) -> Result<T> {
        let start = Instant::now();
        let built = build()?;
        self.trees += 1;
        self.build_seconds += start.elapsed().as_secs_f64();
        Ok(built)
    }

    /// Places the whole of a mesh, which is number `side` of those asked about, and adds its cost.
    fn place(&mut self, gpu: &Gpu, mesh: &Mesh, options: &BuildOptions, side: usize) -> Result<Placed> {
        let placed = self.build(|| Placed::whole(gpu, mesh, options))?;
        self.bad_cells[side] = placed.mesh.status().bad;
        Ok(placed)
    }
}

/// An answer for the whole mesh; `None`, with the reason in the log, if there is too little memory for it.
fn unless_too_large<T>(answer: Result<T>) -> Result<Option<T>> {
    match answer {
        Err(e) if e.is_lack_of_room() => {
            log::info!("in blocks, since the whole does not fit: {e}");
            Ok(None)
        }
        answer => answer.map(Some),
    }
}

/// How the work on a block ended.
enum Tried {
    Done,
    /// The block does not fit; if it was tried, the reason.
    TooLarge(Option<Error>),
}

/// Does the work on a block that takes about `need` bytes, if the limit allows as many.
fn try_block(gpu: &Gpu, need: u64, work: impl FnOnce() -> Result<()>) -> Result<Tried> {
    if need > gpu.memory_limit() {
        return Ok(Tried::TooLarge(None));
    }
    match work() {
        Err(e) if e.is_lack_of_room() => Ok(Tried::TooLarge(Some(e))),
        done => done.map(|()| Tried::Done),
    }
}

/// A block of this many tetrahedra or fewer is not cut again.
const LEAST: usize = 1024;

/// The number of blocks to make of one that takes `need` bytes where there are `memory`: as few as will do, each with a
/// tenth to spare, since tetrahedra at a cut are in both blocks. At least two, so that every block is cut.
fn pieces(need: u64, memory: u64) -> usize {
    (u128::from(need) * 11).div_ceil(u128::from(memory.max(1)) * 10).clamp(2, 64) as usize
}

/// Which cuts are allowed, by axis and last finest cell below: see [`Source::cut_in_two`].
type May<'a> = &'a dyn Fn(usize, u32) -> bool;

/// Allows every cut.
const ANYWHERE: May<'_> = &|_, _| true;

/// Cuts a block in two, if it is large enough, as a step towards `pieces` blocks.
fn smaller(source: &Source<'_>, block: &Block, pieces: usize, may: May<'_>) -> Option<[Block; 2]> {
    if block.tets.len() > LEAST { source.cut_in_two(block, pieces, may) } else { None }
}

/// Rejects a field whose length does not match the mesh.
fn check_field(mesh: &Mesh, field: Option<(&[f32], On)>) -> Result<()> {
    field.map_or(Ok(()), |(values, on)| on.check(values, [mesh.points.len(), mesh.tets.len()]))
}

/// What was to be done within too little memory.
struct Refused<'a, 's> {
    gpu: &'a Gpu,
    /// The meshes of which a block each is in memory at a time.
    sources: &'a [Source<'s>],
    /// Bytes that the query takes beside the blocks.
    beside: u64,
    /// The cuts that the query allows.
    may: May<'a>,
}

impl Refused<'_, '_> {
    /// The error for a block of `tets` tetrahedra (or one of each mesh) that takes about `bytes`, or failed for the
    /// reason `why`, and is not cut again. If that is not the memory, `why` itself is the error.
    fn error(&self, tets: usize, bytes: u64, why: Option<Error>) -> Error {
        if let Some(numbers @ Error::TooLarge(_)) = why {
            return numbers;
        }
        let limit = self.gpu.memory_limit();
        let why = why.map_or_else(String::new, |e| format!(" ({e})"));
        let finer = tets > LEAST && self.sources.iter().any(Source::has_level_wanted);
        let finer = if finer { ", or a finer tree, whose cells cut the mesh into smaller blocks" } else { "" };
        if let Some(enough) = self.enough(limit.max(self.beside)) {
            return Error::TooLarge(format!(
                "{limit} bytes of device memory are too few for blocks of the mesh{why}; allow {enough} bytes or more{finer}"
            ));
        }
        let block = if self.sources.len() == 1 { "a block" } else { "a pair of blocks" };
        let takes = if bytes == u64::MAX { "more than 32-bit indices reach".into() } else { format!("about {bytes} bytes") };
        Error::TooLarge(format!(
            "{limit} bytes of device memory are too few: {block} of {tets} tetrahedra, which is not cut any further, \
             takes {takes}{why}{finer}"
        ))
    }

    /// An amount of memory above `least` in which all blocks fit: the first of a sequence that grows by half.
    fn enough(&self, least: u64) -> Option<u64> {
        const UNIT: u64 = 1 << 16;
        const MOST: u64 = 1 << 50;
        let n = self.sources.len() as u64;
        let fits = |source: &Source<'_>, memory: u64| {
            source.fits_in_blocks(&self.gpu.with_memory(memory), self.beside / n, self.may).unwrap_or(false)
        };
        let next = |memory: &u64| Some((memory.min(&MOST) / 2 * 3).next_multiple_of(UNIT)).filter(|more| more < &MOST);
        std::iter::successors(next(&least), next).find(|memory| self.sources.iter().all(|source| fits(source, memory / n)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::GpuOptions;

    /// More memory would not help a block with more answers than can be numbered.
    #[test]
    fn memory_is_no_remedy_for_a_lack_of_numbers() {
        let gpu = &Gpu::new(&GpuOptions::default()).unwrap().with_memory(1 << 20);
        let refused = |why| Refused { gpu, sources: &[], beside: 0, may: ANYWHERE }.error(500, 100, Some(why)).to_string();
        assert_eq!(refused(Error::TooLarge("2147483648 intersecting pairs".into())), "too large: 2147483648 intersecting pairs");
        let memory = Error::Memory { name: "olbvh.test".into(), bytes: 1 << 21, reason: "none left".into() };
        assert!(refused(memory).contains("1048576 bytes of device memory are too few"));
    }

    #[test]
    fn pieces_fit_and_there_are_two_at_least() {
        assert_eq!([0, 99, 100, 180, 190, 900, 920].map(|need| pieces(need, 100)), [2, 2, 2, 2, 3, 10, 11]);
        assert_eq!([pieces(u64::MAX, 1), pieces(1, 0), pieces(u64::MAX, u64::MAX)], [64, 2, 2]);
    }
}
