//! Stage 3: nodes end where successive codes differ (SPEC 2.5, the paper's §3.2). Twin of `glsl/build/3*`.

use rayon::prelude::*;

/// Codes per task.
const CHUNK: usize = 1 << 16;

/// The nodes of all levels, in breadth-first order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Splits {
    /// Morton code of each node at its own level.
    pub codes: Vec<u32>,
    /// `PO`, with one element more than there are leaves; the entries of leaf j are `po[j] .. po[j + 1]`.
    pub po: Vec<u32>,
    /// `CO`, with one element more than there are internal nodes; the children of node i are `co[i] + 1 ..= co[i + 1]`.
    pub co: Vec<u32>,
    /// `NO`: `no[k]` is the number of nodes on levels 0…k.
    pub no: Vec<u32>,
}

/// A node of a level in construction: its code, and the end of its entries.
type End = (u32, u32);

/// Finds all nodes of a tree with leaves at `level` from the sorted codes. Without codes the tree still has a root.
pub fn splits(codes: &[u32], level: u32) -> Splits {
    if codes.is_empty() {
        return Splits { codes: vec![0], po: vec![0, 0], co: vec![0], no: vec![1] };
    }
    // From the leaves to the root: a node ends where a node of the level below ends and the code without its last digit
    // changes.
    let mut levels = vec![leaves(codes)];
    for _ in 0..level {
        let parents = levels.last().map(|children| parents(children)).unwrap_or_default();
        levels.push(parents);
    }
    levels.reverse();
    let mut splits = Splits { po: vec![0], co: vec![0], ..Splits::default() };
    splits.po.extend(levels[level as usize].iter().map(|e| e.1));
    let mut nodes = 0;
    for (k, ends) in levels.iter().enumerate() {
        nodes += ends.len() as u32;
        splits.no.push(nodes);
        splits.codes.extend(ends.iter().map(|e| e.0));
        if let Some(children) = levels.get(k + 1) {
            let last = |(i, pair): (usize, &[End])| (pair[0].0 >> 3 != pair[1].0 >> 3).then_some(nodes + i as u32);
            splits.co.extend(children.windows(2).enumerate().filter_map(last));
            splits.co.push(nodes + children.len() as u32 - 1);
        }
    }
    splits
}

fn leaves(codes: &[u32]) -> Vec<End> {
    let task = |chunk: usize| {
        let range = chunk * CHUNK..codes.len().min((chunk + 1) * CHUNK);
        let ends = range.filter(|&i| codes.get(i + 1) != Some(&codes[i]));
        ends.map(|i| (codes[i], i as u32 + 1)).collect::<Vec<_>>()
    };
    let parts: Vec<Vec<End>> = (0..codes.len().div_ceil(CHUNK)).into_par_iter().map(task).collect();
    parts.concat()
}

fn parents(children: &[End]) -> Vec<End> {
    let ends = (0..children.len()).filter(|&i| children.get(i + 1).map(|c| c.0 >> 3) != Some(children[i].0 >> 3));
    ends.map(|i| (children[i].0 >> 3, children[i].1)).collect()
}
