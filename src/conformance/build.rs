//! Cases that compare the construction with the reference implementation, stage by stage.

use super::TargetKind;
use super::buffers::{Guarded, part as part_of};
use super::build_expected::Expected;
use super::failure::{Stop, Verdict, compare, compare_one};
use super::meshes::MeshRecipe;
use super::twin::Twin;
use crate::build::{BuildScratch, Capacity, DeviceMesh, Tree, TreeMemory, cmd_build};
use crate::gpu::{Arena, BufferRef, Gpu};
use crate::layout::{BuildStatus, Grid};
use crate::named::named;
use crate::options::{Assign, BuildOptions, Lists};
use crate::tree::stored::{split_entries, split_slabs};
use crate::tree::{TreeArrays, TreeBytes};

/// Which interface builds the tree, and within which limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    /// [`Tree::build`]: counts are read back, and exactly the memory needed is allocated.
    Owned,
    /// [`cmd_build`] with room to spare.
    Recorded,
    /// [`cmd_build`] with room for exactly this tree.
    Tight,
    /// [`cmd_build`] with room for one entry less than the level of the heuristic needs.
    Clipped,
    /// [`cmd_build`] with room for all candidates, but for one entry less than the level of the heuristic keeps of
    /// them.
    Narrow,
    /// [`cmd_build`] with as much room as level 0 may need, and no more.
    Root,
    /// [`cmd_build`] within a budget that is too small for level 0: nothing is built, and the status says so.
    Nothing,
    /// [`cmd_build`] with room for levels 0 to 2 only.
    Shallow,
}

named!(
    Way,
    "way to build",
    [
        Owned = "owned",
        Recorded = "recorded",
        Tight = "tight",
        Clipped = "clipped",
        Narrow = "narrow",
        Root = "root",
        Nothing = "nothing",
        Shallow = "shallow",
    ]
);

/// A tree to build.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BuildCase {
    pub mesh: MeshRecipe,
    pub alpha: f32,
    pub assign: Assign,
    pub lists: Lists,
    pub boxes: bool,
    pub way: Way,
    pub target: TargetKind,
}

pub(crate) fn check(gpu: &Gpu, case: &BuildCase, twin: &mut Twin, device: &DeviceMesh) -> Verdict {
    let options = BuildOptions {
        alpha: case.alpha,
        assign: case.assign,
        lists: case.lists,
        boxes: case.boxes,
        slabs: true,
        ..BuildOptions::default()
    };
    if case.way == Way::Owned {
        return owned(gpu, device, &options, &Expected::new(twin, &options, Some(u32::MAX), u32::MAX, 10)?);
    }
    let (capacity, expected) = within(case.way, twin, &options)?;
    let budget = (case.way == Way::Nothing).then(|| TreeBytes::most(&twin.sizes.entries, 0, &options).total() - 1);
    recorded(gpu, device, &BuildOptions { budget, ..options }, &capacity, &expected)
}

/// The capacity for a way of building, and what is built within it.
fn within(way: Way, twin: &mut Twin, options: &BuildOptions) -> Verdict<(Capacity, Expected)> {
    let limit = |entries: u64| u32::try_from(entries).unwrap_or(u32::MAX);
    let heuristic = twin.sizes.heuristic(options.alpha_fixed()?);
    // A plan does not know which tetrahedra are bad, so it counts all.
    let tets = twin.mesh.tets.len() as u32;
    let room = limit(twin.sizes.entries[heuristic as usize]).max(tets);
    let (entries, level) = match way {
        // The level is no deeper than necessary, because marks take a bit per cell of the deepest level.
        Way::Clipped => (room.saturating_sub(1).max(tets), if options.lists == Lists::All { 10 } else { heuristic }),
        Way::Root | Way::Nothing => (tets, 10),
        Way::Shallow => (room, 2),
        Way::Narrow => (room, heuristic),
        Way::Owned | Way::Recorded | Way::Tight => (room, 10),
    };
    let ample = way == Way::Recorded || way == Way::Tight;
    let fits = if ample { u32::MAX } else { entries };
    let kept = if way == Way::Narrow { twin.built(options.assign, options.lists, heuristic)?.tree().p.len() as u32 } else { 0 };
    let narrow = if way == Way::Narrow { kept.saturating_sub(1).max(tets) } else { u32::MAX };
    let expected = Expected::new(twin, options, (way != Way::Nothing).then_some(fits), narrow, level)?;
    let capacity = match way {
        Way::Tight => Capacity {
            candidates: expected.status.candidates.max(tets),
            entries: expected.status.entries,
            nodes: expected.status.nodes,
            level: expected.status.level,
        },
        Way::Recorded => Capacity::for_entries(entries + entries / 2 + 100, level),
        Way::Narrow => Capacity { candidates: entries, ..Capacity::for_entries(narrow, level) },
        _ => Capacity::for_entries(entries, level),
    };
    Ok((capacity, expected))
}

fn owned(gpu: &Gpu, device: &DeviceMesh, options: &BuildOptions, expected: &Expected) -> Verdict {
    let tree = Tree::build(gpu, device, options)?;
    compare_status(&expected.status, tree.status())?;
    compare_arrays(expected, &tree.download()?)?;
    // The arrays have exactly the planned sizes (but at least 16 bytes).
    let (s, memory) = (&expected.status, tree.memory());
    let size = |name: &str, words: u32, part: BufferRef| compare_one("build.plan", name, &(4 * u64::from(words)).max(16), &part.size);
    size("P (bytes)", s.entries, memory.p)?;
    let slabs = if options.has_slabs() { s.leaves } else { 0 };
    size("PO (bytes)", s.leaves + 1 + slabs, memory.po)?;
    size("CO (bytes)", s.internal + 1, memory.co)?;
    size("flags (bytes)", s.nodes.div_ceil(32), memory.flags)?;
    size("masks (bytes)", s.nodes.div_ceil(4), memory.masks)?;
    match memory.boxes {
        Some(boxes) => size("boxes (bytes)", 6 * s.nodes, boxes),
        None => compare_one("build.plan", "boxes", &false, &options.boxes),
    }
}

fn recorded(gpu: &Gpu, device: &DeviceMesh, options: &BuildOptions, capacity: &Capacity, expected: &Expected) -> Verdict {
    let view = device.view();
    let carve_tree = |a: &mut Arena| TreeMemory::carve(a, capacity, options);
    let tree_memory = Guarded::scratch(gpu, "olbvh.conformance.tree", Arena::measure(carve_tree)?)?;
    let tree = carve_tree(&mut Arena::new(tree_memory.all()))?;
    let carve = |a: &mut Arena| BuildScratch::carve(gpu, a, view.input.tets, capacity, options);
    let scratch_memory = Guarded::scratch(gpu, "olbvh.conformance.scratch", Arena::measure(carve)?)?;
    let scratch = carve(&mut Arena::new(scratch_memory.all()))?;
    gpu.submit("olbvh.conformance.build", |r| cmd_build(r, &view, &tree, options, &scratch))?;

    let content = tree_memory.read(gpu, "build")?;
    scratch_memory.check_guard(gpu, "build")?;
    let words = |part: BufferRef, n: usize| part_of(&content, part, n).to_vec();
    // Not as a whole: the marks of a deep level take 128 MiB.
    let in_scratch = |part: BufferRef, n: usize| scratch_memory.read_part(gpu, part, n);
    let status: BuildStatus = one(&words(tree.status, size_of::<BuildStatus>() / 4))?;
    compare_one("build.estimate_depth", "status.sum", &expected.status.sum, &status.sum)?;
    compare("build.estimate_depth", "status.total", &expected.status.total, &status.total)?;
    compare_one("build.choose_depth", "status.wanted_level", &expected.status.wanted_level, &status.wanted_level)?;
    compare_one("build.choose_depth", "status.level", &expected.status.level, &status.level)?;
    compare_one("build.choose_depth", "status.candidates", &expected.status.candidates, &status.candidates)?;
    compare_one("build.choose_depth", "status.overflow", &expected.status.overflow, &status.overflow)?;
    let Some(expected_tree) = expected.tree() else { return compare_status(&expected.status, &status) };
    compare("build.count", "offsets", &expected.offsets, &in_scratch(scratch.counts.offsets, expected.offsets.len())?)?;
    compare("build.count", "total", &[expected.shares], &in_scratch(scratch.counts.total, 1)?)?;
    if let Some(filter) = &scratch.filter {
        compare("build.filter", "entries", &[expected.status.entries], &in_scratch(filter.entries, 1)?)?;
    }
    let n = expected.codes().len();
    compare("build.sort", "codes", expected.codes(), &in_scratch(scratch.sorted.codes, n)?)?;
    let grid = one::<Grid>(&words(tree.grid, size_of::<Grid>() / 4))?;
    let (p, quarters) = split_entries(words(tree.p, n), &grid);
    compare("build.sort", "P", &expected_tree.p, &p)?;
    compare_status(&expected.status, &status)?;
    let (nodes, internal) = (status.nodes as usize, status.internal as usize);
    let boxes =
        tree.boxes.map(|part| words(part, 6 * nodes).chunks_exact(6).map(|b| [0, 1, 2, 3, 4, 5].map(|i| f32::from_bits(b[i]))).collect());
    let leaves = nodes - internal;
    let (po, slabs) = split_slabs(words(tree.po, if tree.slabs { 2 * leaves + 1 } else { leaves + 1 }), leaves);
    let found = TreeArrays {
        assign: options.assign,
        lists: options.lists,
        grid,
        p,
        quarters,
        po,
        slabs,
        co: words(tree.co, internal + 1),
        no: status.levels[..=status.level as usize].to_vec(),
        flags: words(tree.flags, nodes.div_ceil(32)),
        masks: words(tree.masks, nodes.div_ceil(4)),
        boxes,
    };
    compare_arrays(expected, &found)
}

fn one<T: bytemuck::Pod>(words: &[u32]) -> Verdict<T> {
    bytemuck::try_pod_read_unaligned(bytemuck::cast_slice(words))
        .map_err(|e| super::failure::fail("build", "status", None, "bytes", &e.to_string()))
}

/// Compares the counters, in the order in which they are written.
fn compare_status(expected: &BuildStatus, found: &BuildStatus) -> Result<(), Stop> {
    compare_one("build.choose_depth", "status.level", &expected.level, &found.level)?;
    compare_one("build.plan_nodes", "status.entries", &expected.entries, &found.entries)?;
    compare("build.plan_nodes", "NO (status.levels)", &expected.levels, &found.levels)?;
    compare_one("build.plan_nodes", "status.nodes", &expected.nodes, &found.nodes)?;
    compare_one("build.plan_nodes", "status.internal", &expected.internal, &found.internal)?;
    compare_one("build.plan_nodes", "status.leaves", &expected.leaves, &found.leaves)?;
    compare_one("build.finish_leaves", "status.longest_leaf", &expected.longest_leaf, &found.longest_leaf)?;
    compare_one("build.finish_leaves", "status.boundary_leaves", &expected.boundary_leaves, &found.boundary_leaves)?;
    compare(
        "build",
        "status",
        bytemuck::cast_slice::<_, u32>(std::slice::from_ref(expected)),
        bytemuck::cast_slice(std::slice::from_ref(found)),
    )
}

/// Compares the arrays of the tree, in the order in which they are written.
fn compare_arrays(expected: &Expected, f: &TreeArrays) -> Verdict {
    let Some(e) = expected.tree() else { return compare_one("build", "entries", &0, &f.p.len()) };
    let words = |grid| bytemuck::cast_slice::<Grid, u32>(std::slice::from_ref(grid)).to_vec();
    compare("build.choose_depth", "grid", &words(&e.grid), &words(&f.grid))?;
    compare("build.sort", "P", &e.p, &f.p)?;
    compare("build.mark_quarters", "quarters", &e.quarters, &f.quarters)?;
    compare("build.emit_splits", "NO", &e.no, &f.no)?;
    compare("build.emit_splits", "PO", &e.po, &f.po)?;
    compare("build.emit_splits", "CO", &e.co, &f.co)?;
    let flags = |t: &TreeArrays| t.leaves().map(|j| (j, t.is_boundary(j))).collect::<Vec<_>>();
    compare("build.flag_leaves", "boundary of the leaves (node, flag)", &flags(e), &flags(f))?;
    let octants = |t: &TreeArrays| t.leaves().map(|j| (j, t.mask_of(j))).collect::<Vec<_>>();
    compare("build.finish_leaves", "masks of the leaves (node, octants)", &octants(e), &octants(f))?;
    compare("build.fit_slabs", "slabs of the leaves", &e.slabs, &f.slabs)?;
    compare("build.merge_level", "flags", &e.flags, &f.flags)?;
    compare("build.merge_level", "masks", &e.masks, &f.masks)?;
    compare_one("build.finish_leaves", "boxes.is_some()", &expected.boxes, &f.boxes.is_some())?;
    if let (Some(a), Some(b)) = (&e.boxes, &f.boxes) {
        let bits = |b: &[[f32; 6]]| b.iter().map(|b| b.map(f32::to_bits)).collect::<Vec<_>>();
        let (a, b) = (bits(a), bits(b));
        let first = e.internal_nodes() as usize;
        compare("build.finish_leaves", "boxes of the leaves", &a[first..], b.get(first..).unwrap_or_default())?;
        compare("build.merge_level", "boxes", &a, &b)?;
    }
    Ok(())
}
