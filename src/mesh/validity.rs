//! Which tetrahedra of a mesh are valid, and the bounds and the grid of those that are (SPEC 2.1, 2.3).

use super::Mesh;
use super::grading::grid_over;
use crate::grid::{COORDINATE_LIMIT, Grid, canonical, per_axis};
use crate::layout::bit;
use rayon::prelude::*;

/// Why a tetrahedron is bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// This vertex index is not below the number of points.
    Index(u32),
    /// This vertex occurs twice.
    Repeated(u32),
    /// This vertex has a coordinate that is NaN, infinite, or too large to compute with.
    Coordinate(u32),
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Index(v) => write!(f, "vertex {v} does not exist"),
            Self::Repeated(v) => write!(f, "vertex {v} occurs twice"),
            Self::Coordinate(v) => write!(f, "vertex {v} is not finite or beyond ±{COORDINATE_LIMIT:e}"),
        }
    }
}

/// Packs `n` answers into words.
pub(crate) fn words(n: usize, answer: &(dyn Fn(u32) -> bool + Sync)) -> Vec<u32> {
    let word = |w: usize| (w * 32..n.min(w * 32 + 32)).fold(0, |word, t| word | u32::from(answer(t as u32)) << (t % 32));
    (0..n.div_ceil(32)).into_par_iter().map(word).collect()
}

/// The grid over the vertices that valid tetrahedra use, at the finest level, that of every tree over the mesh.
pub fn valid_grid(mesh: &Mesh) -> Grid {
    grid_of(mesh, &words(mesh.tets.len(), &|t| fault_of(mesh, t).is_none()))
}

/// The same, where it is known which tetrahedra are valid.
pub(crate) fn grid_of(mesh: &Mesh, valid: &[u32]) -> Grid {
    let (lo, hi) = bounds(mesh, valid);
    grid_over(mesh, valid, [lo, hi])
}

/// Whether all coordinates of a point are finite and small enough to compute with.
pub fn is_usable(p: [f32; 3]) -> bool {
    p.iter().all(|x| x.abs() < COORDINATE_LIMIT)
}

/// Why a tetrahedron is bad, with vertices numbered as in the source; `None` if it is valid.
pub fn fault_of(mesh: &Mesh, tet: u32) -> Option<Fault> {
    let ids = mesh.tets.get(tet as usize)?;
    let repeated = |i: usize| ids[..i].contains(&ids[i]);
    let point = |v: u32| mesh.points.get(v as usize);
    let range = ids.iter().find(|&&v| point(v).is_none()).map(|&v| Fault::Index(v));
    let range = range.or_else(|| (1..4).find(|&i| repeated(i)).map(|i| Fault::Repeated(mesh.point_id(ids[i]))));
    let usable = |v: u32| point(v).is_some_and(|&p| is_usable(p));
    range.or_else(|| ids.iter().find(|&&v| !usable(v)).map(|&v| Fault::Coordinate(mesh.point_id(v))))
}

/// Lower and upper corner of the valid tetrahedra; an empty box if there are none.
fn bounds(mesh: &Mesh, valid: &[u32]) -> ([f32; 3], [f32; 3]) {
    let empty = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    let join = |a: ([f32; 3], [f32; 3]), b: ([f32; 3], [f32; 3])| (per_axis(|c| a.0[c].min(b.0[c])), per_axis(|c| a.1[c].max(b.1[c])));
    let of = |bounds, (t, ids): (usize, &[u32; 4])| {
        let points = ids.iter().filter(|_| bit(valid, t as u32)).map(|&v| mesh.points[v as usize].map(canonical));
        points.fold(bounds, |b, p| join(b, (p, p)))
    };
    mesh.tets.par_iter().enumerate().fold(|| empty, of).reduce(|| empty, join)
}
