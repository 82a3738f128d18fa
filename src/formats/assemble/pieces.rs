//! Meshes that consist of several pieces, in one file or in several.

use std::collections::HashMap;
use std::path::Path;

use super::super::Merge;
use super::super::cells::ghost;
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

    /// Sets the points of a mesh in one piece.
    pub fn set_points(&mut self, points: Vec<[f64; 3]>) {
        self.set_pieces(points, vec![[0, 0]]);
    }

    /// Sets the points of all pieces; `pieces` holds the first point and the number of the block of each.
    pub fn set_pieces(&mut self, points: Vec<[f64; 3]>, pieces: Vec<[usize; 2]>) {
        (self.points, self.pieces) = (points, pieces);
        if self.merge == Merge::Nothing || (self.merge == Merge::Pieces && self.pieces.len() < 2) {
            return;
        }
        let mut first: HashMap<[u64; 3], u32> = HashMap::with_capacity(self.points.len());
        let place = |(i, p): (usize, &[f64; 3])| {
            // Adding 0 turns -0 into 0.
            let first = *first.entry(p.map(|x| (x + 0.0).to_bits())).or_insert(i as u32);
            if self.may_be_one(first as usize, i) { first } else { i as u32 }
        };
        let places: Vec<u32> = self.points.iter().enumerate().map(place).collect();
        if places.iter().enumerate().any(|(i, &place)| place as usize != i) {
            self.places = places;
        }
    }

    /// The number of the piece that has a point.
    fn piece(&self, point: usize) -> usize {
        self.pieces.partition_point(|[first, _]| *first <= point).saturating_sub(1)
    }

    /// Whether two points that coincide may become one, whatever their values are.
    fn may_be_one(&self, a: usize, b: usize) -> bool {
        self.merge == Merge::All || self.piece(a) != self.piece(b)
    }

    /// The position of an array that has different values at two points of different blocks. The pieces of a block are
    /// one mesh, but a field may jump between blocks.
    fn jump(&self, a: usize, b: usize) -> Option<usize> {
        let block = |point| self.pieces.get(self.piece(point)).map(|[_, block]| block);
        if self.merge == Merge::All || block(a) == block(b) {
            return None;
        }
        self.arrays.iter().position(|array| {
            let (a, b) = (array.tuple(a), array.tuple(b));
            let largest = a.iter().chain(b).fold(0.0, |most: f32, v| most.max(v.abs()));
            // Beyond what rounding explains; a missing value is no other value.
            let differ = |(x, y): (&f32, &f32)| (x - y).abs() > 1e-6 * largest;
            array.on == On::Points && ghost(&array.name).is_none() && a.iter().zip(b).any(differ)
        })
    }

    /// Makes points one that coincide, within the limits of the option, unless a field jumps there. Each array has the
    /// first value that there is at them. Points that no cell uses, such as those of ghost cells, replace no others.
    /// `used` marks the points of cells. Returns the point that replaces each point, or itself; none if no points coincide.
    pub(super) fn merge_points(&mut self, used: &mut [bool]) -> Vec<u32> {
        /// Most points at one place that are compared. A hostile file has too many to look through all.
        const MOST: usize = 64;
        if self.places.is_empty() {
            return Vec::new();
        }
        let mut merged: Vec<u32> = (0..used.len() as u32).collect();
        let mut first = vec![u32::MAX; used.len()]; // the first point kept at each place
        let mut others: HashMap<u32, Vec<u32>> = HashMap::new();
        let (mut n, mut apart, mut jumps) = (0u64, 0u64, None);
        for of_cells in [true, false] {
            for i in (0..used.len()).filter(|&i| used[i] == of_cells) {
                let place = self.places[i];
                let first = &mut first[place as usize];
                if *first == u32::MAX {
                    *first = i as u32;
                    continue;
                }
                let mut jump = None;
                let kept = std::iter::once(*first).chain(others.get(&place).into_iter().flatten().copied());
                let same = kept.map(|point| point as usize).find(|&point| {
                    let may_be_one = self.may_be_one(point, i);
                    let jumps = if may_be_one && of_cells { self.jump(point, i) } else { None };
                    jump = jump.or(jumps);
                    may_be_one && jumps.is_none()
                });
                if let Some(point) = same {
                    merged[i] = point as u32;
                    n += 1;
                    if of_cells {
                        self.arrays.iter_mut().filter(|array| array.on == On::Points).for_each(|array| array.complete(point, i));
                    }
                } else {
                    apart += u64::from(jump.is_some());
                    jumps = jumps.or(jump);
                    let others = others.entry(place).or_default();
                    others.extend((others.len() < MOST).then_some(i as u32));
                }
            }
        }
        for v in self.tets.as_flattened_mut() {
            *v = merged[*v as usize];
        }
        used.iter_mut().zip(&merged).enumerate().for_each(|(i, (used, &point))| *used &= point as usize == i);
        if n > 0 {
            let pieces = if self.pieces.len() > 1 { format!("{} pieces; ", self.pieces.len()) } else { String::new() };
            self.warnings.push(format!("{pieces}{n} points that coincide with others are merged"));
        }
        if let Some(array) = jumps {
            let name = excerpt(self.arrays[array].name.as_bytes());
            let why = format!("coincide with one of another block, but have another value of `{name}` or of other arrays");
            let remedy = "they are not merged, so that fields are right; --merge all (Merge::All) merges them, and the first value counts";
            self.warnings.push(format!("{apart} points {why}: {remedy}"));
        }
        merged
    }

    /// Removes the points that are replaced, and their values, and moves together what is kept.
    pub(super) fn remove_replaced(&mut self, merged: &[u32], points: &mut Vec<[f32; 3]>, used: &mut Vec<bool>) {
        if merged.is_empty() {
            return;
        }
        let kept = |i: usize| merged.get(i).is_some_and(|&point| point as usize == i);
        let mut new = vec![0; points.len()];
        (0..points.len()).filter(|&i| kept(i)).zip(0..).for_each(|(i, position)| new[i] = position);
        self.tets.as_flattened_mut().iter_mut().for_each(|v| *v = new[*v as usize]);
        retain(points, kept);
        retain(used, kept);
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
