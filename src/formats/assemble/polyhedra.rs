//! Polyhedra: cells that a file describes by their faces.

use std::ops::Range;

use super::super::cells::{CellType, cut};
use super::super::report::Fate;
use super::Assembly;
use super::cells::volume;
use crate::error::{Error, Result};
use crate::mesh::On;

/// Points that are added in the middle of polyhedra.
#[derive(Default)]
pub(super) struct Centres {
    points: Vec<[f64; 3]>,
    /// The corners of all of these polyhedra.
    corners: Vec<u32>,
    /// Where those of each polyhedron end.
    ends: Vec<usize>,
}

impl Assembly {
    /// Adds the next cell of the file, a polyhedron. `faces` holds the number of its faces, and for each face the number
    /// of its points and these, indices of points of a piece that has the points `piece`.
    ///
    /// Faces are cut into triangles by [`cut`], and each triangle forms a tetrahedron with the mean of the corners, which
    /// lies in every convex cell. So the pieces fit those of neighbours, and the winding of faces, which files disagree
    /// about, does not matter. A polyhedron of four corners and triangles is a tetrahedron itself.
    pub fn push_polyhedron(&mut self, kind: CellType, faces: &[i64], piece: Range<usize>) -> Result<()> {
        let id = self.next_id()?;
        let fail = |message: String| self.cell_error(id, kind, message);
        let (&count, mut rest) = faces.split_first().ok_or_else(|| fail("its list of faces is empty".into()))?;
        // The number of each corner's place, see `Assembly::place`, and of the point.
        let (mut corners, mut triangles) = (Vec::new(), Vec::new());
        for face in 0..count {
            let length = rest.first().and_then(|&n| usize::try_from(n).ok()).filter(|&n| n < rest.len());
            let length = length.ok_or_else(|| fail(format!("its list of {count} faces ends in face {face}")))?;
            let (nodes, others) = rest[1..].split_at(length);
            rest = others;
            self.check(id, kind, nodes, &piece)?;
            let points = nodes.iter().map(|&node| (piece.start + node as usize) as u32);
            let places: Vec<u32> = points.clone().map(|point| self.place(point)).collect();
            cut(&places, |triangle| triangles.push(triangle));
            corners.extend(places.into_iter().zip(points));
        }
        if !rest.is_empty() {
            return Err(fail(format!("its list goes on for {} numbers after its {count} faces", rest.len())));
        }
        corners.sort_unstable();
        corners.dedup_by_key(|corner| corner.0);
        let point = |place: u32| corners[corners.partition_point(|corner| corner.0 < place)].1;
        let (before, n) = (self.tets.len(), corners.len());
        if let (&[a, b, c, d], 4) = (corners.as_slice(), triangles.len()) {
            self.tets.push([a.1, b.1, c.1, d.1]);
        } else if triangles.len() >= 4 {
            let middle = self.add_middle(corners.iter().map(|corner| corner.1))?;
            self.tets.extend(triangles.iter().map(|&[a, b, c]| [point(a), point(b), middle, point(c)]));
            self.n_corners += 1;
        }
        for tet in &mut self.tets[before..] {
            let at = |v: u32| self.points.get(v as usize).unwrap_or_else(|| &self.centres.points[v as usize - self.points.len()]);
            let volume = volume(tet.map(|v| *at(v)));
            self.flat += u64::from(volume == 0.0);
            if volume < 0.0 {
                tet.swap(0, 1);
            }
        }
        self.n_corners += n as u64;
        self.ids.resize(self.tets.len(), id);
        self.count(kind.name, Fate::Split, (self.tets.len() - before) as u64);
        Ok(())
    }

    /// The number of a new point: the mean of some others.
    fn add_middle(&mut self, corners: impl ExactSizeIterator<Item = u32>) -> Result<u32> {
        let number = u32::try_from(self.points.len() + self.centres.points.len());
        let number = number.map_err(|_| Error::TooLarge(format!("{}: more than 2^32 points", self.path.display())))?;
        let (n, begin) = (corners.len() as f64, self.centres.corners.len());
        self.centres.corners.extend(corners);
        let corners = &self.centres.corners[begin..];
        let sum = |c: usize| corners.iter().map(|&v| self.points[v as usize][c] / n).sum();
        self.centres.points.push([0, 1, 2].map(sum));
        self.centres.ends.push(self.centres.corners.len());
        Ok(number)
    }

    /// Appends the points in the middle of polyhedra to those of the file, with the means of the values at their corners.
    /// Returns how many there are.
    pub(super) fn append_centres(&mut self) -> u64 {
        let Centres { points, corners, ends } = std::mem::take(&mut self.centres);
        let begins = || std::iter::once(&0).chain(&ends).copied();
        let n = self.points.len();
        for array in self.arrays.iter_mut().filter(|array| array.on == On::Points && array.values.len() == n * array.components) {
            for (begin, &end) in begins().zip(&ends) {
                let corners = &corners[begin..end];
                for c in 0..array.components {
                    let sum: f64 = corners.iter().map(|&v| f64::from(array.values[v as usize * array.components + c])).sum();
                    array.values.push((sum / corners.len() as f64) as f32);
                }
            }
        }
        if !self.places.is_empty() {
            self.places.extend((n..n + points.len()).map(|i| i as u32));
        }
        self.points.extend(&points);
        points.len() as u64
    }
}
