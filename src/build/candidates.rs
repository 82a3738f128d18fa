//! Stage 2, candidates: counts them, decides which are entries, and goes to coarser levels until the entries fit.

use super::plan::{Capacity, CoarserScratch, CountScratch, FilterScratch, SeedScratch, filtered};
use super::prepare::{MeshArrays, MeshInput};
use super::stages::Build;
use crate::error::Result;
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{Count as CountCells, CountSpec, Filter, FilterSpec, Fit, FitSpec, Mark, MarkSpec, SettleSeeds, SettleSeedsSpec};
use crate::primitives::{Count, cmd_exclusive_scan};

/// What is counted and filtered: all tetrahedra at the chosen level, or at a coarser one if that is to be tried.
#[derive(Clone, Copy)]
struct Over {
    /// The word that receives the number of shares.
    total: BufferRef,
    coarser: Option<CoarserScratch>,
    /// The marks to be cleared, those of the level that is counted.
    marks: Option<BufferRef>,
}

impl Over {
    fn all(scratch: &CountScratch, marks: Option<BufferRef>) -> Self {
        Self { total: scratch.total, coarser: None, marks }
    }

    /// The workgroups of a dispatch that filters `items` items; `slot` is its place among the three dispatches that [`Fit`]
    /// plans.
    fn groups(&self, slot: u64, items: u32, workgroup: u32) -> Groups {
        self.coarser.map_or(Groups::Count(items.div_ceil(workgroup)), |coarser| Groups::Indirect(coarser.groups.part(12 * slot, 12)))
    }
}

impl Build<'_> {
    /// Stage 2, first part: the number of candidates of every tetrahedron (or of shares of them, where they are
    /// filtered), and the offset of its first. Where there is memory for them, marks are cleared in passing: as many as
    /// the level has, which only the device knows.
    pub fn count(&self, r: &mut Recorder<'_>) -> Result<()> {
        r.stage("build.count", |r| self.count_candidates(r, Over::all(self.counts, self.marks())))
    }

    /// Bits of the cells that the surface may pass through.
    pub(super) fn marks(&self) -> Option<BufferRef> {
        self.filter.and_then(|f| f.seeds).map(|seeds| seeds.marks)
    }

    /// Stage 2 where not every candidate is an entry: decides which are; their number goes to `filter.entries`. Marks
    /// that had no memory yet when candidates were counted are not `cleared`.
    pub fn filter(&self, r: &mut Recorder<'_>, cleared: bool) -> Result<()> {
        let Some(filter) = self.filter else { return Ok(()) };
        r.stage("build.filter", |r| {
            if let (false, Some(marks)) = (cleared, self.marks()) {
                r.fill(marks, 0);
            }
            self.filter_candidates(r, filter, Over::all(self.counts, None))
        })
    }

    /// Stage 2, where entries may exceed the capacity: counts and filters coarser levels until the entries fit.
    pub fn fit(&self, r: &mut Recorder<'_>, capacity: &Capacity) -> Result<()> {
        let Some((filter, coarser)) = self.filter.and_then(|f| Some((f, f.coarser?))) else { return Ok(()) };
        let (Self { grid, status, counts, .. }, tets) = (*self, self.mesh.input.tets);
        let attempts = capacity.attempts();
        let CoarserScratch { live, groups, shares: tried_shares, entries: tried_entries } = coarser;
        let (shares, entries, capacity) = (counts.total, filter.entries, capacity.entries);
        let fit = |attempt: u32| {
            let (first, last) = (u32::from(attempt == 0), u32::from(attempt + 1 == attempts));
            Fit { grid, status, shares, entries, tried_shares, tried_entries, live, groups, tets, capacity, first, last }
        };
        let spec = FitSpec { workgroup: r.gpu().subgroup_size(), each: r.gpu().target().each, ..Default::default() };
        let over = Over { total: tried_shares, coarser: Some(coarser), marks: self.marks() };
        r.stage("build.fit", |r| {
            r.barrier("codes.scan → fit");
            r.dispatch(&fit(0), spec, Groups::Count(1))?;
            for attempt in 1..=attempts {
                r.barrier("fit → codes.count");
                self.count_candidates(r, over)?;
                self.filter_candidates(r, filter, over)?;
                r.dispatch(&fit(attempt), spec, Groups::Count(1))?;
            }
            r.barrier("fit → codes.emit");
            Ok(())
        })
    }

    fn count_candidates(&self, r: &mut Recorder<'_>, over: Over) -> Result<()> {
        let Self { mesh, options, grid, counts: scratch, .. } = *self;
        let MeshInput { cells, tets, .. } = mesh.input;
        let (workgroup, offsets) = (r.gpu().target().each, scratch.offsets);
        let marks = over.marks.unwrap_or_else(|| r.gpu().nothing());
        let (live, groups) = over.coarser.map_or((scratch.live, scratch.groups), |coarser| (coarser.live, coarser.groups));
        let (vertices, bad) = (mesh.arrays.vertices, mesh.arrays.bad);
        let count = CountCells { grid, vertices, cells, bad, counts: offsets, marks, live, tets };
        let (in_shares, clear) = (u32::from(filtered(options)), u32::from(over.marks.is_some()));
        let spec = CountSpec { workgroup, in_shares, clear, ..Default::default() };
        r.dispatch(&count, spec, Groups::Indirect(groups.part(0, 12)))?;
        let all = Count::device(tets + 1, live);
        cmd_exclusive_scan(r, offsets, offsets, over.total, all, &scratch.scan)
    }

    fn filter_candidates(&self, r: &mut Recorder<'_>, filter: &FilterScratch, over: Over) -> Result<()> {
        let Self { mesh, options, grid, counts: scratch, .. } = *self;
        let MeshInput { cells, tets, .. } = mesh.input;
        let workgroup = r.gpu().target().each;
        if let Some(seeds) = &filter.seeds {
            r.fill(seeds.doubt_count, 0);
        }
        let all = Count::device(filter.most, over.total);
        let later = all.behind(tets).groups(r, workgroup, filter.arguments, "filter.shares → codes.mark")?;
        let nothing = r.gpu().nothing();
        let SeedScratch { marks, doubts, doubt_count } =
            filter.seeds.unwrap_or(SeedScratch { marks: nothing, doubts: nothing, doubt_count: nothing });
        let MeshArrays { bad, vertices, boundary, neighbours, .. } = mesh.arrays;
        let (offsets, shares, capacity) = (scratch.offsets, over.total, filter.most);
        let (hits, counts) = (filter.hits, filter.counts);
        if filter.seeds.is_some() {
            let mark = Mark { grid, vertices, cells, bad, offsets, shares, marks, boundary, tets, capacity };
            // A word of bits per invocation, or a part of one where invocations are plenty and should not wait for others.
            let (each, slot) = if r.gpu().target().is_processor() { (32, 1) } else { (8, 2) };
            let spec = MarkSpec { workgroup, assign: options.assign as u32, tets_each: each, ..Default::default() };
            r.dispatch(&mark, spec, over.groups(slot, tets.div_ceil(each), workgroup))?;
            r.barrier("codes.mark → codes.mark_later");
            r.dispatch(&mark, MarkSpec { later: 1, ..spec }, later)?;
            r.barrier("codes.mark → codes.filter");
        }
        let arguments =
            Filter { grid, vertices, cells, bad, offsets, shares, hits, counts, marks, boundary, doubts, doubt_count, tets, capacity };
        let spec = FilterSpec { workgroup, assign: options.assign as u32, lists: u32::from(filter.seeds.is_some()), ..Default::default() };
        r.dispatch(&arguments, spec, over.groups(2, tets, workgroup))?;
        r.barrier("codes.filter → codes.filter_later");
        r.dispatch(&arguments, FilterSpec { later: 1, ..spec }, later)?;
        if filter.seeds.is_some() {
            r.barrier("codes.filter → codes.doubts");
            let doubtful = Count::device(capacity, doubt_count).groups(r, workgroup, filter.arguments, "codes.doubts → codes.settle")?;
            let settle = SettleSeeds {
                grid,
                vertices,
                cells,
                bad,
                offsets,
                hits,
                counts,
                marks,
                neighbours,
                doubts,
                doubt_count,
                shares,
                tets,
                capacity,
            };
            r.dispatch(&settle, SettleSeedsSpec { workgroup, later: 1, ..Default::default() }, doubtful)?;
        }
        let entries = over.coarser.map_or(filter.entries, |coarser| coarser.entries);
        cmd_exclusive_scan(r, counts, counts, entries, all, &filter.scan)
    }
}
