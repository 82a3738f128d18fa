//! Memory of a build: what the tree keeps, and what is scratch.

use crate::error::{Error, Result};
use crate::gpu::{BufferRef, Gpu};
use crate::layout::{BuildStatus, Grid};
use crate::options::{Assign, BuildOptions, Lists, usual_capacity};
use crate::primitives::{Arena, ScanScratch, SortScratch};

/// Most entries of a tree: an index is a signed word to shaders.
pub(crate) const MAX_ENTRIES: u32 = i32::MAX.cast_unsigned();

/// Sizes that bound a build. A recorded one wants room for as many candidates as there are tetrahedra: [`super::BuildScratch::carve`] refuses less.
#[derive(Clone, Copy, Debug)]
pub struct Capacity {
    /// Cells in the quantized boxes of all tetrahedra, the entries of `Aabb`. They take scratch memory only, 12 bytes for every 32 where they are
    /// filtered.
    pub candidates: u32,
    /// Entries of the assignment and the lists chosen. Where there is room for fewer than for candidates, a recorded build filters, counts, and filters the
    /// next coarser level until they fit, which for each level down to the root's takes up to 17 dispatches, empty ones where they fit at once. One entry per
    /// tetrahedron is enough for a tree, whatever the mesh.
    pub entries: u32,
    /// Nodes.
    pub nodes: u32,
    /// Deepest level.
    pub level: u32,
}

impl Capacity {
    /// Bounds for at most `entries` entries down to `level`: `n_n ≤ 1 + Σ min(n_m, 8^k)` (SPEC 2.4).
    pub fn for_entries(entries: u32, level: u32) -> Self {
        let nodes = (1..=level).map(|k| u64::from(entries).min(8u64.pow(k))).sum::<u64>() + 1;
        Self { candidates: entries, entries, nodes: u32::try_from(nodes).unwrap_or(u32::MAX - 1), level }
    }

    /// WorkgroupLimits for [`usual_capacity`] candidates and 8 entries per tetrahedron, which is enough for most meshes with lists where the boundary is; the trees of
    /// others get coarser.
    pub fn usual(tets: u32, level: u32) -> Self {
        Self { candidates: usual_capacity(tets), ..Self::for_entries(tets.saturating_mul(8).min(MAX_ENTRIES), level) }
    }

    /// The largest capacity down to `level` whose [`TreeMemory`] takes no more than `bytes`, so that whatever is built lies within them.
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
            if size(middle)? <= bytes { fits = middle } else { beyond = middle }
        }
        Ok(Self::for_entries(fits, level))
    }
}

/// The arrays of a tree in device memory (SPEC 2.5), parts of one range.
#[derive(Clone, Copy, Debug)]
pub struct TreeMemory {
    /// Which cells list a primitive.
    pub assign: Assign,
    /// What there is room for.
    pub capacity: Capacity,
    /// Which primitives a leaf lists.
    pub lists: Lists,
    /// [`BuildStatus`]: what was built.
    pub status: BufferRef,
    /// [`Grid`] with the level of the leaves.
    pub grid: BufferRef,
    /// Primitive ids by Morton code; where leaves within the mesh have no lists, quarters above them ([`crate::reference::quarters`]).
    pub p: BufferRef,
    /// Ends of the leaves in `p`.
    pub po: BufferRef,
    /// Last children of the internal nodes.
    pub co: BufferRef,
    /// Boundary flags, one bit per node.
    pub flags: BufferRef,
    /// Masks of children, and of the octants of leaves, one byte per node.
    pub masks: BufferRef,
    /// Boxes, 24 bytes per node, where they are stored.
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

    /// Takes all arrays.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(arena: &mut Arena, capacity: &Capacity, options: &BuildOptions) -> Result<Self> {
        let (status, grid) = Self::carve_head(arena)?;
        let nodes = u64::from(capacity.nodes);
        // Leaves are not internal: what is left of the nodes bounds CO.
        let internal = if capacity.level == 0 { 0 } else { nodes - 1 };
        Ok(Self {
            assign: options.assign,
            capacity: *capacity,
            lists: options.lists,
            status,
            grid,
            p: arena.words(u64::from(capacity.entries))?,
            po: arena.words(nodes.min(u64::from(capacity.entries.max(1))) + 1)?,
            co: arena.words(internal + 1)?,
            flags: arena.words(nodes.div_ceil(32))?,
            masks: arena.words(nodes.div_ceil(4))?,
            boxes: if options.boxes { Some(arena.words(6 * nodes)?) } else { None },
        })
    }
}

/// Scratch memory of the first half of a build: depth, counts, filter.
#[derive(Clone, Copy, Debug)]
pub struct CountScratch {
    pub(crate) offsets: BufferRef,
    pub(crate) total: BufferRef,
    pub(crate) candidates: BufferRef,
    pub(crate) scan: ScanScratch,
}

impl CountScratch {
    /// For a mesh of this many tetrahedra.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, tets: u32) -> Result<Self> {
        Ok(Self {
            offsets: arena.words(u64::from(tets) + 1)?,
            total: arena.words(1)?,
            candidates: arena.words(1)?,
            scan: ScanScratch::carve(gpu, arena, tets + 1)?,
        })
    }
}

/// Candidates of one tetrahedron that the filter tests at once.
pub(crate) const SHARE: u32 = 32;

/// Whether candidates have to be tested before they are entries; only the paper's lists take them all.
pub(crate) fn filtered(options: &BuildOptions) -> bool {
    options.assign != Assign::Aabb || options.lists != Lists::All
}

/// Scratch memory of the filter: two words per share of up to 32 candidates of a tetrahedron, and for `Lists::Boundary` another one, and one bit per cell
/// of the level of the leaves.
#[derive(Clone, Copy, Debug)]
pub struct FilterScratch {
    /// Most shares.
    pub(crate) most: u32,
    pub(crate) hits: BufferRef,
    pub(crate) counts: BufferRef,
    pub(crate) entries: BufferRef,
    pub(crate) arguments: BufferRef,
    pub(crate) seeds: Option<SeedScratch>,
    /// Where entries may be too many.
    pub(crate) coarser: Option<CoarserScratch>,
    pub(crate) scan: ScanScratch,
}

impl FilterScratch {
    /// For a mesh of `tets` tetrahedra and the candidates and the level of `capacity`; nothing where every candidate is an entry.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, tets: u32, options: &BuildOptions, capacity: &Capacity) -> Result<Option<Self>> {
        if !filtered(options) {
            return Ok(None);
        }
        // All full but the last one of each.
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

/// What it takes to filter coarser levels until the entries fit.
#[derive(Clone, Copy, Debug)]
pub struct CoarserScratch {
    /// Tetrahedra of the try and one, or 0 where there is none.
    pub(crate) live: BufferRef,
    /// Of its three dispatches over tetrahedra.
    pub(crate) groups: BufferRef,
    pub(crate) shares: BufferRef,
    pub(crate) entries: BufferRef,
}

impl CoarserScratch {
    fn carve(arena: &mut Arena) -> Result<Self> {
        Ok(Self { live: arena.words(1)?, groups: arena.words(9)?, shares: arena.words(1)?, entries: arena.words(1)? })
    }
}

/// What `Lists::Boundary` takes besides.
#[derive(Clone, Copy, Debug)]
pub struct SeedScratch {
    /// One bit per cell that the boundary touches.
    pub(crate) marks: BufferRef,
    /// Shares with centres in doubt, and their number.
    pub(crate) doubts: BufferRef,
    pub(crate) doubt_count: BufferRef,
}

impl SeedScratch {
    fn carve(arena: &mut Arena, shares: u32, level: u32) -> Result<Self> {
        let marks = arena.words(8u64.pow(level).div_ceil(32))?;
        Ok(Self { marks, doubts: arena.words(u64::from(shares))?, doubt_count: arena.words(1)? })
    }
}

/// Scratch memory of the second half: codes, sort, splits.
#[derive(Clone, Copy, Debug)]
pub struct SortedScratch {
    pub(crate) codes: BufferRef,
    pub(crate) sort: SortScratch,
    pub(crate) splits: BufferRef,
    /// Length of the table of splits, and the total of its scan.
    pub(crate) table_length: BufferRef,
    pub(crate) node_total: BufferRef,
    pub(crate) groups: BufferRef,
    /// Of the dispatch that emits codes; of those over sorted entries.
    pub(crate) emit_arguments: BufferRef,
    pub(crate) arguments: BufferRef,
    pub(crate) scan: ScanScratch,
}

impl SortedScratch {
    /// For this many entries and levels.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small, [`crate::Error::TooLarge`] for 2^31 entries and more.
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
            groups: arena.words(36)?,
            emit_arguments: arena.words(3)?,
            arguments: arena.words(3)?,
            scan: ScanScratch::carve(gpu, arena, table)?,
        })
    }
}
