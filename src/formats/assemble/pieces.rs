//! Meshes that consist of several pieces, in one file or in several.

use std::collections::HashMap;
use std::path::Path;

use super::super::Merge;
use super::super::source::excerpt;
use super::Assembly;
use crate::mesh::On;

impl Assembly {
    /// The cells that follow are those of a listed file.
    pub fn enter(&mut self, path: &Path) {
        self.files.push((path.into(), self.n_cells));
    }

    /// Adds a warning, unless an earlier piece has given it. A hostile file has too many to look through all.
    pub fn warn(&mut self, warning: String) {
        if !self.warnings.iter().rev().take(100).any(|earlier| *earlier == warning) {
            self.warnings.push(warning);
        }
    }

    /// Fills arrays with NaN for the pieces that do not have them; arrays that would need too many are left out.
    pub fn complete_arrays(&mut self) {
        self.arrays.retain_mut(|array| {
            let count = if array.on == On::Points { self.points.len() } else { self.n_cells };
            let filled = array.fill(count, &mut self.padding);
            if let Err(limit) = &filled {
                let name = excerpt(array.name.as_bytes());
                self.warnings.push(format!("array `{name}` is left out: few pieces have it, and NaN for the others would take {limit}"));
            }
            filled.is_ok()
        });
    }

    /// Sets the points of all pieces; `starts` holds the first point of each. A cell that is pushed later uses the
    /// first of several points with equal coordinates, within the limits of the option, so that cells which share a
    /// face cut it in the same way.
    pub fn set_points(&mut self, points: Vec<[f64; 3]>, starts: &[usize]) {
        self.points = points;
        if self.merge == Merge::Nothing || (self.merge == Merge::Pieces && starts.len() < 2) {
            return;
        }
        let piece_start = |i: usize| starts[..starts.partition_point(|&start| start <= i)].last().copied().unwrap_or(0);
        let limit = |i: usize| if self.merge == Merge::All { i } else { piece_start(i) };
        let mut first: HashMap<[u64; 3], u32> = HashMap::with_capacity(self.points.len());
        let replacement = |(i, p): (usize, &[f64; 3])| {
            // Adding 0 turns -0 into 0.
            let first = *first.entry(p.map(|x| (x + 0.0).to_bits())).or_insert(i as u32);
            if (first as usize) < limit(i) { first } else { i as u32 }
        };
        let merged: Vec<u32> = self.points.iter().enumerate().map(replacement).collect();
        let n = merged.iter().enumerate().filter(|&(i, &point)| point as usize != i).count();
        if n > 0 {
            let pieces = if starts.len() > 1 { format!("{} pieces; ", starts.len()) } else { String::new() };
            self.warnings.push(format!("{pieces}{n} points that coincide with others are merged"));
            self.merged = merged;
        }
    }

    /// Removes the points that are replaced, and their values, and moves together what is kept.
    pub(super) fn remove_replaced(&mut self, points: &mut Vec<[f32; 3]>) {
        if self.merged.is_empty() {
            return;
        }
        let kept = |i: usize| self.merged.get(i).is_some_and(|&point| point as usize == i);
        let mut new = vec![0; points.len()];
        (0..points.len()).filter(|&i| kept(i)).zip(0..).for_each(|(i, position)| new[i] = position);
        self.tets.as_flattened_mut().iter_mut().for_each(|v| *v = new[*v as usize]);
        retain(points, kept);
        for array in self.arrays.iter_mut().filter(|a| a.on == On::Points) {
            retain(&mut array.values, |i| kept(i / array.components));
        }
    }
}

/// Keeps the values whose position satisfies a condition.
fn retain<T>(values: &mut Vec<T>, kept: impl Fn(usize) -> bool) {
    let mut positions = 0..;
    values.retain(|_| positions.next().is_some_and(&kept));
}
