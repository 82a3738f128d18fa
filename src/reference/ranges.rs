//! The range of a field's values in every node of a tree. Twin of `glsl/build/51_scatter_ranges`, `52_push_ranges` and `53_merge_ranges`.
//!
//! A value counts where it is one: a tetrahedron with a value that is not finite has none anywhere (interpolation gives none), and counts nowhere. Every other
//! valid one counts with its smallest and largest value in all leaves whose cells its quantized box meets, listed there or not (quantization is monotone, so
//! these hold all of its points). A tetrahedron whose box has more than [`SPAN`] leaves along an axis counts in all leaves below the nodes that its box meets on
//! the deepest level where they are no more: its range reaches a little far, and its work is bounded. Other nodes have the union of their children's.

use super::boundary::Topology;
use super::grid::{canonical, morton, two_to};
use super::vertices::Vertices;
use crate::mesh::{Field, Mesh, On};
use crate::tree::TreeArrays;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Most nodes along an axis that a tetrahedron adds its values to.
pub const SPAN: u32 = 4;

/// A key with the order of the floats.
fn ordered(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 != 0 { !bits } else { bits | 1 << 31 }
}

/// The float of a key.
fn unordered(key: u32) -> f32 {
    f32::from_bits(if key >> 31 != 0 { key & 0x7fff_ffff } else { !key })
}

/// `[smallest, largest]` value of every node, `[∞, −∞]` of those without one. The field must have as many values as the mesh has points or tetrahedra.
pub fn ranges(mesh: &Mesh, topology: &Topology, tree: &TreeArrays, field: &Field) -> Vec<[f32; 2]> {
    let vertices = Vertices::new(mesh, &tree.grid);
    // Keys; the lower end's complemented, so that both only grow and 0 is nothing.
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

/// Which nodes have something to see: a value within one of the ranges `drawn` (ascending, apart), which is assumed where interpolation might round into one.
/// One bit per node. Twin of `glsl/query/visible`.
pub fn visible(ranges: &[[f32; 2]], drawn: &[[f32; 2]]) -> Vec<u32> {
    let rounding = two_to(-19);
    let one = |&[lo, hi]: &[f32; 2]| {
        let rounding = canonical(lo.abs().max(hi.abs()) * rounding);
        let (a, b) = (canonical(canonical(lo) - rounding), canonical(canonical(hi) + rounding));
        let first = drawn.partition_point(|&[_, end]| end < a);
        lo <= hi && drawn.get(first).is_some_and(|&[begin, _]| begin <= b)
    };
    ranges.par_chunks(32).map(|word| (0..).zip(word).fold(0, |bits, (i, range)| bits | u32::from(one(range)) << i)).collect()
}
