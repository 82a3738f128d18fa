//! The range of a field's values in every node of a tree. Twin of `glsl/build/51_scatter_ranges`, `52_push_ranges` and
//! `53_merge_ranges`.
//!
//! A tetrahedron with a value that is not finite counts nowhere, since interpolation in it yields no value. Every other
//! valid tetrahedron counts, with its smallest and largest value, in all leaves whose cells its quantized box meets,
//! whether they list it or not; quantization is monotone, so these leaves contain all of its points. A tetrahedron
//! whose box meets more than [`SPAN`] leaves along an axis is treated more coarsely, which bounds the work: it counts
//! in all leaves below the nodes that its box meets on the deepest level where there are at most [`SPAN`] of them along
//! each axis. Its range then extends a little beyond its box. The range of an internal node is the union of its
//! children's.

use super::boundary::Topology;
use super::vertices::Vertices;
use crate::grid::{canonical, morton, two_to};
use crate::mesh::{Field, Mesh, On};
use crate::tree::TreeArrays;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

pub use crate::layout::constants::scatter_ranges::SPAN;

/// An integer key that sorts like the float.
fn ordered(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 != 0 { !bits } else { bits | 1 << 31 }
}

/// The float of a key; inverse of [`ordered`].
fn unordered(key: u32) -> f32 {
    f32::from_bits(if key >> 31 != 0 { key & 0x7fff_ffff } else { !key })
}

/// `[smallest, largest]` value of every node, `[∞, −∞]` for nodes without a value. The field must have as many values
/// as the mesh has points or tetrahedra.
pub fn ranges(mesh: &Mesh, topology: &Topology, tree: &TreeArrays, field: &Field) -> Vec<[f32; 2]> {
    let vertices = Vertices::new(mesh, &tree.grid);
    // Keys of both ends. Those of the lower ends are complemented, so that keys only grow, and 0 means no value.
    let keys: Vec<[AtomicU32; 2]> = (0..tree.nodes()).map(|_| Default::default()).collect();
    mesh.tets.par_iter().enumerate().filter(|&(t, _)| topology.is_valid(t as u32)).for_each(|(t, &ids)| {
        let values = if field.on == On::Points { ids.map(|id| field.values[id as usize]) } else { [field.values[t]; 4] };
        if !values.iter().all(|v| v.is_finite()) {
            return;
        }
        let keys_of = values.map(ordered);
        let (lo, hi) = keys_of.into_iter().fold((u32::MAX, 0), |(lo, hi), key| (lo.min(key), hi.max(key)));
        let narrow = |&level: &u32| vertices.cells(ids, level).size().iter().all(|&n| n <= SPAN);
        let level = (0..=tree.grid.level).rev().find(narrow).unwrap_or(0);
        for cell in vertices.cells(ids, level).iter() {
            if let Some(node) = tree.find_node(morton(cell), level) {
                keys[node as usize][0].fetch_max(!lo, Relaxed);
                keys[node as usize][1].fetch_max(hi, Relaxed);
            }
        }
    });
    let mut keys: Vec<[u32; 2]> = keys.into_iter().map(|k| k.map(AtomicU32::into_inner)).collect();
    let union = |a: [u32; 2], b: [u32; 2]| [a[0].max(b[0]), a[1].max(b[1])];
    for node in 0..tree.internal_nodes() {
        for child in tree.children(node) {
            keys[child as usize] = union(keys[child as usize], keys[node as usize]);
        }
    }
    for node in (0..tree.internal_nodes()).rev() {
        keys[node as usize] = tree.children(node).map(|child| keys[child as usize]).fold([0; 2], union);
    }
    let floats = |[lo, hi]: [u32; 2]| if hi == 0 { [f32::INFINITY, f32::NEG_INFINITY] } else { [unordered(!lo), unordered(hi)] };
    keys.into_iter().map(floats).collect()
}

/// One bit per node, set if something is visible in the node: a value within one of the ranges `values` (ascending and
/// disjoint). Ranges of nodes are widened a little, since interpolation may round beyond them. Twin of
/// `glsl/query/visible`.
pub fn visible(ranges: &[[f32; 2]], values: &[[f32; 2]]) -> Vec<u32> {
    let rounding = two_to(-19);
    let one = |&[lo, hi]: &[f32; 2]| {
        let rounding = canonical(lo.abs().max(hi.abs()) * rounding);
        let (a, b) = (canonical(canonical(lo) - rounding), canonical(canonical(hi) + rounding));
        let first = values.partition_point(|&[_, end]| end < a);
        lo <= hi && values.get(first).is_some_and(|&[begin, _]| begin <= b)
    };
    ranges.par_chunks(32).map(|word| (0..).zip(word).fold(0, |bits, (i, range)| bits | u32::from(one(range)) << i)).collect()
}
