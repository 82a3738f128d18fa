//! Every tetrahedron that contains a point (SPEC 3.1): counted first, then written into the memory available.

use super::locate::{LocateOptions, LocateOutput, PointInput, cmd_locate};
use super::{Progress, Scene, capacity_of, list_parts};
use crate::build::Tree;
use crate::error::Result;
use crate::gpu::{Arena, BufferRef, Gpu, Groups, Recorder};
use crate::kernels::{LocateAll, LocateAllSpec};
use crate::options::POINT_CHUNK;
use crate::primitives::{Count, ScanScratch, cmd_exclusive_scan};
use crate::reference::walk::STAR;
use crate::times::StageTimes;

/// Answers and scratch memory for all owners: 28 bytes per point, and the scratch memory of a scan.
#[derive(Clone, Copy, Debug)]
pub struct OwnersMemory {
    /// The owner of each point and its barycentric coordinates, as [`cmd_locate`] writes them.
    pub located: LocateOutput,
    /// One word per point: after [`cmd_list_owners`], the end of its owners in `found`. They start where those of the
    /// point before end; the first point's start at 0.
    pub ends: BufferRef,
    /// One word: the number of owners of all points together, whether or not there was room for them. It is correct,
    /// and so are `ends`, for up to [`OwnersMemory::most_points`]; they count modulo 2^32.
    pub total: BufferRef,
    counts: BufferRef,
    scan: ScanScratch,
}

impl OwnersMemory {
    /// The most points whose owners are certain to be numbered, whatever points these are: together they have fewer
    /// than 2^31 owners. `longest_leaf` is that of the [`Scene`]; no point has more owners than that, or than the
    /// 128 tetrahedra of a star.
    pub fn most_points(longest_leaf: u32) -> u32 {
        i32::MAX.cast_unsigned() / longest_leaf.max(STAR as u32)
    }

    /// Carves the memory for `count` points.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(gpu: &Gpu, arena: &mut Arena, count: u32) -> Result<Self> {
        let n = u64::from(count);
        Ok(Self {
            located: LocateOutput { owners: arena.words(n)?, barycentrics: arena.take(16 * n)? },
            ends: arena.words(n)?,
            total: arena.words(1)?,
            counts: arena.words(n)?,
            scan: ScanScratch::carve(gpu, arena, count)?,
        })
    }
}

/// Records how many tetrahedra contain each point. A point that no tetrahedron contains counts its owner within the
/// tolerance, if there is one. This call only records: nothing is submitted, waited for, allocated or read back.
/// [`OwnersMemory::located`] and [`OwnersMemory::total`] are complete once these commands have been executed; for more
/// than [`OwnersMemory::most_points`] the total may be too small by a multiple of 2^32.
///
/// Where tetrahedra overlap each other, only a tree with [`crate::options::Lists::All`] finds all of them: a leaf with a
/// seed tells those that are connected by faces around the point.
///
/// Entry: mesh, tree and points are read by compute shaders. First use of `memory`: transfer writes. Last use: compute
/// reads and writes; no barrier before or after.
///
/// # Errors
/// As [`cmd_locate`].
pub fn cmd_count_owners(
    r: &mut Recorder<'_>,
    scene: &Scene,
    input: &PointInput,
    memory: &OwnersMemory,
    options: &LocateOptions,
) -> Result<()> {
    r.fill(memory.counts, 0);
    cmd_locate(r, scene, input, &memory.located, options)?;
    r.barrier("locate → locate_all");
    cmd_walk_lists(r, scene, input, memory, None)?;
    cmd_exclusive_scan(r, memory.counts, memory.ends, memory.total, Count::host(input.count), &memory.scan)
}

/// Records the owners themselves, after [`cmd_count_owners`] with the same points: one word each in `found`, point by
/// point, ascending within a point. As many are written as `found` holds; [`OwnersMemory::ends`] and
/// [`OwnersMemory::total`] are right in any case.
///
/// Starts with a barrier. Last use: compute reads and writes; no barrier after.
///
/// # Errors
/// [`crate::Error::Invalid`] for fewer points or memory for fewer, [`crate::Error::Vulkan`] if the pipeline cannot be
/// made.
pub fn cmd_list_owners(r: &mut Recorder<'_>, scene: &Scene, input: &PointInput, memory: &OwnersMemory, found: BufferRef) -> Result<()> {
    input.check()?;
    memory.located.check(input.count)?;
    r.barrier("scan → locate_all");
    cmd_walk_lists(r, scene, input, memory, Some(found))
}

/// Searches the lists part by part, and either counts owners or writes them to `found`.
fn cmd_walk_lists(r: &mut Recorder<'_>, scene: &Scene, input: &PointInput, memory: &OwnersMemory, found: Option<BufferRef>) -> Result<()> {
    let (tree, mesh) = (&scene.tree, &scene.mesh);
    let workgroup = r.gpu().target().query;
    let fill = u32::from(found.is_some());
    let places = if fill == 0 { memory.counts } else { memory.ends };
    let found = found.unwrap_or_else(|| r.gpu().nothing());
    let (length, parts) = list_parts(r.gpu().report().kind, scene.longest_leaf);
    let spec = LocateAllSpec { workgroup, fill, part_length: length, lists: tree.lists as u32, ..Default::default() };
    r.stage("query.locate_all", |r| {
        for part in 0..parts {
            if part > 0 {
                r.barrier("locate_all.part → locate_all.part");
            }
            let arguments = LocateAll {
                grid: tree.grid,
                masks: tree.masks,
                co: tree.co,
                po: tree.po,
                p: tree.p,
                flags: tree.flags,
                cells: mesh.input.cells,
                vertices: mesh.arrays.vertices,
                points: input.points,
                owners: memory.located.owners,
                places,
                found,
                neighbours: mesh.arrays.neighbours,
                count: input.count,
                stride: input.stride,
                part,
                capacity: capacity_of(found, 4),
            };
            r.dispatch(&arguments, spec, Groups::Count(input.count.div_ceil(workgroup)))?;
        }
        Ok(())
    })
}

/// All owners in host memory.
#[derive(Clone, Debug, Default)]
pub struct AllOwners {
    /// The owners of each point, ascending.
    pub owners: Vec<Vec<u32>>,
    /// What it took.
    pub times: StageTimes,
}

/// Finds every tetrahedron that contains each point; for a point that none contains, the owner within the tolerance alone,
/// if there is one.
///
/// Where tetrahedra overlap each other, only a tree with [`crate::options::Lists::All`] finds all of them: a leaf with a
/// seed tells those that are connected by faces around the point.
///
/// `report` receives the number of points done and their total.
///
/// # Errors
/// As [`super::locate`].
pub fn locate_all(tree: &Tree, points: &[[f32; 3]], tolerance: f32, report: Progress<'_>) -> Result<AllOwners> {
    let gpu = tree.gpu();
    let (scene, options) = (Scene::of(tree), LocateOptions { tolerance, ..LocateOptions::default() });
    let mut all = AllOwners { owners: Vec::with_capacity(points.len()), ..AllOwners::default() };
    for chunk in points.chunks(POINT_CHUNK.min(OwnersMemory::most_points(scene.longest_leaf) as usize)) {
        let asked = gpu.upload("olbvh.query.points", chunk)?;
        let count = chunk.len() as u32;
        let input = PointInput { points: asked.all(), stride: 3, count, hints: None, order: None };
        let carve = |a: &mut Arena| OwnersMemory::carve(gpu, a, count);
        let (buffer, memory) = Arena::reserve(gpu, "olbvh.query.lists", carve)?;
        let ((), times) = gpu.submit("olbvh.query.count_owners", |r| cmd_count_owners(r, &scene, &input, &memory, &options))?;
        all.times.add(times);
        let total: u32 = gpu.download_one(&buffer, memory.total)?;
        let found = gpu.buffer("olbvh.query.found", 4 * u64::from(total))?;
        let ((), times) = gpu.submit("olbvh.query.list_owners", |r| cmd_list_owners(r, &scene, &input, &memory, found.all()))?;
        all.times.add(times);
        let ends: Vec<u32> = gpu.download(&buffer, memory.ends.part(0, 4 * u64::from(count)))?;
        let found: Vec<u32> = gpu.download(&found, found.all())?;
        let mut begin = 0;
        all.owners.extend(ends.into_iter().map(|end| {
            let owners = found.get(begin..end as usize).unwrap_or_default().to_vec();
            begin = end as usize;
            owners
        }));
        report(all.owners.len() as u64, points.len() as u64)?;
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_owners_of_the_most_points_can_be_numbered() {
        for longest in [0, 1, 128, 2047, 2048, 4100, 1 << 20, crate::build::MAX_TETS] {
            let (points, each) = (OwnersMemory::most_points(longest), u64::from(longest.max(128)));
            assert!(points > 0 && i32::try_from(u64::from(points) * each).is_ok(), "{points} points in lists of {longest}");
            assert!(i32::try_from(u64::from(points + 1) * each).is_err(), "{points} points in lists of {longest}");
        }
        // Usual lists do not shorten the chunks.
        assert!(OwnersMemory::most_points(2047) as usize >= POINT_CHUNK);
    }
}
