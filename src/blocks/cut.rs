//! Cutting a mesh into blocks: boxes of octree cells, and the tetrahedra of each.

use super::size::{Extent, Size};
use super::{LEAST, May, pieces};
use crate::build::{BadCells, DeviceMesh, Tree};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::grid::{CellRange, MAX_LEVEL};
use crate::layout::Grid;
use crate::mesh::{Mesh, On};
use crate::options::{BuildOptions, Fineness, Lists};
use crate::reference::boundary::{Topology, neighbours};
use crate::reference::corners::crowded_vertices;
use crate::reference::depth::measure;
use crate::reference::vertices::Vertices;
use rayon::prelude::*;
use std::borrow::Cow;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A level with at most this many `Aabb` entries per tetrahedron counts as cheap. A body that fills its bounds has 8 at
/// α = 0, and 32 on the next level.
const CHEAP: u64 = 16;

/// A mesh to be cut into blocks.
#[derive(Clone)]
pub(super) struct Source<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) grid: Grid,
    /// Build options, with the level of all trees.
    pub(super) options: BuildOptions,
    pub(super) level: u32,
    /// The level before memory was considered.
    wanted: u32,
    pub(super) topology: Arc<Topology>,
    vertices: Arc<Vertices>,
    /// Crowded vertices. A block may have so few of the tetrahedra there that it would not notice.
    crowded: Arc<Vec<u32>>,
}

/// A set of points of the mesh.
struct Marks(Vec<u32>);

impl Marks {
    fn of(mesh: &Mesh, tets: &[u32]) -> Self {
        let words: Vec<AtomicU32> = (0..mesh.points.len().div_ceil(32)).map(|_| AtomicU32::new(0)).collect();
        let mark = |v: u32| {
            let (word, bit) = (&words[v as usize / 32], 1 << (v % 32));
            // Most bits are already set.
            if word.load(Relaxed) & bit == 0 {
                word.fetch_or(bit, Relaxed);
            }
        };
        tets.par_iter().for_each(|&t| mesh.tets[t as usize].into_iter().for_each(mark));
        Self(words.into_iter().map(AtomicU32::into_inner).collect())
    }

    fn holds(&self, v: u32) -> bool {
        self.0[v as usize / 32] >> (v % 32) & 1 != 0
    }

    fn count(&self) -> u32 {
        self.0.iter().map(|w| w.count_ones()).sum()
    }
}

impl<'a> Source<'a> {
    /// Prepares a mesh for trees with these options, of the level that suits best if memory is no object.
    pub(super) fn new(mesh: &'a Mesh, options: &BuildOptions) -> Result<Self> {
        let topology = Topology::bare(mesh)?;
        let grid = topology.grid;
        let cell = mesh.points.par_iter().map(|&p| grid.quantize(p).map(|q| q as u16)).collect();
        let vertices = Vertices { cell, normalised: Vec::new() };
        let sizes = measure(mesh, &topology, &vertices);
        // Whether lists are long is not known before there is a tree. But where leaves this fine have so few entries,
        // either coarser leaves had long lists, or the finer level costs little.
        let cheap = |level: &u32| options.fineness != Fineness::Alpha && sizes.entries[*level as usize] <= CHEAP * sizes.entries[0];
        let wanted = sizes.level(options)?.max((0..=MAX_LEVEL).rev().find(cheap).unwrap_or(0));
        let level = Some(wanted);
        let options = BuildOptions { level, capacity: Some(u32::MAX), budget: None, fineness: Fineness::Alpha, ..*options };
        let crowded = Arc::new(crowded_vertices(mesh, &grid, &topology.valid));
        let (topology, vertices) = (Arc::new(topology), Arc::new(vertices));
        Ok(Self { mesh, grid, options, level: wanted, wanted, topology, vertices, crowded })
    }

    /// The same mesh, with trees of the finest level, up to the one wanted, that suits the memory limit: the marks of
    /// cells take at most an eighth of it, and a block of the [`LEAST`] largest tetrahedra at most half. On a finer
    /// level, these would have too many candidates for any block with them to fit.
    pub(super) fn within(&self, gpu: &Gpu) -> Result<Self> {
        let memory = gpu.memory_limit();
        let at = |level: u32| BuildOptions { level: Some(level), ..self.options };
        let marks_fit = |level: u32| self.options.lists == Lists::All || 8u64.pow(level) / 8 <= memory / 8;
        let mut level = self.wanted;
        while level > 0 && !(marks_fit(level) && self.largest(level).bytes(gpu, &at(level))? <= memory / 2) {
            level -= 1;
        }
        Ok(Self { level, options: at(level), ..self.clone() })
    }

    /// The size of a block of the [`LEAST`] tetrahedra with the most candidates at a level.
    fn largest(&self, level: u32) -> Size {
        let counts = (0..self.mesh.tets.len() as u32).into_par_iter().filter(|&t| self.topology.is_valid(t));
        let mut counts: Vec<u32> = counts.map(|t| self.vertices.cells(self.mesh.tets[t as usize], level).count()).collect();
        if counts.len() > LEAST {
            counts.select_nth_unstable_by(LEAST, |a, b| b.cmp(a));
            counts.truncate(LEAST);
        }
        let candidates = counts.iter().map(|&n| u64::from(n)).sum();
        Size { points: counts.len() as u32, tets: counts.len(), candidates, entries: candidates, leaves: candidates.min(8u64.pow(level)) }
    }

    /// Whether the memory limit suffices for blocks that leave `beside` bytes of it unused, with cuts that `may` allows
    /// (see [`Self::cut_in_two`]).
    pub(super) fn fits_in_blocks(&self, gpu: &Gpu, beside: u64, may: May<'_>) -> Result<bool> {
        let (source, most) = (self.within(gpu)?, gpu.memory_limit().saturating_sub(beside));
        let mut waiting = vec![source.whole()];
        while let Some(block) = waiting.pop() {
            let need = block.bytes(gpu, &source.options)?;
            if need > most {
                let Some(halves) = source.cut_in_two(&block, pieces(need, most), may) else { return Ok(false) };
                waiting.extend(halves);
            }
        }
        Ok(true)
    }

    /// Whether the trees have the level that suits best, and not a coarser one for want of memory.
    pub(super) fn has_level_wanted(&self) -> bool {
        self.level == self.wanted
    }

    /// The longest side of the bounds.
    pub(super) fn extent(&self) -> f64 {
        (0..3).map(|c| f64::from(self.grid.hi[c]) - f64::from(self.grid.lo[c])).fold(0.0, f64::max)
    }

    /// The octree cell of a point on the trees' level.
    pub(super) fn cell(&self, p: [f32; 3]) -> [u32; 3] {
        self.grid.quantize(p).map(|q| q >> (MAX_LEVEL - self.level))
    }

    /// The whole mesh without its bad tetrahedra, as one block.
    pub(super) fn whole(&self) -> Block {
        let cells = CellRange { lo: [0; 3], hi: [(1 << self.level) - 1; 3] };
        let tets: Vec<u32> = (0..self.mesh.tets.len() as u32).into_par_iter().filter(|&t| self.topology.is_valid(t)).collect();
        self.sized(cells, tets, self.mesh.points.len() as u32)
    }

    fn cells_of(&self, tet: u32) -> CellRange {
        self.vertices.cells(self.mesh.tets[tet as usize], self.level)
    }

    /// Makes the block of `cells` from the tetrahedra `among`.
    fn block(&self, cells: CellRange, among: &[u32]) -> Block {
        let core: Vec<u32> = among.par_iter().copied().filter(|&t| cells.common(&self.cells_of(t)).is_some()).collect();
        let marks = Marks::of(self.mesh, &core);
        // A tetrahedron that shares a face with the core has at least three of its points; the core itself has four.
        let beside = |t: &u32| self.mesh.tets[*t as usize].into_iter().filter(|&v| marks.holds(v)).count() >= 3;
        let tets: Vec<u32> = among.par_iter().copied().filter(beside).collect();
        let points = marks.count() + (tets.len() - core.len()) as u32;
        self.sized(cells, tets, points)
    }

    /// A block of these tetrahedra, which have at most `points` points.
    fn sized(&self, cells: CellRange, tets: Vec<u32>, points: u32) -> Block {
        let extent =
            tets.par_iter().fold(Extent::default, |sum, &t| sum.with(cells, self.cells_of(t))).reduce(Extent::default, Extent::and);
        let size = Size::new(tets.len(), points, &extent, self.options.lists);
        Block { cells, span: extent.span, tets: Rc::new(tets), size }
    }

    /// The neighbours across the faces of each tetrahedron, as in [`crate::reference::boundary::Topology`].
    pub(super) fn neighbours(&self) -> Vec<[u32; 4]> {
        neighbours(self.mesh, &self.topology.valid).0
    }

    /// Cuts a block, which is finally to become `pieces` blocks, in two: with half of its tetrahedra each, or as near
    /// to that as whole numbers of pieces allow. `None` unless it has more than [`LEAST`], and both have fewer. The cut
    /// lies across the longest side where that is possible, after a cell of the finest grid on an axis, both of which
    /// `may` must allow.
    pub(super) fn cut_in_two(&self, block: &Block, pieces: usize, may: May<'_>) -> Option<[Block; 2]> {
        let span = block.span.filter(|_| block.tets.len() > LEAST)?;
        let length = |c: usize| away(&self.grid, self.level, c, span.hi[c] + 1) - away(&self.grid, self.level, c, span.lo[c]);
        let mut axes = [0, 1, 2];
        axes.sort_by(|&a, &b| length(b).total_cmp(&length(a)));
        axes.into_iter().filter(|&c| span.lo[c] < span.hi[c]).find_map(|axis| self.cut_across(block, span, axis, pieces, may))
    }

    /// Cuts a block across an axis, see [`Self::cut_in_two`].
    fn cut_across(&self, block: &Block, span: CellRange, axis: usize, pieces: usize, may: May<'_>) -> Option<[Block; 2]> {
        let none = || vec![0usize; span.size()[axis] as usize];
        let count = |mut numbers: Vec<usize>, &t: &u32| {
            if let Some(cells) = span.common(&self.cells_of(t)) {
                numbers[(cells.lo[axis].midpoint(cells.hi[axis]) - span.lo[axis]) as usize] += 1;
            }
            numbers
        };
        let add = |a: Vec<usize>, b: Vec<usize>| a.iter().zip(b).map(|(a, b)| a + b).collect();
        let numbers = block.tets.par_iter().fold(none, count).reduce(none, add);
        let low_part = numbers.iter().sum::<usize>() * (pieces / 2) / pieces;
        let mut sum = 0;
        let below = numbers.iter().take_while(|n| {
            sum += **n;
            sum < low_part
        });
        let at = (span.lo[axis] + below.count() as u32).min(span.hi[axis] - 1);
        let near = [at, at.saturating_sub(1), at + 1].into_iter().filter(|at| (span.lo[axis]..span.hi[axis]).contains(at));
        near.filter(|at| may(axis, ((at + 1) << (MAX_LEVEL - self.level)) - 1)).find_map(|at| {
            let (mut low, mut high) = (block.cells, block.cells);
            (low.hi[axis], high.lo[axis]) = (at, at + 1);
            let halves = [low, high].map(|cells| self.block(cells, &block.tets));
            halves.iter().all(|h| h.tets.len() < block.tets.len()).then_some(halves)
        })
    }
}

/// The distance of the lower side of cell `k` of a level from the lower corner along axis `c`.
fn away(grid: &Grid, level: u32, c: usize, k: u32) -> f64 {
    if grid.graded != 0 {
        return f64::from(grid.graded_side(c, k << (MAX_LEVEL - level)));
    }
    (f64::from(grid.hi[c]) - f64::from(grid.lo[c])) * f64::from(k) / f64::from(1 << level)
}

/// A box of octree cells and its tetrahedra.
pub(super) struct Block {
    /// The block's own cells; blocks have no cells in common.
    pub(super) cells: CellRange,
    /// The part of `cells` that the core meets.
    span: Option<CellRange>,
    /// The core and its neighbours, ascending.
    pub(super) tets: Rc<Vec<u32>>,
    /// The quantities that its memory depends on.
    size: Size,
}

/// A block or a whole mesh in device memory, with its tree.
pub(super) struct Placed {
    pub(super) mesh: DeviceMesh,
    pub(super) tree: Tree,
    /// For a block, the ids of its points and tetrahedra in the whole mesh.
    ids: Option<[Rc<Vec<u32>>; 2]>,
}

impl Placed {
    /// Uploads the whole mesh and builds its tree.
    pub(super) fn whole(gpu: &Gpu, mesh: &Mesh, options: &BuildOptions) -> Result<Self> {
        let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip)?;
        let tree = Tree::build(gpu, &device, options)?;
        Ok(Self { mesh: device, tree, ids: None })
    }

    /// The id in the whole mesh of tetrahedron `tet` of this block; `NONE` stays `NONE`.
    pub(super) fn tet(&self, tet: u32) -> u32 {
        self.ids.as_ref().and_then(|[_, tets]| tets.get(tet as usize).copied()).unwrap_or(tet)
    }

    /// Whether this is the given block.
    pub(super) fn is(&self, block: &Block) -> bool {
        self.ids.as_ref().is_some_and(|[_, tets]| Rc::ptr_eq(tets, &block.tets))
    }

    /// The part of a field's values that belongs to this block.
    pub(super) fn values<'v, T: Copy + Send + Sync>(&self, values: &'v [T], on: On) -> Cow<'v, [T]> {
        let Some([points, tets]) = &self.ids else { return Cow::Borrowed(values) };
        let ids = if on == On::Points { points } else { tets };
        ids.par_iter().map(|&i| values[i as usize]).collect::<Vec<_>>().into()
    }
}

impl Block {
    /// Estimate of the most bytes in use while the block's tree is built.
    pub(super) fn bytes(&self, gpu: &Gpu, options: &BuildOptions) -> Result<u64> {
        self.size.bytes(gpu, options)
    }

    /// The corners of its cells in the units of the mesh; `None` if they contain nothing.
    pub(super) fn bounds(&self, source: &Source<'_>) -> Option<[[f64; 3]; 2]> {
        let span = self.span?;
        let at = |c: usize, k: u32| f64::from(source.grid.lo[c]) + away(&source.grid, source.level, c, k);
        Some([[0, 1, 2].map(|c| at(c, span.lo[c])), [0, 1, 2].map(|c| at(c, span.hi[c] + 1))])
    }

    /// Extracts the block as a mesh, and the ids of its points.
    fn part(&self, mesh: &Mesh) -> (Mesh, Vec<u32>) {
        let marks = Marks::of(mesh, &self.tets);
        let points: Vec<u32> = (0..mesh.points.len() as u32).into_par_iter().filter(|&v| marks.holds(v)).collect();
        let mut before = Vec::with_capacity(marks.0.len());
        marks.0.iter().fold(0, |sum, word| {
            before.push(sum);
            sum + word.count_ones()
        });
        let rank = |v: u32| before[v as usize / 32] + (marks.0[v as usize / 32] & ((1 << (v % 32)) - 1)).count_ones();
        let tets = self.tets.par_iter().map(|&t| mesh.tets[t as usize].map(rank)).collect();
        (Mesh::new(points.par_iter().map(|&v| mesh.points[v as usize]).collect(), tets), points)
    }

    /// Uploads the block and builds its tree.
    pub(super) fn place(&self, gpu: &Gpu, source: &Source<'_>) -> Result<Placed> {
        let (part, points) = self.part(source.mesh);
        let crowded: Vec<u32> = source.crowded.iter().filter_map(|v| Some(points.binary_search(v).ok()? as u32)).collect();
        let mesh = DeviceMesh::upload_arrays(gpu, &part.points, &part.tets, Some(&source.grid), &crowded)?;
        let tree = Tree::build(gpu, &mesh, &source.options)?;
        Ok(Placed { mesh, tree, ids: Some([Rc::new(points), self.tets.clone()]) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::NONE;
    use crate::mesh::kuhn_jittered;
    use crate::reference::boundary::topology;

    /// Without its neighbours, a core would have boundary tetrahedra at the cuts.
    #[test]
    fn a_core_has_the_neighbours_and_the_boundary_of_the_whole() {
        let mesh = kuhn_jittered([9, 8, 7], 0.2, 3).unwrap();
        let whole = topology(&mesh).unwrap();
        let source = Source::new(&mesh, &BuildOptions::default()).unwrap();
        let [low, high] = source.cut_in_two(&source.whole(), 2, &|_, _| true).unwrap();
        let [a, b] = source.cut_in_two(&low, 2, &|_, _| true).unwrap();
        let (mut checked, mut beside, mut needed) = (0, 0, 0);
        for block in [a, b, high] {
            let part = topology(&block.part(&mesh).0).unwrap();
            for (i, &t) in block.tets.iter().enumerate() {
                if block.cells.common(&source.cells_of(t)).is_none() {
                    beside += 1;
                    continue;
                }
                checked += 1;
                let theirs = part.neighbours[i].map(|n| if n == NONE { n } else { block.tets[n as usize] });
                assert_eq!((theirs, part.is_boundary(i as u32)), (whole.neighbours[t as usize], whole.is_boundary(t)), "{t}");
            }
            let core: Vec<u32> = block.tets.iter().copied().filter(|&t| block.cells.common(&source.cells_of(t)).is_some()).collect();
            let alone = topology(&Block { tets: Rc::new(core.clone()), ..block }.part(&mesh).0).unwrap();
            needed += (0..).zip(&core).filter(|&(i, &t)| alone.is_boundary(i) != whole.is_boundary(t)).count();
        }
        assert!(checked > mesh.tets.len() && beside > 100 && needed > 100, "{checked} {beside} {needed}");
    }
}
