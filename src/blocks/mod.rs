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
//!   Without one, what the device refuses is cut.
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
use crate::mesh::Mesh;
use crate::options::BuildOptions;
use cut::{Block, Placed, Source};
use size::least_bytes;
use std::time::Instant;

/// What an answer took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// Number of trees built; 1 per mesh if that fitted as a whole.
    pub trees: u32,
    /// The most bytes that buffers of the given handle took simultaneously ([`Gpu::memory_peak`]).
    pub peak: u64,
    /// Seconds spent on building trees, transfers included.
    pub build_seconds: f64,
    /// Number of bad tetrahedra, which are left out: of the mesh, or of each of two meshes.
    pub bad_cells: [u32; 2],
}

impl Cost {
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

    /// The answer for the only mesh as a whole; `None` if that does not fit.
    fn whole<T>(&mut self, gpu: &Gpu, mesh: &Mesh, options: &BuildOptions, answer: impl FnOnce(&Placed) -> Result<T>) -> Result<Option<T>> {
        let least = least_bytes(gpu, mesh, options)?;
        Ok(attempt(gpu, least, || answer(&self.place(gpu, mesh, options, 0)?))?.ok())
    }

    /// Prepares the only mesh to be cut into blocks.
    fn source<'a>(&mut self, gpu: &Gpu, mesh: &'a Mesh, options: &BuildOptions) -> Result<Source<'a>> {
        let source = Source::new(mesh, options)?.within(gpu)?;
        self.bad_cells[0] = source.topology.counts.bad;
        Ok(source)
    }

    /// With the most memory in use until now.
    fn with_peak(self, gpu: &Gpu) -> Self {
        Self { peak: gpu.memory_peak(), ..self }
    }
}

/// The result of work that takes `need` bytes, or a lack of room for it: the error if it was tried.
fn attempt<T>(gpu: &Gpu, need: u64, work: impl FnOnce() -> Result<T>) -> Result<Result<T, Option<Error>>> {
    if need > gpu.memory_limit() {
        return Ok(Err(None));
    }
    match work() {
        Err(e) if e.is_lack_of_room() => {
            log::info!("in smaller blocks, since this does not fit: {e}");
            Ok(Err(Some(e)))
        }
        done => done.map(Ok),
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

/// Works on blocks, one of each mesh at a time, and cuts those that do not fit.
struct Cutter<'a, const N: usize> {
    gpu: &'a Gpu,
    sources: [&'a Source<'a>; N],
    /// Bytes that the query takes beside the blocks.
    beside: u64,
    /// The cuts that the query allows.
    may: May<'a>,
}

impl Cutter<'_, 1> {
    /// Does the work on a block, or returns its halves if it does not fit.
    fn work_or_halve(&self, block: &Block, work: impl FnOnce() -> Result<()>) -> Result<Option<[Block; 2]>> {
        let [source] = self.sources;
        let need = block.bytes(self.gpu, &source.options)?;
        let halve = || source.cut_in_two(block, pieces(need, self.gpu.memory_limit()), self.may);
        self.work_or_cut(need, block.tets.len(), work, halve)
    }
}

impl<const N: usize> Cutter<'_, N> {
    /// Does the work on blocks of `tets` tetrahedra together, which takes about `need` bytes, or cuts them if it does
    /// not fit.
    fn work_or_cut<T>(
        &self,
        need: u64,
        tets: usize,
        work: impl FnOnce() -> Result<()>,
        cut: impl FnOnce() -> Option<T>,
    ) -> Result<Option<T>> {
        match attempt(self.gpu, need, work)? {
            Ok(()) => Ok(None),
            Err(why) => cut().map(Some).ok_or_else(|| self.refusal(need, tets, why)),
        }
    }

    /// The error for blocks that are not cut again: the reason `why` they failed, if that is not the memory.
    fn refusal(&self, need: u64, tets: usize, why: Option<Error>) -> Error {
        if let Some(numbers @ Error::TooLarge(_)) = why {
            return numbers;
        }
        let limit = self.gpu.memory_limit();
        let why = why.map_or_else(String::new, |e| format!(" ({e})"));
        let finer = tets > LEAST && self.sources.iter().any(|source| source.has_level_wanted());
        let finer = if finer { ", or a finer tree, whose cells cut the mesh into smaller blocks" } else { "" };
        if let Some(enough) = self.enough(limit.max(self.beside)) {
            return Error::TooLarge(format!(
                "{limit} bytes of device memory are too few for blocks of the mesh{why}; allow {enough} bytes or more{finer}"
            ));
        }
        let block = if N == 1 { "a block" } else { "a pair of blocks" };
        let takes = if need == u64::MAX { "more than 32-bit indices reach".into() } else { format!("about {need} bytes") };
        Error::TooLarge(format!(
            "{limit} bytes of device memory are too few: {block} of {tets} tetrahedra, which is not cut any further, \
             takes {takes}{why}{finer}"
        ))
    }

    /// An amount of memory above `least` in which all blocks fit: the first of a sequence that grows by half.
    fn enough(&self, least: u64) -> Option<u64> {
        const UNIT: u64 = 1 << 16;
        const MOST: u64 = 1 << 50;
        let n = N as u64;
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
        let cutter = Cutter { gpu, sources: [], beside: 0, may: ANYWHERE };
        let refused = |why| cutter.work_or_cut(100, 500, || Err(why), || None::<()>).unwrap_err().to_string();
        assert_eq!(refused(Error::TooLarge("2147483648 intersecting pairs".into())), "too large: 2147483648 intersecting pairs");
        let memory = Error::Memory { name: "olbvh.test".into(), bytes: 1 << 21, reason: "none left".into() };
        assert!(refused(memory).contains("1048576 bytes of device memory are too few"));
        assert_eq!(cutter.enough(u64::MAX), None);
    }

    #[test]
    fn pieces_fit_and_there_are_two_at_least() {
        assert_eq!([0, 99, 100, 180, 190, 900, 920].map(|need| pieces(need, 100)), [2, 2, 2, 2, 3, 10, 11]);
        assert_eq!([pieces(u64::MAX, 1), pieces(1, 0), pieces(u64::MAX, u64::MAX)], [64, 2, 2]);
    }
}
