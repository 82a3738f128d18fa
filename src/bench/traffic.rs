//! The minimum number of bytes that each stage of a construction must read and write, derived from the sizes of what it
//! builds.
//!
//! Every array that a dispatch uses is counted once for it, as if caches were perfect and no access were wasted:
//! gathered vertices count once, and data that one dispatch writes and the next one reads count twice. A stage at 100 %
//! of the copy rate could therefore not be faster without other passes; what is missing to 100 % is due to arithmetic,
//! scattered access, idle lanes, or barriers.
//!
//! With t tetrahedra, p points, n entries, N nodes (I of them internal), L leaves, l levels, and s shares of candidates
//! (one per 32 candidates, and at least one per tetrahedron), the bytes are:
//!
//! | stage | reads and writes |
//! |---|---|
//! | `mesh.clear` | the table of faces 20 t |
//! | `mesh.bounds` | cells 16 t, points 12 p twice, vertices 16 p |
//! | `mesh.shapes` | cells 16 t, vertices 16 p |
//! | `mesh.faces` | cells 16 t, the table of faces in and out 40 t, mates 16 t |
//! | `mesh.boundary` | cells 16 t, the table of faces 20 t; mates read and neighbours written, each 16 t |
//! | `build.depth` | cells 16 t, points 12 p |
//! | `build.count` | cells 16 t, vertices 16 p, counts 4 t, their scan; only a number where every tetrahedron has one share |
//! | `build.filter` | cells 16 t, vertices 16 p, offsets 4 t if counted, hits and counts 8 s, their scan; marks 3 · 8^l / 8 |
//! | `build.emit` | cells 16 t, vertices 16 p, offsets 4 t if counted, hits and places of shares 8 s, codes and ids 8 n |
//! | `build.sort` | keys 4 n; per pass pairs 8 n in and out, digits cleared, written and read; serial sorts: see below |
//! | `build.count_splits` | codes 4 n, the table of runs, its scan |
//! | `build.splits` | codes 4 n, the table of runs, PO 4 L, CO 4 I, cleared flags and masks N / 8 + N |
//! | `build.leaves` | P 4 n, PO and codes 8 L, masks L, boxes 24 L; quarters, if any: 12 n, cells 16 t, vertices 16 p |
//! | `build.slabs` | P 4 n, PO and codes 8 L, flags N / 8, slabs 4 L; of cells, neighbours and vertices those at the surface, not counted |
//! | `build.levels` | CO 4 I, PO and codes 8 L, masks I, boxes 24 N |
//!
//! A scan reads its values twice and writes them once: 12 bytes per value. "Digits" is the table of digit counts of the
//! sort. In a serial sort, it is written, scanned and read in every pass, which reads the keys again for it, and an odd
//! number of passes is followed by a copy of the pairs. Marks are used with boundary lists. Quarters read the codes (4 n)
//! and read and write P (8 n).

use crate::build::{DeviceMesh, SHARE, Tree, filtered};
use crate::gpu::Target;
use crate::options::Lists;
use crate::tree::stored::id_mask;

/// Bytes that a scan moves per value.
const SCAN: u64 = 12;

/// Minimum number of bytes of each stage of a tree's construction, in order, preceded by those of stage 0.
pub(super) fn traffic(mesh: &DeviceMesh, tree: &Tree, target: &Target) -> Vec<(&'static str, u64)> {
    let (input, status, options) = (mesh.input(), tree.status(), tree.options());
    let (t, p, n) = (u64::from(input.tets), u64::from(input.points), u64::from(status.entries));
    let (nodes, internal, leaves) = (u64::from(status.nodes), u64::from(status.internal), u64::from(status.leaves));
    let level = status.level;
    let cells_and_vertices = 16 * t + 16 * p;
    let filtered = filtered(options);
    let counted = !filtered || status.large_levels >> level & 1 != 0;
    let offsets = if counted { 4 * t } else { 0 };
    let shares = t.max(u64::from(status.candidates / SHARE));
    let marks = if options.lists == Lists::Boundary { 8u64.pow(level).div_ceil(8) } else { 0 };
    let filter = cells_and_vertices + offsets + 8 * shares + SCAN * shares + 3 * marks;
    let (passes, digit_bits) = target.sort.passes(3 * level);
    let digits = (n.div_ceil(u64::from(target.sort.tile())) | 1) << digit_bits;
    let sort = match (target.sort.serial, u64::from(passes)) {
        _ if level == 0 || n < 2 => 0,
        (true, passes) => passes * (4 * n + 16 * n + (8 + SCAN) * digits) + passes % 2 * 16 * n,
        (false, passes) => 4 * n + passes * (16 * n + 12 * digits),
    };
    let runs = n.div_ceil(u64::from(target.run.rows)) * u64::from(level + 1);
    let quarters = if id_mask(options.lists, input.tets as usize) == u32::MAX { 0 } else { cells_and_vertices + 12 * n };
    let boxes = |count: u64| if options.boxes { 24 * count } else { 0 };
    let stages = [
        ("mesh.clear", 20 * t),
        ("mesh.bounds", 16 * t + 24 * p + 16 * p),
        ("mesh.shapes", cells_and_vertices),
        ("mesh.faces", (16 + 40 + 16) * t),
        ("mesh.boundary", (20 + 3 * 16) * t),
        ("build.depth", 16 * t + 4 * u64::from(input.stride) * p),
        ("build.count", if counted { cells_and_vertices + 4 * t + SCAN * t } else { SCAN }),
        ("build.filter", if filtered { filter } else { 0 }),
        ("build.emit", cells_and_vertices + offsets + if filtered { 8 * shares } else { 0 } + 8 * n),
        ("build.sort", sort),
        ("build.count_splits", 4 * n + (4 + SCAN) * runs),
        ("build.splits", 4 * n + 4 * runs + 4 * leaves + 4 * internal + nodes / 8 + nodes),
        ("build.leaves", 4 * n + 9 * leaves + boxes(leaves) + quarters),
        ("build.slabs", if options.has_slabs() { 4 * n + nodes / 8 + 12 * leaves } else { 0 }),
        ("build.levels", 4 * internal + 8 * leaves + internal + boxes(nodes)),
    ];
    stages.into_iter().filter(|(_, bytes)| *bytes > 0).collect()
}
