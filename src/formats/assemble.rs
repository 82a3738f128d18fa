//! Conversion of the points, cells and arrays of a file to a [`Mesh`] and its [`Report`], shared by all formats.

use std::path::PathBuf;

use super::array::{Array, Names, length};
use super::budget::Budget;
use super::cells::ghost;
use super::loss::MOST_COMPONENTS;
use super::report::{CellCount, Fate, Report};
use super::source::{Source, excerpt};
use super::{Curved, LoadOptions, Merge};
use crate::error::{Error, Result};
use crate::grid::COORDINATE_LIMIT;
use crate::mesh::{Field, Mesh, On};
use polyhedra::Centres;
use scale::remark_on_resolution;

/// A mesh under construction. Set the points, push the cells in file order, add the arrays, then call
/// [`finish`](Assembly::finish).
pub(crate) struct Assembly {
    /// The file that was named.
    path: PathBuf,
    /// The files that it lists, and the number of the first cell of each.
    files: Vec<(PathBuf, usize)>,
    pub format: String,
    /// Size of all files read.
    pub bytes: u64,
    points: Vec<[f64; 3]>,
    /// The first point and the block of each piece.
    pieces: Vec<[usize; 2]>,
    /// The first point, of those that may become one, at the place of each point; empty: no two points coincide.
    places: Vec<u32>,
    merge: Merge,
    curved: Curved,
    /// Number of the first point in the format, for messages.
    pub first_point: i64,
    /// Numbers of the points in the file, for messages; empty: they follow each other.
    pub point_tags: Vec<i64>,
    pub arrays: Vec<Array>,
    pub warnings: Vec<String>,
    /// Limit for the NaN that fill arrays which do not cover the mesh.
    pub padding: Budget,
    /// Points that polyhedra add to those of the file.
    centres: Centres,
    tets: Vec<[u32; 4]>,
    /// File cell of each tetrahedron.
    ids: Vec<u32>,
    n_cells: usize,
    counts: Vec<CellCount>,
    negative: u64,
    flat: u64,
    tangled: u64,
    /// Cells with nodes besides their corners, of which only these are used.
    straightened: u64,
    /// Whether some of these are quadratic.
    has_quadratic: bool,
    /// Number of corners of all cells together.
    n_corners: u64,
}

impl Assembly {
    pub fn new(source: &Source, options: &LoadOptions, format: String) -> Self {
        Self {
            path: source.path.clone(),
            files: Vec::new(),
            format,
            bytes: source.len() as u64,
            points: Vec::new(),
            pieces: Vec::new(),
            places: Vec::new(),
            merge: options.merge,
            curved: options.curved,
            first_point: 0,
            point_tags: Vec::new(),
            arrays: Vec::new(),
            warnings: Vec::new(),
            padding: Budget::new(source.len(), options),
            centres: Centres::default(),
            tets: Vec::new(),
            ids: Vec::new(),
            n_cells: 0,
            counts: Vec::new(),
            negative: 0,
            flat: 0,
            tangled: 0,
            straightened: 0,
            has_quadratic: false,
            n_corners: 0,
        }
    }

    /// An error about a cell; `place` describes it, given its number in its file.
    fn error_at(&self, cell: u32, place: impl FnOnce(usize) -> String, message: String) -> Error {
        let listed = self.files[..self.files.partition_point(|file| file.1 <= cell as usize)].last();
        let (path, first) = listed.map_or((&self.path, 0), |(path, first)| (path, *first));
        Error::File { path: path.clone(), place: format!("{}: ", place(cell as usize - first)), message }
    }

    /// Number of points of the file.
    pub fn n_points(&self) -> usize {
        self.points.len()
    }

    /// The points of the file.
    pub fn into_points(self) -> Vec<[f64; 3]> {
        self.points
    }

    /// Number of cells pushed so far.
    pub fn cells(&self) -> usize {
        self.n_cells
    }

    /// Reserves memory for cells that are expected.
    pub fn reserve(&mut self, cells: usize) {
        self.tets.reserve(cells);
        self.ids.reserve(cells);
    }

    /// Counts the next cell of the file without reading its nodes.
    pub fn skip(&mut self, name: &str, fate: Fate) {
        self.count(name, fate, 0);
    }

    fn count(&mut self, name: &str, fate: Fate, tetrahedra: u64) {
        self.n_cells += 1;
        let found = self.counts.iter().rposition(|c| c.fate == fate && c.name == name);
        let i = found.unwrap_or_else(|| {
            self.counts.push(CellCount { name: name.into(), count: 0, fate, tetrahedra: 0 });
            self.counts.len() - 1
        });
        self.counts[i].count += 1;
        self.counts[i].tetrahedra += tetrahedra;
    }

    /// Checks the whole mesh and converts it to single precision.
    pub fn finish(mut self) -> Result<(Mesh, Report)> {
        if self.tets.is_empty() {
            let found: Vec<String> = self.counts.iter().map(|c| format!("{} {}", c.count, c.name)).collect();
            let found = if found.is_empty() { "and no other cells".into() } else { format!("only {}", found.join(", ")) };
            let also = self.warnings.join("; ");
            let also = if also.is_empty() { also } else { format!(" ({also})") };
            let message = format!("the file has no tetrahedra or cells that can be split into some, {found}{also}");
            return Err(Error::File { path: self.path, place: String::new(), message });
        }
        if self.points.len() >= u32::MAX as usize || self.tets.len() >= (u32::MAX / 4) as usize {
            let message = format!("{}: {} points and {} tetrahedra", self.path.display(), self.points.len(), self.tets.len());
            return Err(Error::TooLarge(message));
        }
        let added_points = self.append_centres();
        let mut used = self.used(added_points)?;
        let merged = self.merge_points(&mut used);
        let (lo, hi) = bounds(&self.points, &used);
        let origin = Self::origin(lo, hi);
        let mut points = self.convert(&used, origin)?;
        let n_used = used.iter().filter(|&&u| u).count() as u64;
        if n_used == self.n_corners && self.ids.first() != self.ids.last() {
            let remedy = "--merge all (Merge::All) makes coinciding points one";
            self.warnings.push(format!("each cell has points of its own, so every face counts as boundary and queries are slow; {remedy}"));
        }
        self.warnings.extend(self.remark_on_small_cells(&points, origin, [lo, hi]));
        self.remove_replaced(&merged, &mut points, &mut used);
        let fields = self.fields(&used);
        if self.straightened > 0 {
            let n = self.straightened;
            let remedy = match (self.has_quadratic, self.curved) {
                (true, Curved::Corners) => "; --curved split (Curved::Split) uses all nodes of quadratic ones",
                (true, Curved::Split) => "; the nodes of quadratic ones among them lie far from the middles of their edges",
                _ => "",
            };
            self.warnings.push(format!(
                "{n} cells of higher order are taken by their corners: their edges are straight, and fields are linear in them{remedy}"
            ));
        }
        if self.tangled > 0 {
            let remedy = "volumes, owners and values there may be wrong; split them into convex cells first";
            self.warnings
                .push(format!("{} split cells are so warped, or so far from convex, that pieces of them overlap: {remedy}", self.tangled));
        }
        let missing = self.counts.iter().filter(|c| c.fate == Fate::Unsupported).map(|c| format!("{} {}", c.count, c.name));
        let missing = missing.collect::<Vec<_>>().join(", ");
        if !missing.is_empty() {
            self.warnings.push(format!("volume cells of types that cannot be read are missing in the mesh: {missing}"));
        }
        let report = Report {
            format: self.format,
            bytes: self.bytes,
            seconds: 0.0,
            points: points.len() as u64,
            unused_points: points.len() as u64 - n_used,
            added_points,
            cells: self.counts,
            tetrahedra: self.tets.len() as u64,
            negative: self.negative,
            flat: self.flat,
            tangled: self.tangled,
            bounds: [lo, hi],
            origin,
            warnings: self.warnings,
        };
        let plain = self.n_cells == self.tets.len() && self.ids.iter().enumerate().all(|(i, &id)| i == id as usize);
        let cell_ids = (!plain).then_some(self.ids);
        Ok((Mesh { points, tets: self.tets, cell_ids, point_ids: None, source_cells: self.n_cells as u32, fields, origin }, report))
    }

    /// Marks the points that tetrahedra use; returns an error if one of these is not finite.
    fn used(&self, added_points: u64) -> Result<Vec<bool>> {
        let mut used = vec![false; self.points.len()];
        // Where an added point is not finite, one that the file has at the same cell is not.
        let in_file = self.points.len() - added_points as usize;
        for (tet, id) in self.tets.iter().zip(&self.ids) {
            for &v in tet {
                if !used[v as usize] && (v as usize) < in_file && self.points[v as usize].iter().any(|x| !x.is_finite()) {
                    return Err(self.bad_point(v as usize, *id, "its coordinates must be finite"));
                }
                used[v as usize] = true;
            }
        }
        Ok(used)
    }

    fn bad_point(&self, point: usize, cell: u32, why: &str) -> Error {
        let [x, y, z] = self.points[point];
        let number = self.point_tags.get(point).copied().unwrap_or((point as i64).saturating_add(self.first_point));
        // Points of listed files are numbered over all files, which tells the user nothing.
        let what = if self.files.is_empty() { format!("point {number}") } else { "a point".into() };
        self.error_at(cell, |cell| format!("{what} (of cell {cell})"), format!("({x:?}, {y:?}, {z:?}): {why}"))
    }

    /// The vector to subtract from all points: on each axis the lower bound if the mesh is small compared with its
    /// distance from 0, so that single precision suffices for its shape, and for points, voxels and samples within it.
    /// A mesh up to 16 extents away is not moved; its coordinates keep 20 bits.
    fn origin(lo: [f64; 3], hi: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|c| {
            let extent = hi[c] - lo[c];
            let far = lo[c].abs().max(hi[c].abs()) > 16.0 * extent;
            if far { lo[c] } else { 0.0 }
        })
    }

    fn convert(&self, used: &[bool], origin: [f64; 3]) -> Result<Vec<[f32; 3]>> {
        let limit = f64::from(COORDINATE_LIMIT);
        let moved = |p: &[f64; 3]| [0, 1, 2].map(|c| p[c] - origin[c]);
        let too_far = |(p, &u): (&[f64; 3], &bool)| u && moved(p).iter().any(|x| x.abs() >= limit);
        if let Some(point) = self.points.iter().zip(used).position(too_far) {
            let owner = self.tets.iter().position(|t| t.contains(&(point as u32)));
            let cell = owner.map_or(0, |t| self.ids[t]);
            return Err(self.bad_point(point, cell, "beyond the range of single precision (2^125); scale the mesh"));
        }
        Ok(self.points.iter().map(|p| moved(p).map(|x| x as f32)).collect())
    }

    /// Converts arrays to scalar fields; arrays of cells get one value per tetrahedron. Where ghost cells were left out,
    /// points that no tetrahedron uses have no value: writers fill them with anything.
    fn fields(&mut self, used_points: &[bool]) -> Vec<Field> {
        let mut fields = Vec::new();
        let ghosts = self.counts.iter().any(|cells| cells.fate == Fate::Ghost);
        let mut used_cells = vec![false; self.n_cells];
        self.ids.iter().for_each(|&id| used_cells[id as usize] = true);
        let mut names = Names::default();
        // What marks ghost cells and points is no field.
        for mut array in std::mem::take(&mut self.arrays).into_iter().filter(|array| ghost(&array.name).is_none()) {
            let (used, what) = if array.on == On::Points { (used_points, "points") } else { (&used_cells[..], "cells") };
            let shown = excerpt(array.name.as_bytes());
            if array.components == 0 || array.components > MOST_COMPONENTS {
                self.warnings.push(format!("array `{shown}` is left out: {} components", array.components));
                continue;
            }
            let wanted = used.len() * array.components;
            if array.values.len() != wanted {
                self.warnings.push(format!("array `{shown}` is left out: {} values instead of {wanted}", array.values.len()));
                continue;
            }
            let (mut missing, mut of) = (0, 0);
            for (tuple, &used) in array.values.chunks_exact_mut(array.components).zip(used) {
                of += usize::from(used);
                missing += usize::from(used && tuple.iter().any(|v| !v.is_finite()));
                tuple.iter_mut().filter(|v| ghosts && !used || !v.is_finite()).for_each(|v| *v = f32::NAN);
            }
            if missing > 0 {
                let none = "has no value, or none that is finite in single precision,";
                self.warnings.push(format!("array `{shown}` {none} at {missing} of {of} {what}"));
            }
            self.warnings.extend(remark_on_resolution(&array));
            let name = names.free(&array);
            if name != array.name {
                self.warnings.push(format!("another array `{shown}` is called `{}`", excerpt(name.as_bytes())));
            }
            let ids = self.ids.iter().map(|&id| id as usize);
            let spread = |values: Vec<f32>| if array.on == On::Cells { ids.clone().map(|id| values[id]).collect() } else { values };
            if array.components == 1 {
                fields.push(Field { name, on: array.on, values: spread(array.values) });
                continue;
            }
            let tuples = || array.values.chunks_exact(array.components);
            let lengths = (array.components == 3).then(|| tuples().map(|v| length(v.iter().copied())).collect());
            let parts = (0..array.components).map(|c| tuples().map(|v| v[c]).collect());
            for (suffix, values) in array.suffixes().iter().zip(lengths.into_iter().chain(parts)) {
                fields.push(Field { name: format!("{name}{suffix}"), on: array.on, values: spread(values) });
            }
        }
        fields
    }
}

fn bounds(points: &[[f64; 3]], used: &[bool]) -> ([f64; 3], [f64; 3]) {
    let start = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    points
        .iter()
        .zip(used)
        .filter(|(_, u)| **u)
        .fold(start, |(lo, hi), (p, _)| ([0, 1, 2].map(|c| lo[c].min(p[c])), [0, 1, 2].map(|c| hi[c].max(p[c]))))
}

mod cells;
mod pieces;
mod polyhedra;
mod scale;
mod star;
#[cfg(test)]
mod tests;
