//! Mesh overlap on the device (SPEC 3.5): both directions in one submission, unless a primitive needs more work than a dispatch may do.
//!
//! ```text
//! used      points that valid tetrahedra use
//! places    vertices that lie in the other mesh; tetrahedra of the other mesh around them
//! collect   primitives decided by their vertices; the others whose box meets the other bounds wait
//! search    those that wait: non-boundary nodes of the other tree, then the lists of its boundary leaves   (the narrow phase)
//! ```

use super::Scene;
use crate::build::{DeviceMesh, Tree};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, BufferRef, Gpu, Groups, Recorder, StageTime};
use crate::kernels::{
    OverlapCollect, OverlapCollectSpec, OverlapPairs, OverlapPairsSpec, OverlapPlaces, OverlapPlacesSpec, OverlapSearch, OverlapSearchSpec,
    OverlapUsed, OverlapUsedSpec,
};
use crate::layout::{NodeFrame, OverlapStatus, SearchState};
use crate::options::{Assign, Lists};
use crate::primitives::{Arena, Count, ScanScratch, cmd_exclusive_scan};
use crate::reference::overlap::{Effort, Overlap, joint_grid, members, node_frame};

/// Nodes and entries that a primitive may look at in one dispatch.
const BUDGET: u32 = 512;
/// Dispatches of the search in one submission.
const ROUNDS: u32 = 3;
/// Entries of a list that one dispatch searches for a vertex.
const SLICE: u32 = 16_384;

/// A mesh and its tree.
#[derive(Clone, Copy, Debug)]
pub struct Party<'a> {
    /// The mesh.
    pub mesh: &'a DeviceMesh,
    /// Its tree.
    pub tree: &'a Tree,
}

/// Overlap of two meshes, and what it took.
#[derive(Clone, Debug, Default)]
pub struct Overlapped {
    /// What intersects what.
    pub overlap: Overlap,
    /// Device time per stage.
    pub stages: Vec<StageTime>,
    /// Submissions.
    pub submissions: u32,
}

/// Arrays of one direction: the primitives of one mesh against the tree of the other.
#[derive(Clone, Copy, Debug)]
struct Arrays {
    used: BufferRef,
    places: BufferRef,
    around: BufferRef,
    hits: BufferRef,
    waiting: BufferRef,
    states: BufferRef,
    status: BufferRef,
    groups: BufferRef,
}

impl Arrays {
    fn carve(arena: &mut Arena, own: &Scene, other: &Scene) -> Result<Self> {
        let (points, tets) = (u64::from(own.mesh.input.points), u64::from(own.mesh.input.tets));
        Ok(Self {
            used: arena.words(points.div_ceil(32))?,
            places: arena.words(points)?,
            around: arena.words(u64::from(other.mesh.input.tets).div_ceil(32))?,
            hits: arena.words(tets.div_ceil(32))?,
            waiting: arena.words(tets)?,
            states: arena.take(size_of::<SearchState>() as u64 * tets)?,
            status: arena.take(size_of::<OverlapStatus>() as u64)?,
            groups: arena.words(3)?,
        })
    }
}

/// One direction as the kernels see it.
struct Direction<'a> {
    own: Scene,
    other: Scene,
    arrays: Arrays,
    /// Primitives of its own that hold a vertex of the other mesh: the other direction's answer.
    held: BufferRef,
    frame: &'a Buffer,
    each_once: u32,
}

impl Direction<'_> {
    fn cmd_clear(&self, r: &mut Recorder<'_>) {
        for range in [self.arrays.used, self.arrays.around, self.arrays.states, self.arrays.status] {
            r.fill(range, 0);
        }
    }

    fn cmd_used(&self, r: &mut Recorder<'_>) -> Result<()> {
        let (workgroup, tets) = (r.gpu().target().each, self.own.mesh.input.tets);
        let arguments = OverlapUsed { bad: self.own.mesh.arrays.bad, cells: self.own.mesh.input.cells, used: self.arrays.used, tets };
        r.dispatch(&arguments, OverlapUsedSpec { workgroup, ..Default::default() }, Groups::Count(tets.div_ceil(workgroup)))
    }

    fn slices(&self) -> u32 {
        self.other.longest_leaf.div_ceil(SLICE).max(1)
    }

    fn cmd_places(&self, r: &mut Recorder<'_>, slice: u32) -> Result<()> {
        let (tree, mesh, own) = (&self.other.tree, &self.other.mesh, &self.own.mesh.input);
        let workgroup = r.gpu().target().each;
        let arguments = OverlapPlaces {
            grid: tree.grid,
            masks: tree.masks,
            co: tree.co,
            po: tree.po,
            p: tree.p,
            flags: tree.flags,
            cells: mesh.input.cells,
            vertices: mesh.arrays.vertices,
            own_positions: own.positions,
            used: self.arrays.used,
            places: self.arrays.places,
            around: self.arrays.around,
            status: self.arrays.status,
            points: own.points,
            stride: own.stride,
            slice,
        };
        let spec = OverlapPlacesSpec { workgroup, slice: SLICE, ..Default::default() };
        r.dispatch(&arguments, spec, Groups::Count(own.points.div_ceil(workgroup)))
    }

    fn cmd_collect(&self, r: &mut Recorder<'_>) -> Result<()> {
        let (workgroup, own) = (r.gpu().target().each, &self.own.mesh.input);
        let arguments = OverlapCollect {
            grid: self.other.tree.grid,
            own_positions: own.positions,
            own_cells: own.cells,
            bad: self.own.mesh.arrays.bad,
            places: self.arrays.places,
            around: self.held,
            hits: self.arrays.hits,
            waiting: self.arrays.waiting,
            status: self.arrays.status,
            tets: own.tets,
            stride: own.stride,
        };
        let spec = OverlapCollectSpec { workgroup, ..Default::default() };
        r.dispatch(&arguments, spec, Groups::Count(own.tets.div_ceil(32).div_ceil(workgroup)))
    }

    /// Workgroups of the search, once the number of those that wait is visible.
    fn groups(&self, r: &mut Recorder<'_>) -> Result<Groups> {
        let waiting = Count::device(self.own.mesh.input.tets, self.arrays.status.word(0));
        waiting.groups(r, r.gpu().target().each, self.arrays.groups, "overlap.groups → overlap.search")
    }

    fn cmd_search(&self, r: &mut Recorder<'_>, groups: Groups) -> Result<()> {
        let (tree, mesh, own) = (&self.other.tree, &self.other.mesh, &self.own.mesh.input);
        let workgroup = r.gpu().target().each;
        let arguments = OverlapSearch {
            grid: tree.grid,
            masks: tree.masks,
            co: tree.co,
            po: tree.po,
            p: tree.p,
            flags: tree.flags,
            cells: mesh.input.cells,
            positions: mesh.input.positions,
            own_cells: own.cells,
            own_positions: own.positions,
            frame: self.frame.all(),
            waiting: self.arrays.waiting,
            states: self.arrays.states,
            hits: self.arrays.hits,
            status: self.arrays.status,
            most: own.tets,
        };
        let (each_once, stride, own_stride) = (self.each_once, mesh.input.stride, own.stride);
        let spec = OverlapSearchSpec { workgroup, each_once, budget: BUDGET, own_stride, stride, ..Default::default() };
        r.dispatch(&arguments, spec, groups)
    }

    fn cmd_pairs(&self, r: &mut Recorder<'_>, fill: u32, places: BufferRef, found: BufferRef, capacity: u32) -> Result<()> {
        let (tree, mesh, own) = (&self.other.tree, &self.other.mesh, &self.own.mesh.input);
        let workgroup = r.gpu().target().each;
        let arguments = OverlapPairs {
            grid: tree.grid,
            masks: tree.masks,
            co: tree.co,
            po: tree.po,
            p: tree.p,
            cells: mesh.input.cells,
            positions: mesh.input.positions,
            own_cells: own.cells,
            own_positions: own.positions,
            bad: self.own.mesh.arrays.bad,
            frame: self.frame.all(),
            states: self.arrays.states,
            places,
            found,
            status: self.arrays.status,
            tets: own.tets,
            capacity,
        };
        let (each_once, stride, own_stride) = (self.each_once, mesh.input.stride, own.stride);
        let spec = OverlapPairsSpec { workgroup, each_once, budget: BUDGET, own_stride, stride, fill, ..Default::default() };
        r.stage("overlap.pairs", |r| r.dispatch(&arguments, spec, Groups::Count(own.tets.div_ceil(workgroup))))
    }
}

/// Numbers of the bits that are set, ascending.
pub(crate) fn set_bits(words: Vec<u32>) -> Vec<u32> {
    let of_word = |(w, mut bits): (u32, u32)| {
        std::iter::from_fn(move || {
            let bit = (bits != 0).then(|| bits.trailing_zeros())?;
            bits &= bits - 1;
            Some(32 * w + bit)
        })
    };
    (0..).zip(words).flat_map(of_word).collect()
}

/// What a direction took.
fn effort(status: &OverlapStatus) -> Effort {
    let narrow = u64::from(status.narrow[0]) | u64::from(status.narrow[1]) << 32;
    Effort { by_vertex: status.by_vertex, by_node: status.by_node, searched: status.waiting, located: status.located, narrow }
}

/// Both directions.
struct Job<'a> {
    gpu: &'a Gpu,
    memory: &'a Buffer,
    ways: [Direction<'a>; 2],
}

impl Job<'_> {
    /// Rounds of the search, each over those that are not done.
    fn cmd_rounds(&self, r: &mut Recorder<'_>) -> Result<()> {
        r.stage("overlap.search", |r| {
            let groups = [self.ways[0].groups(r)?, self.ways[1].groups(r)?];
            for _ in 0..ROUNDS {
                self.ways.iter().for_each(|w| r.fill(w.arrays.status.word(1), 0));
                r.barrier("overlap.clear → overlap.search");
                self.ways.iter().zip(groups).try_for_each(|(w, groups)| w.cmd_search(r, groups))?;
                r.barrier("overlap.search → next");
            }
            Ok(())
        })
    }

    fn cmd_sets(&self, r: &mut Recorder<'_>) -> Result<()> {
        self.ways.iter().for_each(|w| w.cmd_clear(r));
        r.barrier("overlap.clear → overlap.used");
        r.stage("overlap.vertices", |r| {
            self.ways.iter().try_for_each(|w| w.cmd_used(r))?;
            r.barrier("overlap.used → overlap.places");
            for slice in 0..self.ways.iter().map(Direction::slices).max().unwrap_or(1) {
                self.ways.iter().filter(|w| slice < w.slices()).try_for_each(|w| w.cmd_places(r, slice))?;
                r.barrier("overlap.places → next");
            }
            Ok(())
        })?;
        r.stage("overlap.collect", |r| self.ways.iter().try_for_each(|w| w.cmd_collect(r)))?;
        r.barrier("overlap.collect → overlap.search");
        self.cmd_rounds(r)
    }

    fn statuses(&self) -> Result<[OverlapStatus; 2]> {
        let mut statuses = [OverlapStatus::default(); 2];
        for (status, way) in statuses.iter_mut().zip(&self.ways) {
            let part = way.arrays.status.part(0, size_of::<OverlapStatus>() as u64);
            *status = self.gpu.download(self.memory, part)?.first().copied().unwrap_or_default();
        }
        Ok(statuses)
    }

    fn sets(&self, report: &dyn Fn(u64, u64), done: &mut Overlapped) -> Result<()> {
        let mut first = true;
        let statuses = loop {
            let ((), time) = self.gpu.run("olbvh.query.overlap", |r| if first { self.cmd_sets(r) } else { self.cmd_rounds(r) })?;
            first = false;
            done.submissions += 1;
            done.stages.extend(time.stages);
            let statuses = self.statuses()?;
            let sum = |pick: fn(&OverlapStatus) -> u32| statuses.iter().map(|s| u64::from(pick(s))).sum::<u64>();
            let (waiting, unfinished) = (sum(|s| s.waiting), sum(|s| s.unfinished));
            report(waiting - unfinished, waiting);
            if unfinished == 0 {
                break statuses;
            }
        };
        for (i, (way, status)) in self.ways.iter().zip(&statuses).enumerate() {
            let words: Vec<u32> =
                self.gpu.download(self.memory, way.arrays.hits.part(0, 4 * u64::from(way.own.mesh.input.tets.div_ceil(32))))?;
            *(if i == 0 { &mut done.overlap.a } else { &mut done.overlap.b }) = set_bits(words);
            done.overlap.effort[i] = effort(status);
        }
        Ok(())
    }

    /// One pass over all pairs, in as many submissions as it takes.
    fn pass(
        &self,
        fill: u32,
        places: BufferRef,
        found: BufferRef,
        capacity: u32,
        report: &dyn Fn(u64, u64),
        done: &mut Overlapped,
    ) -> Result<OverlapStatus> {
        let way = &self.ways[0];
        let tets = u64::from(way.own.mesh.input.tets);
        let mut fresh = true;
        loop {
            let ((), time) = self.gpu.run("olbvh.query.overlap_pairs", |r| {
                if std::mem::take(&mut fresh) {
                    r.fill(way.arrays.states, 0);
                }
                r.fill(way.arrays.status.word(1), 0);
                r.barrier("overlap.clear → overlap.pairs");
                way.cmd_pairs(r, fill, places, found, capacity)
            })?;
            done.submissions += 1;
            done.stages.extend(time.stages);
            let [status, _] = self.statuses()?;
            report(tets - u64::from(status.unfinished), tets);
            if status.unfinished == 0 {
                return Ok(status);
            }
        }
    }

    fn pairs(&self, report: &dyn Fn(u64, u64), done: &mut Overlapped) -> Result<()> {
        let (way, gpu) = (&self.ways[0], self.gpu);
        let tets = way.own.mesh.input.tets;
        let n = u64::from(tets);
        // The counts lie where the list of those that wait would.
        let carve = |a: &mut Arena| Ok((a.words(n)?, a.words(1)?, ScanScratch::carve(gpu, a, tets)?));
        let memory = gpu.buffer("olbvh.query.overlap_counts", Arena::measure(carve)?)?;
        let (counts, total, scan) = carve(&mut Arena::new(memory.all()))?;
        gpu.run("olbvh.query.overlap_clear", |r| {
            r.fill(way.arrays.status, 0);
            Ok(())
        })?;
        let status = self.pass(0, counts, gpu.nothing(), 0, report, done)?;
        done.overlap.effort[0] = effort(&status);
        if status.pairs[1] != 0 {
            let pairs = u64::from(status.pairs[0]) | u64::from(status.pairs[1]) << 32;
            return Err(Error::TooLarge(format!("{pairs} intersecting pairs; 32 bits count {} at most", u32::MAX)));
        }
        gpu.run("olbvh.query.overlap_scan", |r| cmd_exclusive_scan(r, counts, counts, total, Count::host(tets), &scan))?;
        let all = status.pairs[0];
        let found = gpu.buffer("olbvh.query.overlap_found", 8 * u64::from(all))?;
        self.pass(1, counts, found.all(), all, report, done)?;
        let mut pairs: Vec<[u32; 2]> = gpu.download(&found, found.all())?;
        // Ascending by A already; within one of A in the order of the leaves, and with the filtered assignments more than once.
        pairs.chunk_by_mut(|x, y| x[0] == y[0]).for_each(<[_]>::sort_unstable);
        pairs.dedup();
        (done.overlap.a, done.overlap.b) = members(&pairs);
        done.overlap.pairs = Some(pairs);
        Ok(())
    }
}

/// Overlap of A and B, whose points lie in one space, on one device; with all pairs if `pairs`, else the sets alone. `report` is told how many of the
/// primitives that need a search are done.
///
/// # Errors
/// [`Error::Memory`], [`Error::TooLarge`] for more pairs than 32 bits count, a failed Vulkan call, or [`Error::Invalid`] for pairs in a tree without
/// the lists that they are found by.
pub fn overlap(a: Party<'_>, b: Party<'_>, pairs: bool, report: &dyn Fn(u64, u64)) -> Result<Overlapped> {
    if pairs && b.tree.options().lists != Lists::All {
        return Err(Error::Invalid("pairs of cells are found by lists: build the tree over the second mesh with `Lists::All`".into()));
    }
    let gpu = a.tree.gpu();
    let valid = [a, b].map(|p| p.mesh.input().tets > p.mesh.status().bad);
    let mut done = Overlapped { overlap: Overlap { pairs: pairs.then(Vec::new), ..Overlap::default() }, ..Overlapped::default() };
    if valid.contains(&false) {
        return Ok(done);
    }
    let joint = joint_grid(a.tree.grid(), b.tree.grid(), valid);
    let frame = |party: Party<'_>| gpu.upload::<NodeFrame>("olbvh.query.overlap_frame", &[node_frame(party.tree.grid(), &joint)]);
    let (frame_a, frame_b) = (frame(a)?, frame(b)?);
    let [scene_a, scene_b] = [a, b].map(|p| Scene::new(p.mesh, p.tree));
    let carve = |arena: &mut Arena| Ok([Arrays::carve(arena, &scene_a, &scene_b)?, Arrays::carve(arena, &scene_b, &scene_a)?]);
    let memory = gpu.buffer("olbvh.query.overlap", Arena::measure(carve)?)?;
    let [forth, back] = carve(&mut Arena::new(memory.all()))?;
    let each_once = |party: Party<'_>| u32::from(party.tree.options().assign == Assign::Aabb);
    let job = Job {
        gpu,
        memory: &memory,
        ways: [
            Direction { own: scene_a, other: scene_b, arrays: forth, held: back.around, frame: &frame_b, each_once: each_once(b) },
            Direction { own: scene_b, other: scene_a, arrays: back, held: forth.around, frame: &frame_a, each_once: each_once(a) },
        ],
    };
    if pairs {
        job.pairs(report, &mut done)?;
    } else {
        job.sets(report, &mut done)?;
    }
    for stage in &done.stages {
        log::debug!("{}: {:.1} ms", stage.name, stage.milliseconds);
    }
    Ok(done)
}
