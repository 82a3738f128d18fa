//! Stage 4, second part: internal nodes from their children, level by level from the leaves to the root (the paper's
//! Alg. 2). Twin of `glsl/build/50_merge_level`.

use super::splits::Splits;
use crate::grid::Box6;
use rayon::prelude::*;

/// Boundary flag of every node, from those of the leaves: the OR of the children's flags. (The paper sets that of the
/// root to true; here the root is no exception, since a mesh always has a surface.)
pub fn flags(leaves: Vec<bool>, splits: &Splits) -> Vec<u32> {
    let flags = upwards(leaves, splits, |children| children.contains(&true));
    let word = |bits: &[bool]| (0..).zip(bits).fold(0, |word, (i, &b)| word | u32::from(b) << i);
    flags.par_chunks(32).map(word).collect()
}

/// Box of every node, from those of the leaves: the union of the children's boxes.
pub fn boxes(leaves: Vec<Box6>, splits: &Splits) -> Vec<Box6> {
    upwards(leaves, splits, |children| children.iter().copied().reduce(union).unwrap_or_default())
}

/// Mask of every node, four to a word. For an internal node, bit d says that the child with the 3-bit digit d exists;
/// the masks of leaves are given.
pub fn masks(leaves: &[u32], splits: &Splits) -> Vec<u32> {
    let internal = splits.co.len() - 1;
    let children = |i: usize| {
        let children = splits.co[i] as usize + 1..=splits.co[i + 1] as usize;
        splits.codes[children].iter().fold(0u32, |mask, code| mask | 1 << (code & 7))
    };
    let byte = |i: usize| if i < internal { children(i) } else { leaves[i - internal] };
    let nodes = internal + leaves.len();
    let word = |w: usize| (4 * w..nodes.min(4 * w + 4)).fold(0, |word, i| word | byte(i) << (8 * (i % 4)));
    (0..nodes.div_ceil(4)).into_par_iter().map(word).collect()
}

/// The smallest box that contains both boxes.
pub fn union(a: Box6, b: Box6) -> Box6 {
    [a[0].min(b[0]), a[1].min(b[1]), a[2].min(b[2]), a[3].max(b[3]), a[4].max(b[4]), a[5].max(b[5])]
}

/// Values of all nodes from those of the leaves; each level is complete before the next one is computed.
fn upwards<T: Copy + Default + Send + Sync>(leaves: Vec<T>, splits: &Splits, merge: impl Fn(&[T]) -> T + Sync) -> Vec<T> {
    let mut values = vec![T::default(); splits.codes.len() - leaves.len()];
    values.extend(leaves);
    for level in (0..splits.no.len() - 1).rev() {
        let first = if level == 0 { 0 } else { splits.no[level - 1] as usize };
        let (upper, lower) = values.split_at_mut(splits.no[level] as usize);
        let base = upper.len();
        upper[first..].par_iter_mut().enumerate().for_each(|(i, value)| {
            let i = first + i;
            *value = merge(&lower[splits.co[i] as usize + 1 - base..=splits.co[i + 1] as usize - base]);
        });
    }
    values
}
