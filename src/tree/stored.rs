//! How a device stores what [`TreeArrays`](super::TreeArrays) has in arrays of their own: quarters above the tetrahedra in
//! P, and slabs behind the offsets in PO.

use crate::layout::Grid;
use crate::options::Lists;

/// The bits of an entry's word that are its tetrahedron's id; quarters or halves stand above them. All bits if entries
/// have no quarters: in the paper's lists, and in meshes that need the bits for their ids.
pub fn id_mask(lists: Lists, tets: usize) -> u32 {
    let bits = [20, 26].into_iter().find(|&bits| tets <= 1 << bits);
    bits.filter(|_| lists == Lists::Boundary).map_or(u32::MAX, |bits| (1 << bits) - 1)
}

/// [`id_mask`] of a tree with this grid: quarters are of cells of equal size, so there are none in graded grids.
pub fn ids_in(grid: &Grid, lists: Lists, tets: usize) -> u32 {
    if grid.graded == 0 { id_mask(lists, tets) } else { u32::MAX }
}

/// Splits entries, as a device stores them in a tree with this grid, into tetrahedra and quarters.
pub fn split_entries(entries: Vec<u32>, grid: &Grid) -> (Vec<u32>, Vec<u16>) {
    if grid.ids == u32::MAX {
        return (entries, Vec::new());
    }
    entries.into_iter().map(|entry| (entry & grid.ids, (entry >> grid.ids.count_ones()) as u16)).unzip()
}

/// Splits what a device stores of so many leaves into the offsets of PO and the slabs behind them.
pub fn split_slabs(mut words: Vec<u32>, leaves: usize) -> (Vec<u32>, Vec<u32>) {
    let slabs = words.split_off(words.len().min(leaves + 1));
    (words, slabs)
}
