//! Graded grids: where most of the tetrahedra lie in a small part of an axis, cells are smaller there. Twin of
//! `glsl/build/01_make_grid.comp`.
//!
//! Flow around a body is computed in meshes whose cells are thousands of times as large far away from it as beside it.
//! The whole body may be smaller than the leaves of a tree whose cells are all of one size, so that a single leaf would
//! list most of the mesh. In a graded grid, each axis is divided into [`STRETCHES`] intervals with as many cells each,
//! which end at quantiles of the tetrahedra's places. Cells stay boxes, since each axis is divided by itself, and
//! everything that descends the tree by quantized coordinates stays as it is, because quantization is monotone.
//!
//! The quantiles are those of [`SAMPLES`] tetrahedra, of which a place within their extent is taken, and of as many even
//! places, so that no cell is more than twice as wide as in a grid that is not graded. They are moved by 1/64 towards
//! even ones, so that the smallest cells are at least 2^-16 of the bounds. An axis is graded if a quarter of its stretches
//! are less than a quarter as wide as even ones, and the grid is if an axis is. Quantization errs by less than 2^-20 of the bounds, four times less than what the assignment allows for.

use super::{Mesh, hash};
use crate::grid::{Grid, MIN_EXTENT, STRETCH_CELLS, STRETCHES, canonical, per_axis, two_to};
use crate::layout::bit;

pub use crate::layout::constants::make_grid::SAMPLES;

/// The grid over the bounds `[lo, hi]` of the valid tetrahedra, graded if they lie that way.
pub(super) fn grid_over(mesh: &Mesh, valid: &[u32], [lo, hi]: [[f32; 3]; 2]) -> Grid {
    let mut grid = Grid::new(lo, hi);
    let extent = per_axis(|c| canonical(grid.hi[c] - grid.lo[c]));
    let even = (0..SAMPLES).map(|k| extent.map(|e| e * (k as f32 * two_to(-8))));
    let samples: Vec<[f32; 3]> = (0..SAMPLES).filter_map(|k| sample(mesh, valid, k, &grid)).chain(even).collect();
    let quantiles = per_axis(|c| quantiles(samples.iter().map(|s| s[c]).collect(), extent[c]));
    let steep = per_axis(|c| extent[c] >= MIN_EXTENT && is_steep(&quantiles[c], extent[c]));
    grid.graded = u32::from(steep.contains(&true));
    for c in (0..3).filter(|&c| grid.graded != 0 && grid.inv[c] != 0.0) {
        for (j, quantile) in quantiles[c].iter().enumerate() {
            let even = extent[c] * (j as f32 * two_to(-4));
            let moved = quantile * (1.0 - two_to(-6)) + even * two_to(-6);
            grid.knots[j][c] = if j == STRETCHES as usize {
                extent[c]
            } else if steep[c] {
                moved
            } else {
                even
            };
        }
        for j in 0..STRETCHES as usize {
            grid.rates[j][c] = STRETCH_CELLS as f32 / (grid.knots[j + 1][c] - grid.knots[j][c]);
        }
    }
    grid
}

/// A place in the extent of a tetrahedron, as distances from the lower corner; `None` if it is bad.
fn sample(mesh: &Mesh, valid: &[u32], k: u32, grid: &Grid) -> Option<[f32; 3]> {
    let (each, more) = (mesh.tets.len() as u32 / SAMPLES, mesh.tets.len() as u32 % SAMPLES);
    // Any of equally many consecutive tetrahedra, since grids have the same place again and again.
    let t = k * each + k * more / SAMPLES + hash(k).checked_rem(each).unwrap_or(0);
    let ids = mesh.tets.get(t as usize).filter(|_| bit(valid, t))?;
    let part = (k.wrapping_mul(0x9e37_79b9) >> 8) as f32 * two_to(-24);
    Some(per_axis(|c| {
        let [p, q, r, s] = ids.map(|v| canonical(mesh.points[v as usize][c]));
        let (least, most) = (p.min(q).min(r.min(s)), p.max(q).max(r.max(s)));
        let at = least + canonical(most - least) * part;
        canonical(canonical(at) - grid.lo[c]).max(0.0)
    }))
}

/// The ends of stretches with equally many of these places.
fn quantiles(mut places: Vec<f32>, extent: f32) -> Vec<f32> {
    places.sort_by(f32::total_cmp);
    let (n, parts) = (places.len(), STRETCHES as usize);
    let at = |j: usize| match j {
        0 => 0.0,
        j if j == parts => extent,
        j => places.get(j * n / parts).map_or(0.0, |x| x.min(extent)),
    };
    (0..=parts).map(at).collect()
}

fn is_steep(quantiles: &[f32], extent: f32) -> bool {
    let narrow = quantiles.windows(2).filter(|ends| ends[1] - ends[0] < extent * two_to(-6)).count();
    4 * narrow >= STRETCHES as usize
}
