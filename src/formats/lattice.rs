//! Kinds of grids, and structured grids: hexahedra between points that are numbered along x first, then along y, then along z.

use std::ops::Range;

use super::assemble::Assembly;
use super::budget::Budget;
use super::cells;
use super::report::Fate;
use crate::error::Result;

/// The kind of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum GridKind {
    /// Cells of any types.
    Cells,
    /// A surface, of which only the points are read.
    Surface,
    /// Hexahedra between points of a lattice, anywhere.
    Structured,
    /// Hexahedra between points whose coordinates along each axis are given.
    Rectilinear,
    /// Hexahedra between points with constant distances.
    Image(Frame),
}

impl GridKind {
    pub fn has_lattice(self) -> bool {
        matches!(self, Self::Structured | Self::Rectilinear | Self::Image(_))
    }

    /// The kind of grids in VTK XML files of this type.
    pub fn of(name: &str) -> Option<Self> {
        Some(match name {
            "UnstructuredGrid" => Self::Cells,
            "PolyData" => Self::Surface,
            "StructuredGrid" => Self::Structured,
            "RectilinearGrid" => Self::Rectilinear,
            "ImageData" => Self::Image(Frame::default()),
            _ => return None,
        })
    }
}

/// The points of a structured grid, or of a piece of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lattice {
    /// Number of the first point along each axis, in the whole grid.
    first: [i64; 3],
    /// Number of points along each axis.
    size: [u64; 3],
}

/// Where the points of a grid with constant distances are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    /// The point with the numbers 0, 0, 0.
    pub origin: [f64; 3],
    /// The vector from a point to the next along each axis.
    pub steps: [[f64; 3]; 3],
}

impl Default for Frame {
    fn default() -> Self {
        Self { origin: [0.0; 3], steps: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] }
    }
}

impl Lattice {
    /// A lattice of this many points along each axis; `None` if there are too many.
    pub fn of(size: [u64; 3]) -> Option<Self> {
        let size = if size.contains(&0) { [0; 3] } else { size };
        let points = size.iter().try_fold(1u64, |n, &along| n.checked_mul(along));
        points.filter(|&n| n < 1 << 32).map(|_| Self { first: [0; 3], size })
    }

    /// The lattice with these numbers of the first and the last point along each axis, as VTK writes them:
    /// `x0 x1 y0 y1 z0 z1`.
    pub fn parse(extent: &str) -> Option<Self> {
        let ends: Option<Vec<i32>> = extent.split_ascii_whitespace().map(|number| number.parse().ok()).collect();
        let ends: [i32; 6] = ends?.try_into().ok()?;
        let along = |c: usize| [ends[2 * c], ends[2 * c + 1]].map(i64::from);
        let size = [0, 1, 2].map(|c| (along(c)[1] - along(c)[0] + 1).max(0) as u64);
        Some(Self { first: [0, 1, 2].map(|c| along(c)[0]), ..Self::of(size)? })
    }

    pub fn size(&self) -> [u64; 3] {
        self.size
    }

    pub fn points(&self) -> u64 {
        self.size.iter().product()
    }

    /// Number of cells: those of a plane of points are its squares, those of a row the lines between them.
    pub fn cells(&self) -> u64 {
        if self.points() == 0 { 0 } else { self.size.iter().map(|&n| (n - 1).max(1)).product() }
    }

    /// The points in a frame.
    pub fn in_frame(&self, frame: &Frame, points: &mut Vec<[f64; 3]>) {
        let along = |c: usize| {
            let numbers = (0..self.size[c] as i64).map(|i| (self.first[c] + i) as f64);
            numbers
                .map(|n| [0, 1, 2].map(|i| if c == 0 { frame.origin[i] + n * frame.steps[c][i] } else { n * frame.steps[c][i] }))
                .collect()
        };
        sums(&[along(0), along(1), along(2)], points);
    }

    /// The points with these coordinates along the axes, of which there must be as many as the lattice has.
    pub fn at_coordinates(axes: &[Vec<f64>; 3], points: &mut Vec<[f64; 3]>) {
        let along = |c: usize| axes[c].iter().map(|&x| [0, 1, 2].map(|i| if i == c { x } else { 0.0 })).collect();
        sums(&[along(0), along(1), along(2)], points);
    }

    /// Spends the memory for points that are not in the file, and for the cells.
    pub fn spend(&self, budget: &mut Budget) -> Result<(), String> {
        let bytes = self.points() * size_of::<[f64; 3]>() as u64 + self.cells() * 6 * (size_of::<[u32; 4]>() + size_of::<u32>()) as u64;
        budget.spend(bytes).map_err(|limit| format!("{} points would take {limit}", self.points()))
    }

    /// Adds the cells to a mesh whose points `within` are those of the lattice. `is_ghost` tells which to leave out.
    pub fn push(&self, assembly: &mut Assembly, within: Range<usize>, mut is_ghost: impl FnMut(usize) -> Result<bool>) -> Result<()> {
        let Some(hexahedron) = cells::vtk(12) else { return Ok(()) };
        let n = self.size.map(|along| along.saturating_sub(1).max(1));
        let [row, layer] = [self.size[0], self.size[0] * self.size[1]];
        let is_solid = self.size.iter().all(|&along| along > 1);
        if is_solid {
            assembly.reserve(6 * self.cells() as usize);
        }
        for cell in 0..self.cells() {
            let [x, y, z] = [cell % n[0], cell / n[0] % n[1], cell / n[0] / n[1]];
            let at = x + y * row + z * layer;
            if is_ghost(cell as usize)? {
                assembly.skip("ghost or hidden cell", Fate::Ghost);
            } else if is_solid {
                let around = [at, at + 1, at + 1 + row, at + row];
                let [a, b, c, d] = around.map(|v| v as i64);
                let [e, f, g, h] = around.map(|v| (v + layer) as i64);
                assembly.push_within(hexahedron, &[a, b, c, d, e, f, g, h], within.clone())?;
            } else {
                assembly.skip("cell of a flat grid", Fate::Boundary);
            }
        }
        Ok(())
    }
}

/// Points that are the sums of one vector of each axis.
fn sums(axes: &[Vec<[f64; 3]>; 3], points: &mut Vec<[f64; 3]>) {
    for c in &axes[2] {
        for b in &axes[1] {
            points.extend(axes[0].iter().map(|a| [0, 1, 2].map(|i| a[i] + b[i] + c[i])));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extents_are_counted() {
        let counts = |extent: &str| Lattice::parse(extent).map(|lattice| (lattice.points(), lattice.cells()));
        assert_eq!(counts("0 2 -1 3 4 5"), Some((3 * 5 * 2, 2 * 4)));
        assert_eq!(counts(" 0 2\n0 0 0 1 "), Some((6, 2)));
        assert_eq!(counts("0 0 0 0 0 0"), Some((1, 1)));
        assert_eq!([counts("0 -1 0 -1 0 -1"), counts("0 2000000000 0 2000000000 1 0")], [Some((0, 0)); 2]);
        for wrong in ["", "0 1 0 1 0", "0 1 0 1 0 1 0", "0 1 0 1 0 1.5", "0 65535 0 65535 0 1", "0 99999999999 0 1 0 1"] {
            assert_eq!(counts(wrong), None, "{wrong}");
        }
    }
}
