//! The C interface to answers that are lists: all owners of points, and the pairs of an overlap.

use super::query::fill;
use super::{OlbvhStatus, OlbvhTree, array, array_mut, border, handle, place, tolerance};
use crate::query::{SILENT, locate_all, overlap_pairs};

/// Finds every tetrahedron that contains each of `count` points (three floats each); for a point that none contains, its
/// owner within the tolerance, if there is one, alone. `ends` gets for each point where its tetrahedra end in `found`; they
/// are ascending, and start where those of the point before end. `found` has room for `room` of them, and `total` gets the
/// number of all: where that is greater, those that fit are written; call again with more room. Where tetrahedra overlap,
/// only a tree with `lists` 0 finds all.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_locate_all(
    tree: *const OlbvhTree,
    points: *const f32,
    count: usize,
    tolerance: f32,
    ends: *mut u64,
    found: *mut u32,
    room: usize,
    total: *mut u64,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let (OlbvhTree { mesh, tree, .. }, points) = unsafe { (handle(tree, "tree")?, array(points.cast(), count, "points")?) };
        // SAFETY: the caller keeps the rules of `capi`.
        let (ends, found, total) = unsafe { (array_mut(ends, count, "ends")?, array_mut(found, room, "found")?, place(total)?) };
        let mut all = locate_all(tree, points, self::tolerance(tolerance), SILENT)?.owners;
        for owners in &mut all {
            owners.iter_mut().for_each(|owner| *owner = mesh.cell(*owner));
            owners.sort_unstable(); // the caller's numbers
        }
        let mut sum = 0;
        let end = |owners: &Vec<u32>| {
            sum += owners.len() as u64;
            sum
        };
        fill(&mut ends.iter_mut(), all.iter().map(end));
        total.write(sum);
        fill(&mut found.iter_mut(), all.into_iter().flatten());
        Ok(())
    })
}

/// Finds all pairs of a tetrahedron of A and one of B that intersect, as `olbvh_overlap` finds the tetrahedra: two numbers
/// for each pair, ascending by A, then by B. `pairs` has room for `room` pairs, and `total` gets the number of all: where
/// that is greater, those that fit are written; call again with more room. The tree over B must have `lists` 0.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn olbvh_overlap_pairs(
    a: *const OlbvhTree,
    b: *const OlbvhTree,
    pairs: *mut u32,
    room: usize,
    total: *mut u64,
) -> OlbvhStatus {
    border(|| {
        // SAFETY: the caller keeps the rules of `capi`.
        let [a, b] = unsafe { [handle(a, "a")?, handle(b, "b")?] };
        // SAFETY: the caller keeps the rules of `capi`.
        let (pairs, total) = unsafe { (array_mut(pairs.cast(), room, "pairs")?, place(total)?) };
        let mut all = overlap_pairs(&a.tree, &b.tree, SILENT)?.overlap.pairs.unwrap_or_default();
        all.iter_mut().for_each(|[of_a, of_b]| (*of_a, *of_b) = (a.mesh.cell(*of_a), b.mesh.cell(*of_b)));
        all.sort_unstable();
        total.write(all.len() as u64);
        fill(&mut pairs.iter_mut(), all);
        Ok(())
    })
}
