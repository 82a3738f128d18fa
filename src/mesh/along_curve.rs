//! Reordering of a mesh in memory along the Morton curve.

use super::{Mesh, On, fault_of, is_usable, valid_grid};
use crate::error::{Error, Result};
use crate::grid::{morton, per_axis};
use rayon::prelude::*;

impl Mesh {
    /// The same mesh with its tetrahedra sorted along the Morton curve by their centroids, and its points likewise;
    /// items with equal codes keep their order. Bad tetrahedra and points that are not finite come last.
    /// [`Mesh::cell_ids`] and [`Mesh::point_ids`] still give the ids of the source, and fields are reordered too.
    ///
    /// Neighbours in space become neighbours in memory. Where a mesh of 1.5 million tetrahedra was stored in no spatial
    /// order, locating points took 15–50 % longer and building a tree 25–30 % longer than in the order of the curve
    /// (lavapipe, Mesa 25). Mesh generators mostly produce an order that is equally good.
    ///
    /// Answers stay the same with one exception: a point on a shared face, edge or vertex belongs to the first of its
    /// tetrahedra along the curve, not to the one with the lowest id in the source.
    ///
    /// # Errors
    /// [`Error::TooLarge`] if tetrahedra or points exceed 32-bit indices.
    pub fn along_curve(mut self) -> Result<Self> {
        if self.points.len().max(self.tets.len()) >= u32::MAX as usize {
            let (tets, points) = (self.tets.len(), self.points.len());
            return Err(Error::TooLarge(format!("{tets} tetrahedra on {points} points; 2^32 can be indexed")));
        }
        let grid = valid_grid(&self);
        let code = |p: [f32; 3]| if is_usable(p) { morton(grid.quantize(p)) } else { u32::MAX };
        let points = sorted(self.points.len(), |i| code(self.points[i as usize]));
        let tets = sorted(self.tets.len(), |t| {
            if fault_of(&self, t).is_some() {
                return u32::MAX;
            }
            let [a, b, c, d] = self.tets[t as usize].map(|v| self.points[v as usize]);
            code(per_axis(|k| 0.25 * ((a[k] + b[k]) + (c[k] + d[k]))))
        });
        let mut place = vec![0; points.len()];
        (0..).zip(&points).for_each(|(new, &old)| place[old as usize] = new);
        // An index that is out of range stays out of range.
        let moved = |v: u32| place.get(v as usize).copied().unwrap_or(v);
        for field in &mut self.fields {
            let order = if field.on == On::Points { &points } else { &tets };
            if field.values.len() == order.len() {
                field.values = take(&field.values, order);
            }
        }
        Ok(Self {
            points: take(&self.points, &points),
            tets: tets.par_iter().map(|&t| self.tets[t as usize].map(moved)).collect(),
            cell_ids: Some(tets.iter().map(|&t| self.cell_id(t)).collect()),
            point_ids: Some(points.iter().map(|&p| self.point_id(p)).collect()),
            ..self
        })
    }
}

/// The numbers below `n`, sorted by their keys; numbers with equal keys ascending.
fn sorted(n: usize, key: impl Fn(u32) -> u32 + Sync) -> Vec<u32> {
    let mut pairs: Vec<(u32, u32)> = (0..n as u32).into_par_iter().map(|i| (key(i), i)).collect();
    pairs.par_sort_unstable();
    pairs.into_par_iter().map(|p| p.1).collect()
}

fn take<T: Copy + Send + Sync>(values: &[T], order: &[u32]) -> Vec<T> {
    order.par_iter().map(|&i| values[i as usize]).collect()
}
