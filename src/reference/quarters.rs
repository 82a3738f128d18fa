//! Quarters: bits of an entry that tell which parts of the leaf's cell its tetrahedron is near, so that a search can
//! skip most of a list. Twin of `glsl/shared/quarters.glsl`.
//!
//! A leaf's cell is cut into four quarters along each axis. An entry is *near* a quarter if the quantized box of its
//! tetrahedron, enlarged by one cell of the finest grid on all sides, meets it. The entry has one bit per quarter, the
//! lowest quarter of the first axis in the lowest bit; these twelve bits stand above the tetrahedron's id in the
//! entry's word. In meshes of more than 2^20 tetrahedra ids leave only six bits, which then stand for halves. A cell is
//! never cut finer than cells of the finest grid.
//!
//! A tetrahedron is also near every point that it owns: its box contains the point, or the point lies outside by at
//! most three times the tolerance in parts of the box (SPEC 3.1.4), which is less than a finest cell for tolerances
//! below 2^-12. For larger tolerances boxes are enlarged by more, and quarters are not used. The octants of leaves are
//! used still, so with such tolerances a point outside the mesh may have an owner under one α and none under another,
//! as at the border of a leaf. On an axis so much shorter than the longest one that normalised coordinates cannot tell
//! its finest cells apart, everything is near.

use super::vertices::Vertices;
use crate::grid::{CellRange, Grid, MAX_LEVEL, per_axis, two_to, unmorton};
use crate::mesh::Mesh;
use rayon::prelude::*;

pub use crate::layout::constants::quarters::ALL_OCTANTS;

/// On an axis with a smaller extent than this in normalised coordinates, a finest cell is less than four steps of the
/// coordinates wide.
pub(super) const COARSE: f32 = two_to(-30);

/// How many times a leaf's cell is halved along each axis.
fn cuts(grid: &Grid) -> u32 {
    (grid.ids.leading_zeros() / 6).min(MAX_LEVEL - grid.level)
}

/// The number of finest cells by which boxes are enlarged on each axis: `least`, or the whole grid on axes that are too
/// short.
fn grown(grid: &Grid, least: u32) -> [u32; 3] {
    per_axis(|c| if grid.extent[c] < COARSE { 1024 } else { least })
}

/// The quarters of the leaf's cell with Morton code `code` that a box of finest cells is near; `grid` is that of the
/// tree.
pub fn quarters_near(grid: &Grid, code: u32, cells: &CellRange) -> u32 {
    let (n, leaf, reach) = (cuts(grid), unmorton(code), grown(grid, 1));
    if n == 0 {
        return 0;
    }
    let along = |c: usize| {
        let first = leaf[c] << n;
        let place = |cell: u32| (cell >> (MAX_LEVEL - grid.level - n)).clamp(first, first + (1 << n) - 1) - first;
        (2 << place(cells.hi[c] + reach[c])) - (1 << place(cells.lo[c].saturating_sub(reach[c])))
    };
    along(0) | along(1) << (1 << n) | along(2) << (2 << n)
}

/// The quarters of all entries, given their Morton codes and tetrahedra; empty if entries have no bits for them.
pub fn quarters(codes: &[u32], primitives: &[u32], grid: &Grid, mesh: &Mesh, vertices: &Vertices) -> Vec<u16> {
    if grid.ids == u32::MAX {
        return Vec::new();
    }
    let near = |(&code, &p): (&u32, &u32)| quarters_near(grid, code, &vertices.cells(mesh.tets[p as usize], MAX_LEVEL)) as u16;
    codes.par_iter().zip(primitives).map(near).collect()
}

/// The octants of its cell that an entry is near: bit d for the 3-bit Morton digit d.
pub fn octants_near(grid: &Grid, quarters: u32) -> u32 {
    let n = cuts(grid);
    if n == 0 {
        return ALL_OCTANTS;
    }
    let width = 1 << n;
    let half = |c: u32, upper: u32| quarters >> (c * width + upper * width / 2) & ((1 << (width / 2)) - 1) != 0;
    let near = |d: &u32| half(0, d >> 2 & 1) && half(1, d >> 1 & 1) && half(2, d & 1);
    (0..8).filter(near).fold(0, |mask, d| mask | 1 << d)
}

/// Whether quarters and slabs leave room for a tolerance: that of one finest cell.
pub fn leaves_room(grid: &Grid, tolerance: f32) -> bool {
    cells_beyond(grid, tolerance) == 1
}

/// The finest cells of a graded grid may be 64 times as small.
fn cells_beyond(grid: &Grid, tolerance: f32) -> u32 {
    1 + (tolerance.clamp(0.0, 1.0) * if grid.graded == 0 { 4096.0 } else { 262_144.0 }) as u32
}

/// The number of finest cells by which the box of a tetrahedron is enlarged on each axis, so that it contains every
/// point that this tolerance lets the tetrahedron own.
pub fn reach(grid: &Grid, tolerance: f32) -> [u32; 3] {
    grown(grid, cells_beyond(grid, tolerance))
}

/// Whether a tetrahedron's quantized box is near enough for it to own a point in that finest cell.
pub fn is_near(cells: &CellRange, cell: [u32; 3], reach: [u32; 3]) -> bool {
    (0..3).all(|c| cells.lo[c] <= cell[c] + reach[c] && cell[c].saturating_sub(reach[c]) <= cells.hi[c])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Lists;
    use crate::tree::stored::id_mask;

    /// The quarters found by testing every finest cell of the leaf.
    fn counted(grid: &Grid, code: u32, cells: &CellRange, parts: u32) -> u32 {
        let (leaf, side) = (unmorton(code), 1 << (MAX_LEVEL - grid.level));
        let mut bits = 0;
        for (c, at) in leaf.iter().map(|k| k * side).enumerate() {
            let near = (at..at + side).filter(|&cell| cells.lo[c] <= cell + 1 && cell <= cells.hi[c] + 1);
            bits |= near.fold(0, |bits, cell| bits | 1 << ((cell - at) * parts / side)) << (c as u32 * parts);
        }
        bits
    }

    #[test]
    fn quarters_or_halves_are_those_that_a_grown_box_meets() {
        let cases = [(1 << 20, 6, 4, 8), (1 << 20, 8, 4, 4), (1 << 20, 9, 2, 1), ((1 << 20) + 1, 7, 2, 3), (1 << 26, 8, 2, 3)];
        for (tets, level, parts, variety) in cases {
            let grid = Grid { level, extent: [1.0; 4], ids: id_mask(Lists::Boundary, tets), ..Grid::default() };
            let code = 0o1_234_567 & ((1 << (3 * level)) - 1);
            let first = unmorton(code).map(|k| k << (MAX_LEVEL - level));
            let side = 1 << (MAX_LEVEL - level);
            let mut different = std::collections::HashSet::new();
            for lo in 0..side + 2 {
                for hi in lo.max(2)..side + 4 {
                    // The box reaches from up to two cells before the leaf's cell to up to two after it, equally along
                    // the first and the last axis.
                    let [from, to] = [lo, hi].map(|k| first.map(|f| (f + k).saturating_sub(2)));
                    let cells = CellRange { lo: [from[0], first[1], from[2]], hi: [to[0], first[1] + hi / 2, to[2]] };
                    let near = quarters_near(&grid, code, &cells);
                    assert_eq!(near, counted(&grid, code, &cells, parts), "{tets} {level} {cells:?}");
                    different.insert(near);
                    let half = |c: u32, upper: u32| near >> (c * parts + upper * parts / 2) & ((1 << (parts / 2)) - 1) != 0;
                    let octant = |d: &u32| half(0, d >> 2 & 1) && half(1, d >> 1 & 1) && half(2, d & 1);
                    assert_eq!(octants_near(&grid, near), (0..8).filter(octant).map(|d| 1 << d).sum::<u32>());
                }
            }
            assert!(different.len() >= variety, "{different:?}");
        }
    }

    #[test]
    fn where_there_are_no_bits_or_no_finer_cells_nothing_is_passed_over() {
        let cells = CellRange { lo: [3; 3], hi: [3; 3] };
        for (level, tets, lists) in [(10, 5, Lists::Boundary), (4, (1 << 26) + 1, Lists::Boundary), (4, 5, Lists::All)] {
            let grid = Grid { level, extent: [1.0; 4], ids: id_mask(lists, tets), ..Grid::default() };
            assert_eq!((quarters_near(&grid, 0, &cells), octants_near(&grid, 0)), (0, ALL_OCTANTS));
        }
    }
}
