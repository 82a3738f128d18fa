//! The stages of a build, which append to a recorder. Those that choose the entries are in [`super::candidates`];
//! [`super`] calls them in order.

use super::plan::{Capacity, CountScratch, FilterScratch, SortedScratch, TreeMemory, filtered};
use super::prepare::{MeshInput, MeshView, summing_tile};
use crate::error::Result;
use crate::gpu::{BufferRef, Groups, Recorder};
use crate::kernels::{
    ChooseDepth, ChooseDepthSpec, CountSplits, CountSplitsSpec, Emit, EmitHits, EmitHitsSpec, EmitSpec, EmitSplits, EmitSplitsSpec,
    EstimateDepth, EstimateDepthSpec, FinishLeaves, FinishLeavesSpec, FitSlabs, FitSlabsSpec, FlagLeaves, FlagLeavesSpec, MarkQuarters,
    MarkQuartersSpec, MergeLevel, MergeLevelSpec, PlanNodes, PlanNodesSpec,
};
use crate::layout::{BuildStatus, Grid, NONE};
use crate::options::{BuildOptions, LEAST_USUAL, USUAL_ENTRIES};
use crate::primitives::{Count, Unsorted, cmd_exclusive_scan, cmd_sort};
use crate::tree::stored::id_mask;

/// A build under way: what its stages share.
#[derive(Clone, Copy)]
pub(crate) struct Build<'a> {
    pub mesh: &'a MeshView,
    pub options: &'a BuildOptions,
    /// [`BuildStatus`] and [`Grid`] of the tree.
    pub status: BufferRef,
    pub grid: BufferRef,
    pub counts: &'a CountScratch,
    /// `None`: every candidate is an entry.
    pub filter: Option<&'a FilterScratch>,
}

impl Build<'_> {
    /// Stage 1: chooses the level of the leaves (§3.2; SPEC 2.4), at most `deepest` and with at most `most_candidates`
    /// candidates, and writes it to grid and status.
    pub fn depth(&self, r: &mut Recorder<'_>, most_candidates: u32, deepest: u32) -> Result<()> {
        let Self { mesh, options, status, grid, counts, .. } = *self;
        let MeshInput { positions, stride, cells, tets, .. } = mesh.input;
        let workgroup = r.gpu().target().each;
        let (alpha, requested) = (options.alpha_fixed()?, options.checked_level()?.unwrap_or(NONE));
        let capacity = options.capacity.unwrap_or(u32::MAX).min(most_candidates);
        let (per_tet, ample) = if options.capacity.is_some() { (u32::MAX, u32::MAX) } else { (USUAL_ENTRIES, LEAST_USUAL) };
        let words = options.budget.map_or(u64::MAX, |bytes| bytes / 4);
        let (budget, box_words) = ([words as u32, (words >> 32) as u32], if options.boxes { 6 } else { 0 });
        let slab_words = u32::from(options.has_slabs());
        r.stage("build.depth", |r| {
            r.fill(status.part(0, size_of::<BuildStatus>() as u64), 0);
            r.copy(mesh.arrays.grid.part(0, size_of::<Grid>() as u64), grid);
            r.barrier("depth.clear → depth.estimate");
            let tile = summing_tile(tets, workgroup);
            let estimate = EstimateDepth { grid, positions, cells, bad: mesh.arrays.bad, status, tets, stride, tile };
            r.dispatch(&estimate, EstimateDepthSpec { workgroup, ..Default::default() }, Groups::Count(tets.div_ceil(tile)))?;
            r.barrier("depth.estimate → depth.choose");
            let once = ChooseDepthSpec { workgroup: r.gpu().subgroup_size(), each: workgroup, ..Default::default() };
            let CountScratch { candidates, live, groups, .. } = *counts;
            let choose = ChooseDepth {
                mesh: mesh.arrays.status,
                grid,
                status,
                candidates,
                live,
                groups,
                tets,
                alpha,
                requested,
                capacity,
                per_tet,
                ample,
                deepest,
                budget,
                box_words,
                slab_words,
                in_shares: u32::from(filtered(options)),
                marked: u32::from(self.marks().is_some()),
            };
            r.dispatch(&choose, once, Groups::Count(1))?;
            r.barrier("depth.choose → codes.count");
            Ok(())
        })
    }

    /// The number of entries, in device memory.
    pub fn entries(&self, capacity: &Capacity) -> Count {
        Count::device(capacity.entries, self.filter.map_or(self.counts.candidates, |f| f.entries))
    }

    /// Stage 2, second part: codes of all entries, and their tetrahedron ids, which go to `ids`, sorted by code.
    pub fn codes(&self, r: &mut Recorder<'_>, ids: BufferRef, capacity: &Capacity, scratch: &SortedScratch) -> Result<()> {
        let Self { mesh, grid, counts, filter, .. } = *self;
        let MeshInput { cells, tets, .. } = mesh.input;
        let (vertices, bad) = (mesh.arrays.vertices, mesh.arrays.bad);
        let (offsets, candidates) = (counts.offsets, counts.candidates);
        let target = r.gpu().target();
        let pairs = Unsorted::place(r.gpu(), (scratch.codes, ids), 3 * capacity.level, capacity.entries, &scratch.sort);
        let Unsorted { keys: codes, values: ids, .. } = pairs;
        r.stage("build.emit", |r| {
            if let Some(filter) = filter {
                let shares = Count::device(filter.most, counts.total);
                let later = shares.behind(tets).arguments(r, target.each, filter.arguments)?;
                if filter.coarser.is_none() {
                    r.barrier("codes.filter → codes.emit");
                }
                let (hits, places) = (filter.hits, filter.counts);
                let emit = EmitHits {
                    grid,
                    vertices,
                    cells,
                    bad,
                    offsets,
                    shares: counts.total,
                    hits,
                    places,
                    codes,
                    ids,
                    tets,
                    capacity: filter.most,
                    room: capacity.entries,
                };
                let spec = EmitHitsSpec { workgroup: target.each, ..Default::default() };
                r.dispatch(&emit, spec, Groups::Count(tets.div_ceil(target.each)))?;
                r.barrier("codes.emit → codes.emit_later");
                r.dispatch(&emit, EmitHitsSpec { later: 1, ..spec }, later)?;
            } else {
                let groups = Count::device(capacity.entries, candidates).groups(
                    r,
                    target.run.tile(),
                    scratch.emit_arguments,
                    "codes.scan → codes.emit",
                )?;
                let emit = Emit { grid, vertices, cells, bad, offsets, candidates, codes, ids, tets, capacity: capacity.entries };
                r.dispatch(&emit, EmitSpec { workgroup: target.run.workgroup, rows: target.run.rows }, groups)?;
            }
            Ok(())
        })?;
        r.stage("build.sort", |r| cmd_sort(r, &pairs, self.entries(capacity), &scratch.sort))
    }

    /// Stage 3, first part: counts the nodes that end at each run of entries on each level; writes `NO` and the number
    /// of nodes to `status`.
    pub fn count_splits(&self, r: &mut Recorder<'_>, capacity: &Capacity, scratch: &SortedScratch) -> Result<()> {
        let Self { status, grid, .. } = *self;
        let entries = self.entries(capacity);
        let target = r.gpu().target();
        let (live, codes, splits, table_length) = (entries.word(r.gpu()), scratch.codes, scratch.splits, scratch.table_length);
        let once = r.gpu().subgroup_size();
        let run = target.run.rows;
        r.stage("build.count_splits", |r| {
            let plan = PlanNodes {
                grid,
                entries: live,
                places: splits,
                table_length,
                node_total: scratch.node_total,
                status,
                groups: scratch.groups,
                capacity: capacity.entries,
                nodes: capacity.nodes,
                run,
            };
            r.dispatch(&plan, PlanNodesSpec { workgroup: once, stage: 0, each: target.each, ..Default::default() }, Groups::Count(1))?;
            // The indirect arguments are used again for the splits and the leaves.
            let groups = entries.groups(r, target.run.tile(), scratch.arguments, "codes.sort → splits.count")?;
            let count = CountSplits { grid, entries: live, codes, counts: splits, capacity: capacity.entries };
            r.dispatch(&count, CountSplitsSpec { workgroup: target.run.workgroup, rows: run }, groups)?;
            let runs = capacity.entries.div_ceil(run);
            let table = Count::device(runs * (capacity.level + 1), table_length);
            cmd_exclusive_scan(r, splits, splits, scratch.node_total, table, &scratch.scan)?;
            r.barrier("splits.scan → splits.plan");
            r.dispatch(&plan, PlanNodesSpec { workgroup: once, stage: 1, each: target.each, ..Default::default() }, Groups::Count(1))?;
            r.barrier("splits.plan → splits.emit");
            Ok(())
        })
    }

    /// Stage 3, second part: writes `PO` and `CO`.
    pub fn splits(&self, r: &mut Recorder<'_>, tree: &TreeMemory, scratch: &SortedScratch) -> Result<()> {
        let Self { status, grid, .. } = *self;
        let target = r.gpu().target().run;
        let TreeMemory { po, co, capacity, .. } = *tree;
        let entries = self.entries(&capacity);
        r.stage("build.splits", |r| {
            r.fill(tree.flags, 0);
            r.fill(tree.masks, 0);
            let arguments = EmitSplits {
                grid,
                entries: entries.word(r.gpu()),
                codes: scratch.codes,
                places: scratch.splits,
                status,
                po,
                co,
                capacity: capacity.entries,
                id_mask: id_mask(tree.lists, self.mesh.input.tets as usize),
                slabs: u32::from(tree.slabs),
            };
            r.dispatch(
                &arguments,
                EmitSplitsSpec { workgroup: target.workgroup, rows: target.rows },
                Groups::Indirect(scratch.arguments.part(0, 12)),
            )?;
            r.barrier("splits.emit → leaves");
            Ok(())
        })
    }

    /// Stage 4, first part: the leaves (Alg. 1).
    pub fn leaves(&self, r: &mut Recorder<'_>, tree: &TreeMemory, scratch: &SortedScratch) -> Result<()> {
        let Self { mesh, status, grid, .. } = *self;
        let target = r.gpu().target();
        let TreeMemory { p, po, flags, masks, .. } = *tree;
        let entries = self.entries(&tree.capacity);
        // The cells marked by the filter are those with boundary tetrahedra.
        let marks = self.marks();
        r.stage("build.leaves", |r| {
            let groups = Groups::Indirect(scratch.arguments.part(0, 12));
            let (live, run, capacity) = (entries.word(r.gpu()), target.run, tree.capacity.entries);
            let (cells, vertices, codes) = (mesh.input.cells, mesh.arrays.vertices, scratch.codes);
            if id_mask(tree.lists, mesh.input.tets as usize) != u32::MAX {
                let mark = MarkQuarters { entries: live, grid, status, codes, cells, vertices, p, capacity };
                r.dispatch(&mark, MarkQuartersSpec { workgroup: run.workgroup, rows: run.rows }, groups)?;
            } else if marks.is_none() {
                let flag = FlagLeaves { entries: live, p, po, boundary_cells: mesh.arrays.boundary, status, flags, capacity };
                r.dispatch(&flag, FlagLeavesSpec { workgroup: run.workgroup, rows: run.rows }, groups)?;
            }
            r.barrier("leaves.flag → leaves.finish");
            let boxes = tree.boxes.unwrap_or_else(|| r.gpu().nothing());
            let marked = u32::from(marks.is_some());
            let marks = marks.unwrap_or_else(|| r.gpu().nothing());
            let finish = FinishLeaves { grid, codes, po, flags, status, boxes, p, cells, vertices, marks, masks };
            let spec = FinishLeavesSpec { workgroup: target.each, boxes: u32::from(tree.boxes.is_some()), marked, ..Default::default() };
            r.dispatch(&finish, spec, scratch.over_leaves())?;
            r.barrier("leaves.finish → levels");
            Ok(())
        })
    }

    /// Stage 4, second part: the slabs of leaves at the surface, in trees that have them.
    pub fn slabs(&self, r: &mut Recorder<'_>, tree: &TreeMemory, scratch: &SortedScratch) -> Result<()> {
        let Self { mesh, status, grid, .. } = *self;
        let TreeMemory { p, po, flags, .. } = *tree;
        if !tree.slabs {
            return Ok(());
        }
        let (cells, vertices, neighbours) = (mesh.input.cells, mesh.arrays.vertices, mesh.arrays.neighbours);
        r.stage("build.slabs", |r| {
            let fit = FitSlabs { grid, status, codes: scratch.codes, po, p, flags, cells, vertices, neighbours };
            let spec = FitSlabsSpec { workgroup: r.gpu().target().each, ..Default::default() };
            r.dispatch(&fit, spec, scratch.over_leaves())?;
            r.barrier("slabs → levels");
            Ok(())
        })
    }

    /// Stage 4, third part: the internal nodes, level by level upwards (Alg. 2).
    pub fn levels(&self, r: &mut Recorder<'_>, tree: &TreeMemory, scratch: &SortedScratch) -> Result<()> {
        let Self { status, grid, .. } = *self;
        let workgroup = r.gpu().target().each;
        let TreeMemory { po, co, flags, masks, .. } = *tree;
        let boxes = tree.boxes.unwrap_or_else(|| r.gpu().nothing());
        let spec = MergeLevelSpec { workgroup, boxes: u32::from(tree.boxes.is_some()), ..Default::default() };
        r.stage("build.levels", |r| {
            for level in (0..tree.capacity.level).rev() {
                let merge = MergeLevel { grid, status, codes: scratch.codes, po, co, flags, masks, boxes, level };
                r.dispatch(&merge, spec, scratch.over_level(level))?;
                r.barrier("levels.lower → levels.upper");
            }
            Ok(())
        })
    }
}
