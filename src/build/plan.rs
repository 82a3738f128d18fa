//! Memory of a build: the arrays of the tree, and scratch memory.

use super::prepare::check_tets;
use crate::error::{Error, Result};
use crate::gpu::{Arena, BufferRef, Gpu, Groups};
use crate::grid::MAX_LEVEL;
use crate::layout::{BuildStatus, Grid};
use crate::options::{Assign, BuildOptions, Lists, usual_capacity};
use crate::primitives::{ScanScratch, SortScratch};
pub(crate) use crate::reference::depth::SHARE;

/// Most entries of a tree: an index is a signed word to shaders.
pub(crate) const MAX_ENTRIES: u32 = i32::MAX.cast_unsigned();

/// Sizes that bound a build. A recorded build needs room for at least as many candidates as there are tetrahedra:
/// [`super::BuildScratch::carve`] refuses less.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Cells in the quantized boxes of all tetrahedra, which are the entries of `Aabb`. They take scratch memory only:
    /// where they are filtered, 12 bytes for every 32 candidates.
    pub candidates: u32,
    /// Entries of the chosen assignment and lists. Where there is room for fewer entries than candidates, a recorded
    /// build filters and counts, then goes to the next coarser level until the entries fit. This records up to 17
    /// dispatches for each of a few levels, which are empty once they fit, and as many for a level whose candidates fit,
    /// in case that none of these did. One entry per tetrahedron is enough for a tree over any mesh.
    pub entries: u32,
    /// Nodes.
    pub nodes: u32,
    /// Deepest level.
    pub level: u32,
}

impl Capacity {
    /// Bounds for at most `entries` entries, and as many candidates, down to `level`: `n_n ≤ 1 + Σ min(n_m, 8^k)`
    /// (SPEC 2.4). See [`Capacity::with_candidates`].
    pub fn for_entries(entries: u32, level: u32) -> Self {
        let nodes = (1..=level.min(MAX_LEVEL)).map(|k| u64::from(entries).min(8u64.pow(k))).sum::<u64>() + 1;
        Self { candidates: entries, entries, nodes: u32::try_from(nodes).unwrap_or(u32::MAX - 1), level }
    }

    /// Room for [`usual_capacity`] candidates and 8 entries per tetrahedron, but at least 65,536 of them, which is enough for
    /// most meshes with `Lists::Boundary`; trees over other meshes get coarser.
    pub fn usual(tets: u32, level: u32) -> Self {
        Self { candidates: usual_capacity(tets), ..Self::for_entries(tets.saturating_mul(8).clamp(1 << 16, MAX_ENTRIES), level) }
    }

    /// With room for [`usual_capacity`] candidates where `options` filter them, so that a recorded build is as deep as
    /// its entries allow; otherwise candidates, of which there are several times as many, limit it first. The build's
    /// own options must then have neither capacity nor budget, which limit candidates as well. A capacity of fewer
    /// entries than tetrahedra, which [`super::BuildScratch::carve`] refuses, stays as it is.
    #[must_use]
    pub fn with_candidates(self, tets: u32, options: &BuildOptions) -> Self {
        let more = if filtered(options) && self.entries >= tets { usual_capacity(tets) } else { 0 };
        Self { candidates: self.candidates.max(more), ..self }
    }

    /// The largest capacity down to `level` whose [`TreeMemory`] takes no more than `bytes`, whatever tree is built.
    ///
    /// # Errors
    /// [`crate::Error::TooLarge`] if not even a tree without entries fits.
    pub fn for_bytes(bytes: u64, level: u32, options: &BuildOptions) -> Result<Self> {
        let size = |entries: u32| Arena::measure(|a| TreeMemory::carve(a, &Self::for_entries(entries, level), options));
        if size(0)? > bytes {
            return Err(Error::TooLarge(format!("a tree without entries takes {} bytes down to level {level}, not {bytes}", size(0)?)));
        }
        let (mut fits, mut beyond) = (0, MAX_ENTRIES + 1);
        while fits + 1 < beyond {
            let middle = fits + (beyond - fits) / 2;
            if size(middle).is_ok_and(|needed| needed <= bytes) { fits = middle } else { beyond = middle }
        }
        Ok(Self::for_entries(fits, level))
    }

    /// The coarser levels that a recorded build may filter. On all but the last one the entries may still be too many;
    /// one level up, a surface meets a quarter of the cells.
    pub(crate) fn attempts(&self) -> u32 {
        let quartered = |k: &u32| u64::from(self.entries.max(1)) << (2 * k) >= u64::from(self.candidates);
        (0..self.level).find(quartered).map_or(self.level, |k| k + 1)
    }

    /// Rejects sizes that shaders cannot number.
    pub(crate) fn check(&self, options: &BuildOptions) -> Result<()> {
        if self.level > MAX_LEVEL {
            return Err(Error::Invalid(format!("level {} is beyond {MAX_LEVEL}", self.level)));
        }
        let words = u64::from(self.entries).max(if options.boxes { 6 * u64::from(self.nodes) } else { 0 });
        if words > u64::from(MAX_ENTRIES) {
            let (entries, nodes) = (self.entries, self.nodes);
            return Err(Error::TooLarge(format!(
                "{entries} entries and {nodes} nodes; shaders number {MAX_ENTRIES} words of an array at most: a larger α makes fewer"
            )));
        }
        Ok(())
    }
}

/// The arrays of a tree in device memory (SPEC 2.5): parts of one range in memory of a host; in a [`super::Tree`], `p` has a
/// buffer of its own.
#[derive(Clone, Copy, Debug)]
pub struct TreeMemory {
    /// The assignment of tetrahedra to grid cells.
    pub assign: Assign,
    /// The sizes that the arrays have room for.
    pub capacity: Capacity,
    /// The tetrahedra that a leaf lists.
    pub lists: Lists,
    /// Whether leaves have slabs.
    pub slabs: bool,
    /// [`BuildStatus`]: the sizes of the tree that was built.
    pub status: BufferRef,
    /// [`Grid`] with the level of the leaves.
    pub grid: BufferRef,
    /// Tetrahedron ids in the order of the leaves' Morton codes; with `Lists::Boundary` and few enough tetrahedra, the
    /// bits above an id are the quarters of its entry ([`crate::reference::quarters`]).
    pub p: BufferRef,
    /// Offsets of the leaves' entries in `p` ([`crate::tree::TreeArrays::po`]); behind the last one
    /// the slabs of the leaves ([`crate::tree::TreeArrays::slabs`]), if they have any.
    pub po: BufferRef,
    /// Children of the internal nodes ([`crate::tree::TreeArrays::co`]).
    pub co: BufferRef,
    /// Boundary flags, one bit per node.
    pub flags: BufferRef,
    /// Masks of children, and of the octants of leaves, one byte per node.
    pub masks: BufferRef,
    /// Boxes, 24 bytes per node, if they are stored.
    pub boxes: Option<BufferRef>,
}

impl TreeMemory {
    /// Takes status and grid, which are needed before the sizes of the rest are known.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve_head(arena: &mut Arena) -> Result<(BufferRef, BufferRef)> {
        Ok((arena.take(size_of::<BuildStatus>() as u64)?, arena.take(size_of::<Grid>() as u64)?))
    }

    /// Takes all arrays from an arena.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small or the level too deep, [`crate::Error::TooLarge`] if shaders
    /// cannot number the entries or boxes.
    pub fn carve(arena: &mut Arena, capacity: &Capacity, options: &BuildOptions) -> Result<Self> {
        let head = Self::carve_head(arena)?;
        let p = arena.words(u64::from(capacity.entries))?;
        let nodes = u64::from(capacity.nodes);
        // At least one node is a leaf, so CO covers at most `nodes - 1` internal nodes.
        let internal = if capacity.level == 0 { 0 } else { nodes.saturating_sub(1) };
        let leaves = nodes.min(u64::from(capacity.entries.max(1)));
        Self::carve_nodes(arena, head, p, [nodes, internal, leaves], capacity, options)
    }

    /// Takes the arrays for this many nodes, internal nodes and leaves; status, grid and entries are given.
    pub(crate) fn carve_nodes(
        arena: &mut Arena,
        (status, grid): (BufferRef, BufferRef),
        p: BufferRef,
        [nodes, internal, leaves]: [u64; 3],
        capacity: &Capacity,
        options: &BuildOptions,
    ) -> Result<Self> {
        capacity.check(options)?;
        let BuildOptions { assign, lists, .. } = *options;
        Ok(Self {
            assign,
            capacity: *capacity,
            lists,
            slabs: options.has_slabs(),
            status,
            grid,
            p,
            po: arena.words(leaves + 1 + if options.has_slabs() { leaves } else { 0 })?,
            co: arena.words(internal + 1)?,
            flags: arena.words(nodes.div_ceil(32))?,
            masks: arena.words(nodes.div_ceil(4))?,
            boxes: if options.boxes { Some(arena.words(6 * nodes)?) } else { None },
        })
    }
}

/// Scratch memory of the first half of a build: depth, counts, filter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CountScratch {
    pub(crate) offsets: BufferRef,
    pub(crate) total: BufferRef,
    pub(crate) candidates: BufferRef,
    /// The number of counts: one per tetrahedron and one for the total, or just that.
    pub(crate) live: BufferRef,
    /// Workgroups of the dispatch that counts.
    pub(crate) groups: BufferRef,
    pub(crate) scan: ScanScratch,
}

impl CountScratch {
    /// Takes the scratch memory for a mesh of `tets` tetrahedra.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small, [`crate::Error::TooLarge`] for more tetrahedra than one
    /// mesh may have.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, tets: u32) -> Result<Self> {
        check_tets(tets)?;
        Ok(Self {
            offsets: arena.words(u64::from(tets) + 1)?,
            total: arena.words(1)?,
            candidates: arena.words(1)?,
            live: arena.words(1)?,
            groups: arena.words(3)?,
            scan: ScanScratch::carve(gpu, arena, tets + 1)?,
        })
    }
}

/// Whether candidates have to be tested before they become entries; only the paper's lists take all of them.
pub(crate) fn filtered(options: &BuildOptions) -> bool {
    options.assign != Assign::Aabb || options.lists != Lists::All
}

/// Scratch memory of the filter: two words per share of up to 32 candidates of a tetrahedron; for `Lists::Boundary` a
/// third one, and one bit per cell of the leaves' level.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilterScratch {
    /// Capacity in shares.
    pub(crate) most: u32,
    pub(crate) hits: BufferRef,
    pub(crate) counts: BufferRef,
    pub(crate) entries: BufferRef,
    pub(crate) arguments: BufferRef,
    pub(crate) seeds: Option<SeedScratch>,
    /// Present where the entries may exceed the capacity.
    pub(crate) coarser: Option<CoarserScratch>,
    pub(crate) scan: ScanScratch,
}

impl FilterScratch {
    /// Takes the scratch memory for a mesh of `tets` tetrahedra and for the candidates and the level of `capacity`;
    /// `None` if every candidate is an entry.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, tets: u32, options: &BuildOptions, capacity: &Capacity) -> Result<Option<Self>> {
        if !filtered(options) {
            return Ok(None);
        }
        // All shares of a tetrahedron but its last are full.
        let most = tets.saturating_add(capacity.candidates / SHARE);
        let seeds = if options.lists == Lists::Boundary { Some(SeedScratch::carve(arena, most, capacity.level)?) } else { None };
        Ok(Some(Self {
            most,
            hits: arena.words(u64::from(most))?,
            counts: arena.words(u64::from(most))?,
            entries: arena.words(1)?,
            arguments: arena.words(3)?,
            seeds,
            coarser: if capacity.entries < capacity.candidates { Some(CoarserScratch::carve(arena)?) } else { None },
            scan: ScanScratch::carve(gpu, arena, most)?,
        }))
    }
}

/// Scratch memory to filter coarser levels until the entries fit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoarserScratch {
    /// The number of tetrahedra plus one while another level is to be tried, otherwise 0.
    pub(crate) live: BufferRef,
    /// Workgroups of the three dispatches that such a try takes over tetrahedra.
    pub(crate) groups: BufferRef,
    pub(crate) shares: BufferRef,
    pub(crate) entries: BufferRef,
}

impl CoarserScratch {
    fn carve(arena: &mut Arena) -> Result<Self> {
        Ok(Self { live: arena.words(1)?, groups: arena.words(9)?, shares: arena.words(1)?, entries: arena.words(1)? })
    }
}

/// Additional scratch memory of `Lists::Boundary`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeedScratch {
    /// One bit per cell: the mesh surface may pass through it.
    pub(crate) marks: BufferRef,
    /// Shares with cell centres whose owner needs a closer look; their number is in `doubt_count`.
    pub(crate) doubts: BufferRef,
    pub(crate) doubt_count: BufferRef,
}

impl SeedScratch {
    fn carve(arena: &mut Arena, shares: u32, level: u32) -> Result<Self> {
        let marks = arena.words(8u64.pow(level).div_ceil(32))?;
        Ok(Self { marks, doubts: arena.words(u64::from(shares))?, doubt_count: arena.words(1)? })
    }
}

/// Place of the leaves behind the levels 0 to [`MAX_LEVEL`].
const LEAVES_SLOT: u64 = MAX_LEVEL as u64 + 1;

/// Scratch memory of the second half: codes, sort, splits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SortedScratch {
    pub(crate) codes: BufferRef,
    pub(crate) sort: SortScratch,
    pub(crate) splits: BufferRef,
    /// Length of the table of splits; the total of its scan is in `node_total`.
    pub(crate) table_length: BufferRef,
    pub(crate) node_total: BufferRef,
    /// Workgroups of dispatches over the nodes of each level, then over the leaves, three words each; see
    /// `31_plan_nodes.comp`.
    pub(crate) groups: BufferRef,
    /// Workgroups of the dispatch that emits codes; those of the dispatches over sorted entries are in `arguments`.
    pub(crate) emit_arguments: BufferRef,
    pub(crate) arguments: BufferRef,
    pub(crate) scan: ScanScratch,
}

impl SortedScratch {
    /// Takes the scratch memory for this capacity.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small, [`crate::Error::TooLarge`] for 2^31 entries and more, or
    /// for more counts than shaders can number.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, capacity: &Capacity) -> Result<Self> {
        if capacity.entries > MAX_ENTRIES {
            return Err(Error::TooLarge(format!(
                "{} entries; shaders number {MAX_ENTRIES} at most: a larger α makes fewer",
                capacity.entries
            )));
        }
        let runs = capacity.entries.div_ceil(gpu.target().run.rows);
        let table = u32::try_from(u64::from(runs) * u64::from(capacity.level + 1))
            .map_err(|_| Error::TooLarge(format!("{runs} runs of entries on {} levels; 32 bits number less", capacity.level + 1)))?;
        Ok(Self {
            codes: arena.words(u64::from(capacity.entries))?,
            sort: SortScratch::carve(gpu, arena, capacity.entries, 3 * capacity.level)?,
            splits: arena.words(u64::from(table) + 1)?,
            table_length: arena.words(1)?,
            node_total: arena.words(1)?,
            groups: arena.words(3 * (LEAVES_SLOT + 1))?,
            emit_arguments: arena.words(3)?,
            arguments: arena.words(3)?,
            scan: ScanScratch::carve(gpu, arena, table)?,
        })
    }

    /// The workgroups of a dispatch over the nodes of a level.
    pub fn over_level(&self, level: u32) -> Groups {
        Groups::Indirect(self.groups.part(12 * u64::from(level), 12))
    }

    /// The workgroups of a dispatch over the leaves.
    pub fn over_leaves(&self) -> Groups {
        Groups::Indirect(self.groups.part(12 * LEAVES_SLOT, 12))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filtered_candidates_do_not_limit_the_entries() {
        let (tets, options) = (100_000, BuildOptions::default());
        let sizes = |c: Capacity| [c.candidates, c.entries, c.nodes, c.level];
        let with = |entries: u32, options: &BuildOptions| sizes(Capacity::for_entries(entries, 7).with_candidates(tets, options));
        assert_eq!(with(8 * tets, &options), sizes(Capacity::usual(tets, 7)));
        let whole = Capacity::for_entries(100 * tets, 7);
        assert_eq!(with(100 * tets, &options), sizes(whole));
        let few = Capacity::for_entries(tets - 1, 7);
        assert_eq!(with(tets - 1, &options), sizes(few));
        // Without a filter, candidates are entries.
        let paper = BuildOptions { assign: Assign::Aabb, lists: Lists::All, ..options };
        assert_eq!(with(8 * tets, &paper), sizes(Capacity::for_entries(8 * tets, 7)));
    }
}
