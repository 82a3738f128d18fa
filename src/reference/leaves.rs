//! Stage 4, first part: boundary flags, masks of octants, and boxes of the leaves (the paper's Alg. 1). Twin of
//! `glsl/build/40_flag_leaves` and `42_finish_leaves`.

use super::assign::{cell_centre, half_cell};
use super::boundary::Topology;
use super::quarters::{ALL_OCTANTS, octants_near};
use super::separate::box_touches;
use super::splits::Splits;
use super::tet::sub;
use super::vertices::Vertices;
use crate::grid::{Box6, Grid, MAX_LEVEL, canonical, two_to, unmorton};
use crate::layout::bit;
use crate::mesh::Mesh;
use crate::options::Lists;
use rayon::prelude::*;
use std::ops::Range;

pub use crate::layout::constants::finish_leaves::{MAX_LIST_FOR_OCTANTS, MAX_TOUCH_TESTS};

/// The box of the cell with Morton code `code` at `level`, in the units of the mesh. On each axis it reaches from
/// `lo + extent·(k·2^-l)` to `lo + extent·((k+1)·2^-l)`, without denormals, where `extent = hi − lo`. The upper side of
/// the last cell equals `hi` bit for bit. On an axis that is flat to the quantization (`inv = 0`) cell 0 stands for all
/// of it: `[lo, hi]`.
pub fn cell_box(grid: &Grid, level: u32, code: u32) -> Box6 {
    let [x, y, z] = unmorton(code);
    let at = |c: usize, k: u32| cell_side(grid, c, level, k);
    [at(0, x), at(1, y), at(2, z), at(0, x + 1), at(1, y + 1), at(2, z + 1)]
}

/// The lower side of cell `k` at `level` along axis `c`.
pub fn cell_side(grid: &Grid, c: usize, level: u32, k: u32) -> f32 {
    if k == 0 {
        grid.lo[c]
    } else if k == 1 << level || grid.inv[c] == 0.0 {
        grid.hi[c]
    } else {
        let size = two_to(-(level as i32));
        let even = canonical(grid.hi[c] - grid.lo[c]) * (k as f32 * size);
        canonical(grid.lo[c] + if grid.graded == 0 { even } else { grid.graded_side(c, k << (MAX_LEVEL - level)) })
    }
}

/// Boundary flag of a leaf. It is 0 only if the cell lies entirely within the mesh (SPEC 2.3). It is set if the leaf
/// lists a boundary tetrahedron. It is also set if none of the first [`MAX_TOUCH_TESTS`] tetrahedra touches the cell:
/// the bounding box of an inner tetrahedron can reach out of the mesh into cells where no boundary tetrahedron is
/// listed, and such a cell lies entirely outside. A cell that is touched and contains no part of the surface lies
/// entirely within the mesh. With `Lists::Boundary` cells outside have no entries, since unmarked cells list only the
/// owners of their centres, so that test is not needed.
pub fn flag(listed: &[u32], code: u32, lists: Lists, mesh: &Mesh, topology: &Topology, vertices: &Vertices, grid: &Grid) -> bool {
    let boundary = listed.iter().any(|&p| bit(&topology.boundary, p));
    if boundary || lists == Lists::Boundary {
        return boundary;
    }
    let cell = unmorton(code);
    let half = half_cell(grid, grid.level, cell);
    let centre = cell_centre(grid, grid.level, half, cell);
    let axes = [[half[0], 0.0, 0.0], [0.0, half[1], 0.0], [0.0, 0.0, half[2]]];
    let touches = |&p: &u32| box_touches(&vertices.tet(mesh.tets[p as usize]).v.map(|v| sub(v, centre)), &axes, [0.0; 3]);
    !listed.is_empty() && !listed.iter().take(MAX_TOUCH_TESTS as usize).any(touches)
}

/// The mask of a leaf with entries `listed`. Bit d says that one of the entries is near the octant of its cell with the
/// 3-bit Morton digit d. In the other octants no point has an owner (for tolerances below 2^-12). The mask has all
/// octants if the leaf has no boundary tetrahedra, if its list is long, or if entries have no quarters; it is 0 without
/// entries.
pub fn octants(listed: Range<usize>, boundary: bool, quarters: &[u16], grid: &Grid) -> u32 {
    if !boundary || quarters.is_empty() || listed.len() > MAX_LIST_FOR_OCTANTS as usize {
        return if listed.is_empty() { 0 } else { ALL_OCTANTS };
    }
    listed.fold(0, |mask, i| mask | octants_near(grid, quarters[i].into()))
}

/// The mask of each leaf.
pub fn masks(splits: &Splits, flags: &[bool], quarters: &[u16], grid: &Grid) -> Vec<u32> {
    let listed = |i: usize| splits.po[i] as usize..splits.po[i + 1] as usize;
    flags.par_iter().enumerate().map(|(i, &flag)| octants(listed(i), flag, quarters, grid)).collect()
}

/// Boundary flag of each leaf.
pub fn flags(
    primitives: &[u32],
    splits: &Splits,
    lists: Lists,
    mesh: &Mesh,
    topology: &Topology,
    vertices: &Vertices,
    grid: &Grid,
) -> Vec<bool> {
    let first = first_leaf(&splits.no);
    let listed = |i: usize| &primitives[splits.po[i] as usize..splits.po[i + 1] as usize];
    let flag_of = |(i, &code)| flag(listed(i), code, lists, mesh, topology, vertices, grid);
    splits.codes[first..].par_iter().enumerate().map(flag_of).collect()
}

/// Box of each leaf.
pub fn boxes(splits: &Splits, grid: &Grid) -> Vec<Box6> {
    let first = first_leaf(&splits.no);
    splits.codes[first..].par_iter().map(|&code| cell_box(grid, grid.level, code)).collect()
}

/// Entries of the longest leaf; `po` as in [`Splits`].
pub fn longest_list(po: &[u32]) -> u32 {
    po.windows(2).map(|ends| ends[1].saturating_sub(ends[0])).max().unwrap_or(0)
}

fn first_leaf(no: &[u32]) -> usize {
    if no.len() < 2 { 0 } else { no[no.len() - 2] as usize }
}
