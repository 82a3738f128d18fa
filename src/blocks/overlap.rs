//! Overlap of two meshes in blocks: all pairs of blocks whose cells meet are searched, and the larger block of a pair
//! that does not fit is cut. Intersecting tetrahedra share a point, which lies in the cells of such a pair, so the
//! result is the union of the pairs' results.

use super::cut::{Block, Placed, Source};
use super::size::least_bytes;
use super::{ANYWHERE, InBlocks, Refused, Tried, smaller, try_block, unless_too_large};
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
        self.halves.get_or_init(|| smaller(source, &self.block, 2, ANYWHERE).map(|halves| halves.map(Self::new))).as_ref()
    }

    fn tets(&self) -> usize {
        self.block.tets.len()
    }
}

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
pub fn overlap(gpu: &Gpu, asked: &OverlapRequest<'_>, report: Progress<'_>) -> Result<InBlocks<Overlapped>> {
    let OverlapRequest { meshes, ref options, pairs } = *asked;
    let mut took = InBlocks::default();
    // If the whole turns out not to fit, the progress stays where it is until the blocks have come as far.
    let told = Cell::new(0);
    let tell = |share: f64| {
        told.set(told.get().max((share * 1e6) as u64));
        report(told.get(), 1_000_000)
    };
    // The second construction can use the scratch memory of the first one again. What it adds, the second mesh itself,
    // is half of what it takes at the least.
    if least_bytes(gpu, meshes[0], options)?.saturating_add(least_bytes(gpu, meshes[1], options)? / 2) <= gpu.memory_limit() {
        let found = took.place(gpu, meshes[0], options, 0).and_then(|a| {
            let b = took.place(gpu, meshes[1], options, 1)?;
            query::overlap(&a.tree, &b.tree, pairs, &|done, all| tell(done as f64 / all.max(1) as f64))
        });
        if let Some(found) = unless_too_large(found)? {
            tell(1.0)?;
            return Ok(InBlocks { peak: gpu.memory_peak(), ..took }.with(found));
        }
    }
    let half = &gpu.with_memory(gpu.memory_limit() / 2);
    let [a, b] = meshes.map(|mesh| Source::new(mesh, options)?.within(half));
    let sources = [a?, b?];
    took.bad_cells = sources.each_ref().map(Source::bad_cells);
    let apart = APART * sources.iter().map(Source::extent).sum::<f64>();
    let mut all = Overlapped { overlap: Overlap { pairs: pairs.then(Vec::new), ..Overlap::default() }, ..Overlapped::default() };
    let mut placed: [Option<(Rc<Node>, Placed)>; 2] = [None, None];
    let mut waiting = vec![(sources.each_ref().map(|s| Node::new(s.whole())), 1.0)];
    let mut done = 0.0;
    while let Some((nodes, share)) = waiting.pop() {
        if !meet(&sources, &nodes, apart) {
            done += share;
            tell(done)?;
            continue;
        }
        let mut need = PER_TET * (nodes[0].tets() + nodes[1].tets()) as u64;
        for (node, source) in nodes.iter().zip(&sources) {
            need = need.saturating_add(node.block.bytes(gpu, &source.options)?);
        }
        let tried = try_block(gpu, need, || {
            merge(&mut all, visit(gpu, &sources, &nodes, &mut placed, pairs, &mut took)?);
            Ok(())
        })?;
        let Tried::TooLarge(why) = tried else {
            done += share;
            tell(done)?;
            continue;
        };
        let larger = usize::from(nodes[1].tets() > nodes[0].tets());
        let cut = [larger, 1 - larger].into_iter().find_map(|side| Some((side, nodes[side].halves(&sources[side])?)));
        let Some((side, halves)) = cut else {
            let tets = nodes[0].tets() + nodes[1].tets();
            let refused = Refused { gpu, sources: &sources, beside: PER_TET * tets as u64 + RESERVE, may: ANYWHERE };
            return Err(refused.error(tets, need, why));
        };
        for half in halves {
            let mut next = nodes.clone();
            next[side] = half.clone();
            waiting.push((next, share / 2.0));
        }
    }
    tell(1.0)?;
    let overlap = &mut all.overlap;
    for set in [&mut overlap.a, &mut overlap.b] {
        set.sort_unstable();
        set.dedup();
    }
    if let Some(found) = &mut overlap.pairs {
        found.sort_unstable();
        found.dedup();
    }
    Ok(InBlocks { peak: gpu.memory_peak(), ..took }.with(all))
}

/// Whether the cells of two blocks are near enough for their contents to touch.
fn meet(sources: &[Source<'_>; 2], nodes: &[Rc<Node>; 2], apart: f64) -> bool {
    let bounds = [0, 1].map(|i| nodes[i].block.bounds(&sources[i]));
    let [Some([a_lo, a_hi]), Some([b_lo, b_hi])] = bounds else { return false };
    (0..3).all(|c| a_lo[c] <= b_hi[c] + apart && b_lo[c] <= a_hi[c] + apart)
}

/// The overlap of two blocks, in ids of the whole meshes. A block that is already in device memory is reused.
fn visit(
    gpu: &Gpu,
    sources: &[Source<'_>; 2],
    nodes: &[Rc<Node>; 2],
    placed: &mut [Option<(Rc<Node>, Placed)>; 2],
    pairs: bool,
    took: &mut InBlocks,
) -> Result<Overlapped> {
    for (place, node) in placed.iter_mut().zip(nodes) {
        place.take_if(|(there, _)| !Rc::ptr_eq(there, node));
    }
    for (place, (node, source)) in placed.iter_mut().zip(nodes.iter().zip(sources)) {
        if place.is_none() {
            *place = Some((node.clone(), took.build(|| node.block.place(gpu, source))?));
        }
    }
    let [Some((_, a)), Some((_, b))] = placed else { return Ok(Overlapped::default()) };
    let mut found = query::overlap(&a.tree, &b.tree, pairs, SILENT)?;
    log::debug!("blocks of {} and {} tetrahedra", nodes[0].tets(), nodes[1].tets());
    found.overlap.a.iter_mut().for_each(|t| *t = a.tet(*t));
    found.overlap.b.iter_mut().for_each(|t| *t = b.tet(*t));
    found.overlap.pairs.iter_mut().flatten().for_each(|[s, t]| (*s, *t) = (a.tet(*s), b.tet(*t)));
    Ok(found)
}

fn merge(all: &mut Overlapped, found: Overlapped) {
    all.times.add(found.times);
    all.overlap.a.extend(found.overlap.a);
    all.overlap.b.extend(found.overlap.b);
    if let Some(pairs) = &mut all.overlap.pairs {
        pairs.extend(found.overlap.pairs.into_iter().flatten());
    }
    for (sum, effort) in all.overlap.effort.iter_mut().zip(&found.overlap.effort) {
        sum.add(effort);
    }
}
