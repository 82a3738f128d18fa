//! Remarks on cells that are small beside the whole mesh, and on fields that vary little beside their size.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Assembly;
use crate::formats::array::Array;
use crate::formats::source::excerpt;
use crate::mesh::{Mesh, valid_grid};

/// A field with a smaller range than this part of its largest value has less than 256 different values.
const NARROW: f32 = 1.0 / 65536.0;
/// Up to here, single precision has all whole numbers.
const MOST_WHOLE: f32 = 16_777_216.0;

/// How much of its volume a cell may gain or lose by rounding before it is remarked on.
const CHANGE: f64 = 0.02;
/// Cells smaller than this part of the mesh are small: the smallest leaves, of 1/1024 unless the grid is graded, may have
/// hundreds of them.
const SMALL: f64 = 1.0 / 8192.0;
/// The same as a part of the smallest leaves.
const SMALL_IN_LEAF: f32 = 1.0 / 8.0;
/// Up to this many small cells make no long lists.
const LEAST_SMALL: usize = 4096;
/// What rounding may change by [`CHANGE`] has less than this part of its largest extent squared, times the distance from the
/// origin, as six times its volume: corners move by 2^-23 of that distance on each axis.
const MAY_CHANGE: f64 = 1.0 / 16384.0;
/// The same for what rounding changes by about half as much in general, as its errors are seldom the largest.
const THICK: f64 = MAY_CHANGE / 32.0;

impl Assembly {
    /// Warnings if most cells are much smaller than the smallest leaf of a tree, whose lists are then long, and if rounding
    /// changes the shape of cells: those that are very small beside the mesh, as where another part lies far away.
    pub(super) fn remark_on_small_cells(&self, rounded: &[[f32; 3]], origin: [f64; 3], [lo, hi]: [[f64; 3]; 2]) -> Vec<String> {
        let [origin, lo, hi] = [origin, lo, hi].map(DVec3::from_array);
        let small = SMALL * (hi - lo).max_element();
        // Queries subtract the lower bound in single precision, which rounds what is near 0 once more.
        let corner = (lo - origin).as_vec3();
        let farthest = (hi - origin).abs().max((lo - origin).abs()).max(hi - lo).max_element();
        let of = |tet: &[u32; 4]| {
            let corners = tet.map(|v| DVec3::from_array(self.points[v as usize]));
            let size = extent(&corners);
            let there = volume(corners);
            let may_change = there != 0.0 && there.abs() < MAY_CHANGE * farthest * size.length_squared();
            let changed = may_change && {
                let here = volume(tet.map(|v| (Vec3::from_array(rounded[v as usize]) - corner).as_dvec3()));
                (here - there).abs() > CHANGE * there.abs()
            };
            (size.max_element() < small, changed)
        };
        let count = |(mut small, mut changed): (usize, Vec<u32>), (t, tet): (usize, &[u32; 4])| {
            let (is_small, is_changed) = of(tet);
            small += usize::from(is_small);
            changed.extend(is_changed.then_some(t as u32));
            (small, changed)
        };
        let add = |(small, mut changed): (usize, Vec<u32>), (others, more): (usize, Vec<u32>)| {
            changed.extend(more);
            (small + others, changed)
        };
        let new = || (0, Vec::new());
        let (small, changed) = self.tets.par_iter().enumerate().fold(new, count).reduce(new, add);
        let changed = self.without_slivers(changed, THICK * farthest);
        let all = self.tets.len();
        let too_many = |small: usize| small > LEAST_SMALL && 2 * small > all;
        let slow = (too_many(small) && too_many(self.small_in_leaves(rounded))).then(|| {
            format!(
                "{small} of {all} tetrahedra are smaller than 1/{} of the mesh, so many of them share a leaf of the tree, and queries are \
                 slow; cut the mesh into pieces, or remove parts that lie far away",
                1.0 / SMALL
            )
        });
        let wrong = changed.first().map(|&first| {
            format!(
                "{} of {all} tetrahedra are so small or thin beside the mesh that single precision changes their shape, the first of cell \
                 {}: places in them are wrong by as much; remove parts that lie far away, take these as a mesh of their own, or turn thin \
                 ones parallel to an axis",
                changed.len(),
                self.ids[first as usize]
            )
        });
        slow.into_iter().chain(wrong).collect()
    }

    /// Of tetrahedra that rounding changes, those with a point at which all are about as thin: six times their volume is less
    /// than `height` times their largest extent squared. Nearly flat ones between thick ones, as in most meshes, do no harm:
    /// there is hardly anything in them.
    fn without_slivers(&self, mut changed: Vec<u32>, height: f64) -> Vec<u32> {
        if changed.is_empty() {
            return changed;
        }
        let mut is_thick = vec![false; self.points.len()];
        for tet in &self.tets {
            let corners = tet.map(|v| DVec3::from_array(self.points[v as usize]));
            if volume(corners).abs() >= height * extent(&corners).length_squared() {
                tet.iter().for_each(|&v| is_thick[v as usize] = true);
            }
        }
        changed.retain(|&t| self.tets[t as usize].iter().any(|&v| !is_thick[v as usize]));
        changed
    }

    /// How many cells are small beside the smallest leaves at their place.
    fn small_in_leaves(&self, rounded: &[[f32; 3]]) -> usize {
        let mesh = Mesh::new(rounded.to_vec(), self.tets.clone());
        let grid = valid_grid(&mesh);
        let is_small = |tet: &&[u32; 4]| {
            (0..3).all(|c| {
                let at = tet.map(|v| grid.in_cells(c, rounded[v as usize][c] - grid.lo[c]));
                at.into_iter().fold(f32::MIN, f32::max) - at.into_iter().fold(f32::MAX, f32::min) < SMALL_IN_LEAF
            })
        };
        mesh.tets.par_iter().filter(is_small).count()
    }
}

/// A warning if single precision tells few of an array's values apart.
pub(super) fn remark_on_resolution(array: &Array) -> Option<String> {
    let range = |c: usize| {
        let finite = array.values.iter().copied().skip(c).step_by(array.components).filter(|v| v.is_finite());
        finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(lo, hi), v| (lo.min(v), hi.max(v)))
    };
    let shown = |c: usize| excerpt(array.name_of(c).as_bytes());
    let ranges: Vec<(f32, f32)> = (0..array.components).map(range).collect();
    let narrow = ranges.iter().enumerate().find_map(|(c, &(lo, hi))| {
        let largest = lo.abs().max(hi.abs());
        if lo == hi && array.loss.collapsed >> c & 1 == 1 {
            let remedy = "subtract what they have in common, or scale them";
            Some(format!("array `{}` has several values at {lo}, which are one in single precision; {remedy}", shown(c)))
        } else if lo < hi && hi - lo < NARROW * largest {
            let few = "single precision has few values between; subtract what they have in common";
            Some(format!("array `{}` goes from {lo} to {hi}: {few}", shown(c)))
        } else {
            None
        }
    });
    narrow.or_else(|| {
        let beyond = array.loss.whole && ranges.iter().any(|&(lo, hi)| lo < hi && lo.abs().max(hi.abs()) > MOST_WHOLE);
        let rounded = "which are rounded to single precision, so that numbers beside each other become one";
        beyond.then(|| format!("array `{}` has whole numbers beyond {MOST_WHOLE}, {rounded}", excerpt(array.name.as_bytes())))
    })
}

/// The size of the box around some points.
fn extent(corners: &[DVec3; 4]) -> DVec3 {
    let of = |pick: fn(DVec3, DVec3) -> DVec3| corners.iter().fold(corners[0], |found, &corner| pick(found, corner));
    of(DVec3::max) - of(DVec3::min)
}

/// Six times the signed volume.
fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a)
}
