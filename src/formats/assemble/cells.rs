//! Cells of a mesh under construction: checked, and split into tetrahedra.

use std::ops::Range;

use super::super::Curved;
use super::super::cells::{CellType, MOST_CORNERS, Shape, split};
use super::super::curved::{is_quadratic, split_tetrahedron};
use super::super::report::Fate;
use super::Assembly;
use crate::error::{Error, Result};

impl Assembly {
    /// The number of the next cell of the file.
    #[inline]
    pub(super) fn next_id(&self) -> Result<u32> {
        let id = u32::try_from(self.n_cells).ok().filter(|&id| id < u32::MAX);
        id.ok_or_else(|| Error::TooLarge(format!("{}: more than 2^32 cells", self.path.display())))
    }

    pub(super) fn cell_error(&self, id: u32, kind: CellType, message: String) -> Error {
        self.error_at(id, |cell| format!("cell {cell} ({})", kind.name), message)
    }

    /// Checks that the nodes of a cell are points of the piece.
    #[inline]
    pub(super) fn check(&self, id: u32, kind: CellType, nodes: &[i64], piece: &Range<usize>) -> Result<()> {
        let n_points = piece.len();
        let Some(bad) = nodes.iter().find(|&&v| usize::try_from(v).map_or(true, |v| v >= n_points)) else { return Ok(()) };
        let shown = bad.saturating_add(self.first_point);
        let last = (n_points as i64 - 1).saturating_add(self.first_point);
        let range = if n_points == 0 { "there are none".to_owned() } else { format!("points are {} to {last}", self.first_point) };
        Err(self.cell_error(id, kind, format!("names point {shown}, but {range}")))
    }

    /// The first point at the place of a point. Points at the same place count as one where faces are cut, so that cells
    /// which share a face cut it in the same way.
    pub(super) fn place(&self, point: u32) -> u32 {
        self.places.get(point as usize).copied().unwrap_or(point)
    }

    /// Adds the next cell of the file. `nodes` are indices of points.
    pub fn push(&mut self, kind: CellType, nodes: &[i64]) -> Result<()> {
        self.push_within(kind, nodes, 0..self.points.len())
    }

    /// Adds the next cell of the file. `nodes` are indices of points of a piece, which has the points `piece`.
    #[inline]
    pub fn push_within(&mut self, kind: CellType, nodes: &[i64], piece: Range<usize>) -> Result<()> {
        let id = self.next_id()?;
        let n_corners = kind.shape.corners();
        if kind.nodes.map_or(nodes.len() < n_corners, |n| n != nodes.len()) {
            let wanted = kind.nodes.map_or_else(|| format!("at least {n_corners}"), |n| n.to_string());
            return Err(self.cell_error(id, kind, format!("{} points, but this type has {wanted}", nodes.len())));
        }
        self.check(id, kind, nodes, &piece)?;
        let point = |i: usize| (piece.start + nodes[i] as usize) as u32;
        let before = self.tets.len();
        let (fate, used) = match kind.shape {
            Shape::Flat => (Fate::Boundary, 0),
            Shape::Polyhedron | Shape::Other => (Fate::Unsupported, 0),
            Shape::Tetrahedron if nodes.len() == 10 => self.push_quadratic([0, 1, 2, 3, 4, 5, 6, 7, 8, 9].map(point)),
            Shape::Tetrahedron => {
                // Not by `map`, which is not inlined here: reading took a quarter longer.
                self.push_tetrahedron([point(0), point(1), point(2), point(3)]);
                (if nodes.len() == 4 { Fate::Kept } else { Fate::Straightened }, 4)
            }
            shape => (Fate::Split, self.push_split(shape, nodes.len(), point)?),
        };
        if 0 < used && used < nodes.len() {
            self.straightened += 1;
            self.has_quadratic |= is_quadratic(kind.shape, nodes.len());
        }
        self.n_corners += used as u64;
        self.ids.resize(self.tets.len(), id);
        self.count(kind.name, fate, (self.tets.len() - before) as u64);
        Ok(())
    }

    #[inline]
    fn push_tetrahedron(&mut self, tet: [u32; 4]) {
        let volume = self.volume(tet);
        self.negative += u64::from(volume < 0.0);
        self.flat += u64::from(volume == 0.0);
        self.tets.push(tet);
    }

    /// Splits a cell, by all of its nodes or by its corners. Returns how many nodes are used.
    fn push_split(&mut self, shape: Shape, nodes: usize, point: impl Fn(usize) -> u32) -> Result<usize> {
        let whole = self.curved == Curved::Split && is_quadratic(shape, nodes);
        if whole && self.push_curved(shape, &(0..nodes).map(&point).collect::<Vec<_>>())? {
            return Ok(nodes);
        }
        let (before, corners) = (self.tets.len(), shape.corners());
        let mut places = [0; MOST_CORNERS];
        places[..corners].iter_mut().enumerate().for_each(|(i, at)| *at = self.place(point(i)));
        let tets = &mut self.tets;
        split(shape, &places[..corners], |tet| tets.push(tet.map(|v| places.iter().position(|p| *p == v).map_or(v, &point))));
        self.orient(before);
        Ok(corners)
    }

    /// Adds a tetrahedron of ten nodes, whole or by its corners. Returns what became of it, and how many nodes are used.
    fn push_quadratic(&mut self, nodes: [u32; 10]) -> (Fate, usize) {
        let whole = self.curved == Curved::Split;
        let Some(eight) = whole.then(|| split_tetrahedron(nodes.map(|v| self.points[v as usize]))).flatten() else {
            self.push_tetrahedron([nodes[0], nodes[1], nodes[2], nodes[3]]);
            return (Fate::Straightened, 4);
        };
        let before = self.tets.len();
        self.tets.extend(eight.map(|tet| tet.map(|i| nodes[i])));
        self.orient(before);
        (Fate::Split, 10)
    }

    /// Orients the pieces of a cell, from tetrahedron `start` on, so that their total volume is positive, and counts
    /// flat and tangled ones.
    fn orient(&mut self, start: usize) {
        let volumes = || self.tets[start..].iter().map(|&tet| self.volume(tet));
        let turn = volumes().sum::<f64>() < 0.0;
        let flat = volumes().filter(|&v| v == 0.0).count();
        let tangled = volumes().any(|v| if turn { v > 0.0 } else { v < 0.0 });
        self.flat += flat as u64;
        self.tangled += u64::from(tangled);
        if turn {
            for tet in &mut self.tets[start..] {
                tet.swap(2, 3);
            }
        }
    }

    /// Six times the signed volume of a tetrahedron.
    fn volume(&self, [a, b, c, d]: [u32; 4]) -> f64 {
        let at = |v: u32| self.points[v as usize];
        volume([at(a), at(b), at(c), at(d)])
    }
}

/// Six times the signed volume of a tetrahedron.
#[inline]
pub(super) fn volume([a, b, c, d]: [[f64; 3]; 4]) -> f64 {
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0])
}
