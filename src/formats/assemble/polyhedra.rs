//! Cells that are split around a point in their middle: polyhedra, which a file describes by their faces, and quadratic cells.

use std::ops::Range;

use super::super::cells::{CellType, Shape};
use super::super::curved::Surface;
use super::super::report::Fate;
use super::Assembly;
use super::cells::volume;
use super::star::Star;
use crate::error::{Error, Result};
use crate::mesh::On;

/// Points that are added in the middle of cells.
#[derive(Default)]
pub(super) struct Centres {
    points: Vec<[f64; 3]>,
    /// The points of all of these cells that count there, and their weights.
    corners: Vec<(u32, f64)>,
    /// Where those of each cell end.
    ends: Vec<usize>,
}

impl Assembly {
    /// Adds the next cell of the file, a polyhedron. `faces` holds the number of its faces, and for each face the number
    /// of its points and these, indices of points of a piece that has the points `piece`.
    ///
    /// Faces are cut into triangles by [`cut`], and each triangle forms a tetrahedron with the mean of the corners, which
    /// lies in every convex cell. So the pieces fit those of neighbours, and the winding of faces, which files disagree
    /// about, does not matter. A polyhedron of four corners and triangles is a tetrahedron itself. Where the mean does not
    /// see all of the surface, pieces overlap, and the cell counts as tangled.
    pub fn push_polyhedron(&mut self, kind: CellType, faces: &[i64], piece: Range<usize>) -> Result<()> {
        let id = self.next_id()?;
        let fail = |message: String| self.cell_error(id, kind, message);
        let (&count, mut rest) = faces.split_first().ok_or_else(|| fail("its list of faces is empty".into()))?;
        let mut star = Star::default();
        for face in 0..count {
            let length = rest.first().and_then(|&n| usize::try_from(n).ok()).filter(|&n| n < rest.len());
            let length = length.ok_or_else(|| fail(format!("its list of {count} faces ends in face {face}")))?;
            let (nodes, others) = rest[1..].split_at(length);
            rest = others;
            self.check(id, kind, nodes, &piece)?;
            star.add(nodes.iter().map(|&node| (piece.start + node as usize) as u32), |point| self.place(point));
        }
        if !rest.is_empty() {
            return Err(fail(format!("its list goes on for {} numbers after its {count} faces", rest.len())));
        }
        star.sort();
        let (before, n) = (self.tets.len(), star.corners.len());
        if let (&[a, b, c, d], 4) = (star.corners.as_slice(), star.triangles.len()) {
            self.tets.push([a.1, b.1, c.1, d.1]);
            self.turn(before);
        } else if star.triangles.len() >= 4 {
            let middle = self.add_middle(star.corners.iter().map(|corner| (corner.1, 1.0 / n as f64)))?;
            self.push_star(&star, middle);
        }
        self.n_corners += n as u64;
        self.ids.resize(self.tets.len(), id);
        self.count(kind.name, Fate::Split, (self.tets.len() - before) as u64);
        Ok(())
    }

    /// Adds a quadratic cell as the tetrahedra between the triangles of its surface and its middle; false: its nodes are not
    /// where they should be.
    pub(super) fn push_curved(&mut self, shape: Shape, nodes: &[u32]) -> Result<bool> {
        let places: Vec<[f64; 3]> = nodes.iter().map(|&v| self.points[v as usize]).collect();
        let Some(surface) = Surface::of(shape, &places) else { return Ok(false) };
        let mut star = Star::default();
        for face in &surface.faces {
            star.add(face.iter().map(|&i| nodes[i]), |point| self.place(point));
        }
        star.sort();
        let middle = match surface.middle {
            Some(i) => nodes[i],
            None => self.add_middle(surface.weights.iter().map(|&(i, weight)| (nodes[i], weight)))?,
        };
        self.push_star(&star, middle);
        Ok(true)
    }

    /// Adds the tetrahedra between triangles and a point.
    fn push_star(&mut self, star: &Star, middle: u32) {
        let before = self.tets.len();
        self.tets.extend(star.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|place| star.point(place));
            [a, b, middle, c]
        }));
        self.n_corners += u64::from(middle as usize >= self.points.len());
        let volumes = self.turn(before);
        self.tangled += u64::from(star.is_tangled(&volumes));
    }

    /// Gives tetrahedra positive volumes, from number `start` on, and counts flat ones. Returns the volumes that they had.
    fn turn(&mut self, start: usize) -> Vec<f64> {
        let turn = |tet: &mut [u32; 4]| {
            let at = |v: u32| self.points.get(v as usize).unwrap_or_else(|| &self.centres.points[v as usize - self.points.len()]);
            let volume = volume(tet.map(|v| *at(v)));
            self.flat += u64::from(volume == 0.0);
            if volume < 0.0 {
                tet.swap(0, 1);
            }
            volume
        };
        self.tets[start..].iter_mut().map(turn).collect()
    }

    /// The number of a new point: the sum of some others with these weights.
    fn add_middle(&mut self, corners: impl Iterator<Item = (u32, f64)>) -> Result<u32> {
        let number = u32::try_from(self.points.len() + self.centres.points.len());
        let number = number.map_err(|_| Error::TooLarge(format!("{}: more than 2^32 points", self.path.display())))?;
        let begin = self.centres.corners.len();
        self.centres.corners.extend(corners);
        let corners = &self.centres.corners[begin..];
        let sum = |c: usize| corners.iter().map(|&(v, weight)| self.points[v as usize][c] * weight).sum();
        self.centres.points.push([0, 1, 2].map(sum));
        self.centres.ends.push(self.centres.corners.len());
        Ok(number)
    }

    /// Appends the points in the middle of cells to those of the file, with the weighted sums of the values around them.
    /// Returns how many there are.
    pub(super) fn append_centres(&mut self) -> u64 {
        let Centres { points, corners, ends } = std::mem::take(&mut self.centres);
        let begins = || std::iter::once(&0).chain(&ends).copied();
        let n = self.points.len();
        for array in self.arrays.iter_mut().filter(|array| array.on == On::Points && array.values.len() == n * array.components) {
            for (begin, &end) in begins().zip(&ends) {
                let corners = &corners[begin..end];
                for c in 0..array.components {
                    let value = |v: u32| f64::from(array.values[v as usize * array.components + c]);
                    array.values.push(corners.iter().map(|&(v, weight)| value(v) * weight).sum::<f64>() as f32);
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
