//! Crowded vertices (SPEC 2.3): those at which more tetrahedra may meet than a star can hold, such as the vertices on
//! the axis of a swept mesh. Their tetrahedra count as boundary, so such a vertex lies in leaves with whole lists, and
//! no walk ends there. Twin of `glsl/shared/corners.glsl`.
//!
//! Counting the tetrahedra at every vertex would take an atomic operation for each of their corners. Only thin corners
//! are counted instead, of which most meshes have few. A corner with edges a, b, c has the solid angle ω with tan(ω/2)
//! = |det(a, b, c)| / D, where D ≤ 4 |a| |b| |c|. So where ω < 0.152, det² ≤ 3/32 a² b² c²; such a corner is called
//! thin, as are some others. The solid angles round a vertex sum to 4π at most where tetrahedra do not overlap, so at
//! most 82 of them are 0.152 or more: of more than [`STAR`](super::walk::STAR) = 128 corners, more than 46 are thin.
//!
//! Everything is scaled by a power of two, so that the largest edge is about 1, and edges are rounded up to multiples
//! of 2^-20. So lengths are never too small, and their products are never denormal, since one of the edges of a corner
//! is at least half as long as the longest.

use super::tet::{Bounds, Tet, Vec3, dot};
use crate::grid::{canonical, per_axis, two_to};
use crate::layout::{Grid, bit};
use crate::mesh::Mesh;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

pub use crate::layout::constants::corners::MOST_THIN;

/// Whether the corner at each vertex, in ascending index, is thin.
pub fn thin_corners(tet: &Tet) -> [bool; 4] {
    let bounds = Bounds::new(tet.v);
    let size = per_axis(|c| bounds.hi[c] - bounds.lo[c]);
    // Coordinates are multiples of 2^-42.
    let exponent = ((size[0].max(size[1]).max(size[2]).to_bits() >> 23) as i32 - 127).max(-42);
    let squared = |a: Vec3, b: Vec3| {
        let edge = per_axis(|c| ((b[c] - a[c]).abs() * two_to(20 - exponent)).ceil() * two_to(-20));
        dot(edge, edge)
    };
    let [a, b, c, d] = tet.v;
    let (ab, ac, ad, bc, bd, cd) = (squared(a, b), squared(a, c), squared(a, d), squared(b, c), squared(b, d), squared(c, d));
    let scale = two_to(-exponent);
    let det = canonical(((tet.volume() * scale) * scale) * scale);
    let square = canonical(det * det);
    [(ab * ac) * ad, (ab * bc) * bd, (ac * bc) * cd, (ad * bd) * cd].map(|room| square <= room * 0.09375)
}

/// The crowded vertices of a mesh with this grid, ascending. Corners are looked at only where so many tetrahedra meet.
pub(crate) fn crowded_vertices(mesh: &Mesh, grid: &Grid, valid: &[u32]) -> Vec<u32> {
    let none = || -> Vec<AtomicU32> { (0..mesh.points.len()).into_par_iter().map(|_| AtomicU32::new(0)).collect() };
    let tets = || mesh.tets.par_iter().enumerate().filter(|&(t, _)| bit(valid, t as u32)).map(|(_, &ids)| ids);
    let all = none();
    tets().for_each(|ids| ids.into_iter().for_each(|v| _ = all[v as usize].fetch_add(1, Relaxed)));
    let many = |v: u32| all[v as usize].load(Relaxed) > MOST_THIN;
    let thin = none();
    tets().filter(|ids| ids.iter().any(|&v| many(v))).for_each(|ids| {
        let rank = ids.map(|v| ids.iter().filter(|&&other| other < v).count() as u32);
        let mut at = [[0.0; 3]; 4];
        ids.iter().zip(rank).for_each(|(&v, rank)| at[rank as usize] = grid.normalise(mesh.points[v as usize]));
        let corners = thin_corners(&Tet::new(rank, &at));
        ids.iter().zip(rank).filter(|(_, rank)| corners[*rank as usize]).for_each(|(&v, _)| _ = thin[v as usize].fetch_add(1, Relaxed));
    });
    (0..mesh.points.len() as u32).into_par_iter().filter(|&v| thin[v as usize].load(Relaxed) > MOST_THIN).collect()
}
