//! Mesh overlap on the device (SPEC 3.5): both directions in one submission, unless a tetrahedron needs more work than
//! a dispatch may do.
//!
//! ```text
//! frames    brings both trees into one frame
//! used      marks the points that valid tetrahedra use
//! places    finds the vertices that lie in the other mesh, and the tetrahedra of the other mesh around them
//! collect   decides tetrahedra by their vertices; of the rest, those whose box meets the other bounds wait
//! search    searches for those: non-boundary nodes of the other tree, then lists of its boundary leaves (narrow phase)
//! pairs     counts all pairs that touch, then writes them
//! ```
//! [`cmd_overlap`], [`cmd_count_pairs`] and [`cmd_list_pairs`] record these steps; [`overlap`] and [`overlap_pairs`] submit
//! them until everything is done.

mod frames;
mod pairs;
mod sets;
pub use pairs::{PairMemory, cmd_count_pairs, cmd_list_pairs};
pub use sets::{OverlapMemory, cmd_overlap};

use super::{Progress, Scene, until_done};
use crate::build::Tree;
use crate::error::{Error, Result};
use crate::gpu::{Arena, Gpu, Recorder};
use crate::layout::{OverlapStatus, set_bits, wide};
use crate::reference::overlap::{Effort, Overlap, members};
use crate::times::StageTimes;

/// Rounds of the search per submission; for large meshes one, so that no submission takes long.
fn rounds_at_once(tets: u32) -> u32 {
    if tets < 1 << 20 { 3 } else { 1 }
}

/// Overlap of two meshes.
#[derive(Clone, Debug, Default)]
pub struct Overlapped {
    /// Which tetrahedra intersect the other mesh, or which pairs intersect.
    pub overlap: Overlap,
    /// What it took.
    pub times: StageTimes,
}

/// The effort of one direction.
fn effort(status: &OverlapStatus) -> Effort {
    let OverlapStatus { by_vertex, by_node, waiting: searched, located, narrow, .. } = *status;
    Effort { by_vertex, by_node, searched, located, narrow: wide(narrow) }
}

/// Two meshes on one device, and the state of their overlap computation.
struct Job<'a> {
    gpu: &'a Gpu,
    scenes: [Scene; 2],
    report: Progress<'a>,
    done: Overlapped,
}

impl<'a> Job<'a> {
    fn run([a, b]: [&'a Tree; 2], report: Progress<'a>, find: fn(&mut Self) -> Result<()>) -> Result<Overlapped> {
        if !a.gpu().is_same_device(b.gpu()) {
            return Err(Error::Invalid("the two trees lie on different devices".into()));
        }
        let mut job = Self { gpu: a.gpu(), scenes: [a, b].map(Scene::of), report, done: Overlapped::default() };
        find(&mut job)?;
        log::debug!("overlap: {}", job.done.times);
        Ok(job.done)
    }

    fn sets(&mut self) -> Result<()> {
        let (gpu, [a, b], done) = (self.gpu, &self.scenes, &mut self.done);
        let carve = |arena: &mut Arena| OverlapMemory::carve(arena, a, b);
        let (buffer, memory) = Arena::reserve(gpu, "olbvh.query.overlap", carve)?;
        let at_once = rounds_at_once(a.mesh.input.tets.max(b.mesh.input.tets));
        let record = |r: &mut Recorder<'_>, rounds| cmd_overlap(r, a, b, &memory, rounds);
        let statuses = until_done(gpu, "olbvh.query.overlap", at_once, &mut done.times, record, || {
            let statuses = memory.frames.statuses(gpu, &buffer)?;
            let sum = |pick: fn(&OverlapStatus) -> u32| statuses.iter().map(|s| u64::from(pick(s))).sum::<u64>();
            let (waiting, unfinished) = (sum(|s| s.waiting), sum(|s| s.unfinished));
            (self.report)(waiting.saturating_sub(unfinished), waiting)?;
            Ok((unfinished == 0).then_some(statuses))
        })?;
        let hits = |i: usize| {
            let words = u64::from(self.scenes[i].mesh.input.tets.div_ceil(32));
            Ok::<_, Error>(set_bits(gpu.download(&buffer, memory.hits[i].part(0, 4 * words))?))
        };
        (done.overlap.a, done.overlap.b) = (hits(0)?, hits(1)?);
        for (of, status) in done.overlap.effort.iter_mut().zip(&statuses) {
            *of = effort(status);
        }
        Ok(())
    }

    fn pairs(&mut self) -> Result<()> {
        let (gpu, [a, b], done) = (self.gpu, &self.scenes, &mut self.done);
        let tets = a.mesh.input.tets;
        let carve = |arena: &mut Arena| PairMemory::carve(gpu, arena, tets);
        let (buffer, memory) = Arena::reserve(gpu, "olbvh.query.overlap_counts", carve)?;
        // In the first pass pairs are counted, in the second they are written.
        let (report, n) = (self.report, u64::from(tets));
        let tell = |passes: u64, left: u32| report((passes * n).saturating_sub(left.into()), 2 * n);
        let record = |r: &mut Recorder<'_>, rounds| cmd_count_pairs(r, a, b, &memory, rounds);
        let status = until_done(gpu, "olbvh.query.overlap", 1, &mut done.times, record, || {
            let status: OverlapStatus = gpu.download_one(&buffer, memory.status)?;
            tell(1, status.unfinished)?;
            Ok((status.unfinished == 0).then_some(status))
        })?;
        done.overlap.effort[0] = effort(&status);
        if wide(status.pairs) > i32::MAX as u64 {
            return Err(Error::TooLarge(format!("{} intersecting pairs; shaders number {} at most", wide(status.pairs), i32::MAX)));
        }
        let found = gpu.buffer("olbvh.query.overlap_found", 8 * u64::from(status.pairs[0]))?;
        let record = |r: &mut Recorder<'_>, rounds| cmd_list_pairs(r, a, b, &memory, found.all(), rounds);
        until_done(gpu, "olbvh.query.overlap", 1, &mut done.times, record, || {
            let status: OverlapStatus = gpu.download_one(&buffer, memory.status)?;
            tell(2, status.unfilled)?;
            Ok((status.unfilled == 0).then_some(()))
        })?;
        let mut pairs: Vec<[u32; 2]> = gpu.download(&found, found.all())?;
        // Pairs are ascending by A already. Within a tetrahedron of A they are in the order of B's leaves, and with
        // filtered assignments a pair may occur more than once.
        pairs.chunk_by_mut(|x, y| x[0] == y[0]).for_each(<[_]>::sort_unstable);
        pairs.dedup();
        (done.overlap.a, done.overlap.b) = members(&pairs);
        done.overlap.pairs = Some(pairs);
        Ok(())
    }
}

/// Overlap of the meshes of two trees, A and B, whose points lie in one space, on one device: the tetrahedra of either that
/// intersect the other. `report` receives how many of the tetrahedra that need a search are done, and how many there are.
///
/// # Errors
/// [`Error::Memory`], a failed Vulkan call, or [`Error::Invalid`] for trees on different devices.
pub fn overlap(a: &Tree, b: &Tree, report: Progress<'_>) -> Result<Overlapped> {
    Job::run([a, b], report, Job::sets)
}

/// As [`overlap`], with all pairs of tetrahedra that intersect. `report` receives every tetrahedron of A, twice: its pairs
/// are counted first, then written.
///
/// # Errors
/// Those of [`overlap`], [`Error::TooLarge`] for 2^31 pairs and more, and [`Error::Invalid`] for a tree over B without the
/// lists that pairs are found by ([`crate::options::Lists::All`]).
pub fn overlap_pairs(a: &Tree, b: &Tree, report: Progress<'_>) -> Result<Overlapped> {
    Job::run([a, b], report, Job::pairs)
}
