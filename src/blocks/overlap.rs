//! Overlap of two meshes in blocks: all pairs of blocks whose cells meet are searched, and the larger block of a pair
//! that does not fit is cut. Intersecting tetrahedra share a point, which lies in the cells of such a pair, so the
//! result is the union of the pairs' results.

use super::cut::{Block, Placed, Source};
use super::size::least_bytes;
use super::{ANYWHERE, Cost, Cutter, attempt};
use crate::build::Tree;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::mesh::Mesh;
use crate::options::BuildOptions;
use crate::query::{self, Overlapped, Progress, SILENT};
use crate::reference::overlap::Overlap;
use std::cell::{Cell, OnceCell};
use std::rc::Rc;

/// Bytes per tetrahedron of both meshes that the search takes ([`query::OverlapMemory`], [`query::PairMemory`]).
const PER_TET: u64 = 28;
/// Further bytes that the search takes.
const RESERVE: u64 = 1 << 16;
/// The largest distance, relative to the sum of the meshes' extents, between blocks that are searched: pairs of
/// tetrahedra count as touching if nearer than 1e-6 of the diagonal.
const APART: f64 = 4e-6;

/// A block, and its halves once they are needed.
struct Node {
    block: Block,
    halves: OnceCell<Option<[Rc<Node>; 2]>>,
}

impl Node {
    fn new(block: Block) -> Rc<Self> {
        Rc::new(Self { block, halves: OnceCell::new() })
    }

    fn halves(&self, source: &Source<'_>) -> Option<&[Rc<Self>; 2]> {
        self.halves.get_or_init(|| source.cut_in_two(&self.block, 2, ANYWHERE).map(|halves| halves.map(Self::new))).as_ref()
    }

    fn tets(&self) -> usize {
        self.block.tets.len()
    }
}

/// A block of each mesh.
type Pair = [Rc<Node>; 2];

/// Two meshes, which may not fit the device, and what to find.
#[derive(Clone, Copy, Debug)]
pub struct OverlapRequest<'a> {
    /// A and B, with points in one coordinate system.
    pub meshes: [&'a Mesh; 2],
    /// Options of their trees.
    pub options: BuildOptions,
    /// Whether to find all pairs.
    pub pairs: bool,
}

/// Computes the overlap of A and B, as [`query::overlap`] does, within the memory limit of `gpu`. Pairs that are nearer
/// to touching than 1e-6 of the scene's diagonal may be counted or not, depending on the blocks. The reported effort is
/// the sum over all pairs of blocks. `report` receives how many millionths of the work are done, and a
/// million.
///
/// # Errors
/// Those of [`query::overlap`] and [`crate::build::Tree::build`]; [`crate::Error::TooLarge`] with the sizes if the
/// memory is too small for the smallest blocks.
pub fn overlap(gpu: &Gpu, asked: &OverlapRequest<'_>, report: Progress<'_>) -> Result<(Overlapped, Cost)> {
    let OverlapRequest { meshes, ref options, pairs } = *asked;
    let mut cost = Cost::default();
    // If the whole turns out not to fit, the progress stays where it is until the blocks have come as far.
    let told = Cell::new(0);
    let tell = |share: f64| {
        told.set(told.get().max((share * 1e6) as u64));
        report(told.get(), 1_000_000)
    };
    // The second construction can use the scratch memory of the first one again. What it adds, the second mesh itself,
    // is half of what it takes at the least.
    let least = least_bytes(gpu, meshes[0], options)?.saturating_add(least_bytes(gpu, meshes[1], options)? / 2);
    let whole = attempt(gpu, least, || {
        let a = cost.place(gpu, meshes[0], options, 0)?;
        let b = cost.place(gpu, meshes[1], options, 1)?;
        find(pairs)(&a.tree, &b.tree, &|done, all| tell(done as f64 / all.max(1) as f64))
    })?;
    let found = if let Ok(found) = whole { found } else { in_blocks(gpu, asked, &tell, &mut cost)? };
    tell(1.0)?;
    Ok((found, cost.with_peak(gpu)))
}

/// The query of a whole tree.
fn find(pairs: bool) -> fn(&Tree, &Tree, Progress<'_>) -> Result<Overlapped> {
    if pairs { query::overlap_pairs } else { query::overlap }
}

/// The overlap of all pairs of blocks. `tell` receives the share of the work that is done.
fn in_blocks(gpu: &Gpu, asked: &OverlapRequest<'_>, tell: &dyn Fn(f64) -> Result<()>, cost: &mut Cost) -> Result<Overlapped> {
    let OverlapRequest { meshes, ref options, pairs } = *asked;
    let half = &gpu.with_memory(gpu.memory_limit() / 2);
    let [a, b] = meshes.map(|mesh| Source::new(mesh, options)?.within(half));
    let sources = [a?, b?];
    cost.bad_cells = sources.each_ref().map(|source| source.topology.counts.bad);
    let apart = APART * sources.iter().map(Source::extent).sum::<f64>();
    let mut all = Overlapped { overlap: Overlap { pairs: pairs.then(Vec::new), ..Overlap::default() }, ..Overlapped::default() };
    let mut placed = [None, None];
    let mut waiting = vec![(sources.each_ref().map(|s| Node::new(s.whole())), 1.0)];
    let mut done = 0.0;
    while let Some((nodes, share)) = waiting.pop() {
        let work = || visit(gpu, &sources, &nodes, &mut placed, &mut all, cost);
        match if meet(&sources, &nodes, apart) { work_or_cut(gpu, &sources, &nodes, work)? } else { None } {
            None => {
                done += share;
                tell(done)?;
            }
            Some(halves) => waiting.extend(halves.map(|nodes| (nodes, share / 2.0))),
        }
    }
    let overlap = &mut all.overlap;
    for set in [&mut overlap.a, &mut overlap.b] {
        set.sort_unstable();
        set.dedup();
    }
    if let Some(found) = &mut overlap.pairs {
        found.sort_unstable();
        found.dedup();
    }
    Ok(all)
}

/// Whether the cells of two blocks are near enough for their contents to touch.
fn meet(sources: &[Source<'_>; 2], nodes: &Pair, apart: f64) -> bool {
    let bounds = [0, 1].map(|i| nodes[i].block.bounds(&sources[i]));
    let [Some([a_lo, a_hi]), Some([b_lo, b_hi])] = bounds else { return false };
    (0..3).all(|c| a_lo[c] <= b_hi[c] + apart && b_lo[c] <= a_hi[c] + apart)
}

/// Does the work on two blocks. If they do not fit, cuts the larger one, or else the other one, and returns the pairs
/// that its halves make.
fn work_or_cut(gpu: &Gpu, sources: &[Source<'_>; 2], nodes: &Pair, work: impl FnOnce() -> Result<()>) -> Result<Option<[Pair; 2]>> {
    let tets = nodes[0].tets() + nodes[1].tets();
    let search = PER_TET * tets as u64;
    let mut need = search;
    for (node, source) in nodes.iter().zip(sources) {
        need = need.saturating_add(node.block.bytes(gpu, &source.options)?);
    }
    let larger = usize::from(nodes[1].tets() > nodes[0].tets());
    let with = |side: usize, half: &Rc<Node>| [0, 1].map(|i| if i == side { half } else { &nodes[i] }.clone());
    let halve = |side: usize| Some(nodes[side].halves(&sources[side])?.each_ref().map(|half| with(side, half)));
    let cutter = Cutter { gpu, sources: sources.each_ref(), beside: search + RESERVE, may: ANYWHERE };
    cutter.work_or_cut(need, tets, work, || halve(larger).or_else(|| halve(1 - larger)))
}

/// Adds the overlap of two blocks to that of all. A block that is already in device memory is reused.
fn visit(
    gpu: &Gpu,
    sources: &[Source<'_>; 2],
    nodes: &Pair,
    placed: &mut [Option<Placed>; 2],
    all: &mut Overlapped,
    cost: &mut Cost,
) -> Result<()> {
    for (place, node) in placed.iter_mut().zip(nodes) {
        place.take_if(|there| !there.is(&node.block));
    }
    for (place, (node, source)) in placed.iter_mut().zip(nodes.iter().zip(sources)) {
        if place.is_none() {
            *place = Some(cost.build(|| node.block.place(gpu, source))?);
        }
    }
    let [Some(a), Some(b)] = placed else { return Ok(()) };
    let Overlapped { overlap: found, times } = find(all.overlap.pairs.is_some())(&a.tree, &b.tree, SILENT)?;
    log::debug!("blocks of {} and {} tetrahedra", nodes[0].tets(), nodes[1].tets());
    all.times.add(times);
    all.overlap.a.extend(found.a.into_iter().map(|t| a.tet(t)));
    all.overlap.b.extend(found.b.into_iter().map(|t| b.tet(t)));
    if let Some(pairs) = &mut all.overlap.pairs {
        pairs.extend(found.pairs.into_iter().flatten().map(|[s, t]| [a.tet(s), b.tet(t)]));
    }
    for (sum, effort) in all.overlap.effort.iter_mut().zip(&found.effort) {
        sum.add(effort);
    }
    Ok(())
}
