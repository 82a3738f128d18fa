//! Meshes that do not fit the device's memory, in blocks: built, asked and dropped one after the other, each within the bytes that may be used.
//!
//! Blocks divide the cells of the tree's level, a box of them each, cut in two by numbers of tetrahedra. A block has its *core*, every
//! tetrahedron that meets its cells, and around it the tetrahedra that share a face with the core. So every leaf over the block's own cells lists what it
//! lists in the tree over the whole mesh, and has the same boundary flag: neighbours of the core are all there. The ids of points and tetrahedra keep their
//! order, the grid is that of the whole mesh, and the level is the whole tree's ([`crate::options::BuildOptions::level`]). Hence each point is asked of one block,
//! and **answers are those of the whole tree**, tolerance and gaps between cells included.
//!
//! - A voxel has its centre in one block, and its box may reach into several: each names the closest primitive that it lists in its own cells.
//! - A sample of a ray lies in one block, and those of a block follow each other. Blocks are drawn front to back.
//! - Two meshes overlap where their blocks do.
//!
//! - A mesh that fits is not cut. Whether a block fits is estimated first; what turns out larger is given up and cut again.
//! - The limit is kept by [`Gpu::with_memory`], which counts every buffer, transfers included.
//! - The mesh itself lies in host memory as a whole, and beside it 6 bytes per point and 4 per tetrahedron; for a picture normals (12 bytes per point), rays
//!   (48 bytes), and before it is drawn neighbours (16 bytes per tetrahedron, about three times that while they are matched).
//! - The level may be coarser than asked for where the bits of its cells would take more than an eighth of the memory, and finer where lists may be long
//!   ([`crate::options::BuildOptions::fineness`]): a plate would be one cell, which cannot be cut. In cells that overlap each other
//!   [`crate::options::Lists::Boundary`] may name another of those that contain a point, as always.

mod cut;
mod locate;
mod overlap;
mod render;
mod slice;

pub use locate::{Points, locate, locate_all};
pub use overlap::{Meshes, overlap};
pub use render::{Picture, View, render};
pub use slice::{Stack, slice};

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::mesh::{Mesh, On};
use cut::{Block, Source};
use std::time::Instant;

/// An answer, and what it took.
#[derive(Clone, Debug, Default)]
pub struct InBlocks<T = ()> {
    /// The same as of the whole mesh.
    pub answer: T,
    /// Trees that were built for it; 1 per mesh where it fitted as a whole.
    pub trees: u32,
    /// The most bytes of device memory in use at once.
    pub peak: u64,
    /// Seconds for the trees, transfers included.
    pub build_seconds: f64,
}

impl<T> InBlocks<T> {
    /// The answer, and the rest.
    pub fn into_parts(self) -> (T, InBlocks) {
        let Self { answer, trees, peak, build_seconds } = self;
        (answer, InBlocks { answer: (), trees, peak, build_seconds })
    }
}

impl InBlocks {
    /// With an answer.
    #[must_use]
    pub fn with<T>(self, answer: T) -> InBlocks<T> {
        InBlocks { answer, trees: self.trees, peak: self.peak, build_seconds: self.build_seconds }
    }

    /// Builds a tree and says what it took.
    fn build<T>(&mut self, build: impl FnOnce() -> Result<T>) -> Result<T> {
        let start = Instant::now();
        let built = build()?;
        self.trees += 1;
        self.build_seconds += start.elapsed().as_secs_f64();
        Ok(built)
    }
}

/// Tetrahedra of a block that is not cut again.
const LEAST: usize = 1024;

/// How many blocks to make of one that takes `need` bytes where there are `memory`: as few as will do, each with a tenth to spare, since what lies where blocks
/// are cut is in both. At least two, so that no block is left as it is.
fn pieces(need: u64, memory: u64) -> usize {
    (u128::from(need) * 11).div_ceil(u128::from(memory.max(1)) * 10).clamp(2, 64) as usize
}

/// The parts of a block that is worth being cut, which is to become so many.
fn smaller(source: &Source<'_>, block: &Block, pieces: usize) -> Option<[Block; 2]> {
    if block.tets.len() > LEAST { source.cut_in_two(block, pieces, &|_, _| true) } else { None }
}

/// Refuses a field that is not the mesh's.
fn check_field(mesh: &Mesh, field: Option<(&[f32], On)>) -> Result<()> {
    field.map_or(Ok(()), |(values, on)| on.check(values, [mesh.points.len(), mesh.tets.len()]))
}

/// Why there is no answer: a block of `tets` tetrahedra takes about `bytes`, or more than there are, and is not cut again.
fn refusal(gpu: &Gpu, tets: usize, bytes: u64, why: Option<Error>) -> Error {
    let why = why.map_or_else(String::new, |e| format!(" ({e})"));
    let limit = gpu.memory_limit();
    let enough = bytes.max(limit + limit / 2);
    let finer = if tets > LEAST { ", or a finer tree, whose cells cut the mesh in smaller blocks" } else { "" };
    Error::TooLarge(format!(
        "{limit} bytes of device memory are too few for a block of {tets} tetrahedra{why}; allow {enough} or more{finer}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_fit_and_there_are_two_at_least() {
        assert_eq!([0, 99, 100, 180, 190, 900, 920].map(|need| pieces(need, 100)), [2, 2, 2, 2, 3, 10, 11]);
        assert_eq!([pieces(u64::MAX, 1), pieces(1, 0), pieces(u64::MAX, u64::MAX)], [64, 2, 2]);
    }
}
