//! What an entry says of where in its leaf's cell it lies, so that a search passes most of a list over. Twin of `glsl/shared/halves.glsl`.
//!
//! A cell is cut in two along each axis. An entry is *near* a half that the quantized box of its primitive meets, once the box has grown by a cell
//! of the finest grid all around: bit 2 c is the lower half along axis c, bit 2 c + 1 the upper one. The six bits stand above the primitive in the
//! entry's word. A point that a primitive owns is near it, too: the primitive's box holds it, or it lies outside by at most three times the
//! tolerance of the box (SPEC 3.1.4), which is less than a finest cell for tolerances below 2^-12. For larger ones boxes grow by more, and halves
//! are not asked; the octants of leaves still are, so that a point outside may be found under one α and not under another, as at the border of a
//! leaf. On an axis so short beside the largest that normalised coordinates cannot tell its finest cells apart, everything is near.

use super::grid::{Grid, MAX_LEVEL, unmorton};
use super::vertices::{CellRange, Vertices};
use crate::mesh::Mesh;
use crate::options::Lists;
use rayon::prelude::*;

/// Bits of an entry's word below its halves.
const ID_BITS: u32 = 26;
/// Near everything.
pub const BOTH_HALVES: u32 = 0x3f;
/// A mask of all octants.
pub const ALL_OCTANTS: u32 = 0xff;

/// An axis of less than this in normalised coordinates has finest cells of less than four of their steps.
const COARSE: f32 = f32::from_bits((127 - 30) << 23);

/// By how many finest cells per axis boxes grow, at least `least`.
fn grown(grid: &Grid, least: u32) -> [u32; 3] {
    [0, 1, 2].map(|c| if grid.extent[c] < COARSE { 1024 } else { least })
}

/// The halves of the leaf's cell with Morton code `code` that a box of finest cells is near to.
pub fn halves_near(grid: &Grid, code: u32, cells: &CellRange) -> u32 {
    if grid.level == MAX_LEVEL {
        return BOTH_HALVES;
    }
    let (middle, reach) = (unmorton(code).map(|k| (2 * k + 1) << (MAX_LEVEL - 1 - grid.level)), grown(grid, 1));
    let met = |c: usize| u32::from(cells.lo[c] < middle[c] + reach[c]) + 2 * u32::from(cells.hi[c] + reach[c] >= middle[c]);
    met(0) | met(1) << 2 | met(2) << 4
}

/// The bits of an entry's word that are its primitive; the halves stand above. All bits where entries have none: in the paper's lists, and in meshes that need
/// the bits for their ids.
pub fn id_mask(lists: Lists, tets: usize) -> u32 {
    if lists == Lists::Boundary && tets <= 1 << ID_BITS { (1 << ID_BITS) - 1 } else { u32::MAX }
}

/// Primitives and halves of entries as a device holds them, in a tree with this grid.
pub fn taken_apart(entries: Vec<u32>, grid: &Grid) -> (Vec<u32>, Vec<u8>) {
    if grid.ids == u32::MAX {
        return (entries, Vec::new());
    }
    entries.into_iter().map(|entry| (entry & grid.ids, (entry >> ID_BITS) as u8)).unzip()
}

/// The halves of all entries, which have these Morton codes and primitives.
pub fn halves(codes: &[u32], primitives: &[u32], grid: &Grid, mesh: &Mesh, vertices: &Vertices) -> Vec<u8> {
    let near = |(&code, &p): (&u32, &u32)| halves_near(grid, code, &vertices.cells(mesh.tets[p as usize], MAX_LEVEL)) as u8;
    codes.par_iter().zip(primitives).map(near).collect()
}

/// The octants of its cell that an entry is near to: bit d for the 3-bit Morton digit d.
pub fn octants_of(halves: u32) -> u32 {
    let digit = |d: u32| [d >> 2 & 1, d >> 1 & 1, d & 1];
    let near = |d: &u32| (0u32..).zip(digit(*d)).all(|(c, upper)| halves >> (2 * c + upper) & 1 != 0);
    (0..8).filter(near).fold(0, |mask, d| mask | 1 << d)
}

/// By how many finest cells per axis the box of a primitive grows, so that a point which that tolerance lets it own is within.
pub fn reach(grid: &Grid, tolerance: f32) -> [u32; 3] {
    grown(grid, 1 + (tolerance.clamp(0.0, 1.0) * 4096.0) as u32)
}

/// Whether a primitive's quantized box is so near that it can own a point in that finest cell.
pub fn is_near(cells: &CellRange, cell: [u32; 3], reach: [u32; 3]) -> bool {
    (0..3).all(|c| cells.lo[c] <= cell[c] + reach[c] && cell[c].saturating_sub(reach[c]) <= cells.hi[c])
}
