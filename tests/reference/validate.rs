//! Every rule of `validate` is broken in turn.

use super::{prepared, tree};
use olbvh::Error;
use olbvh::mesh::{Mesh, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions};
use olbvh::reference::boundary::Topology;
use olbvh::reference::build::build;
use olbvh::tree::TreeArrays;

fn valid(assign: Assign) -> (Mesh, Topology, TreeArrays) {
    let (mesh, topology) = prepared(kuhn_jittered([7, 5, 6], 0.2, 4).unwrap());
    let tree = tree(&mesh, &topology, 0.0, assign);
    tree.validate(&mesh, &topology).unwrap();
    (mesh, topology, tree)
}

/// Breaks a tree, and expects a message that contains `text`.
fn breaks(assign: Assign, text: &str, change: impl FnOnce(&mut TreeArrays)) {
    let (mesh, topology, mut tree) = valid(assign);
    change(&mut tree);
    let error = tree.validate(&mesh, &topology).unwrap_err();
    assert!(matches!(&error, Error::BrokenTree(m) if m.contains(text)), "expected `{text}`, found: {error}");
}

/// A leaf that lists at least `n` tetrahedra.
fn leaf(tree: &TreeArrays, n: usize) -> u32 {
    tree.leaves().find(|&j| tree.tets(j).len() >= n).unwrap()
}

#[test]
fn grid() {
    breaks(Assign::Aabb, "grid: level 11", |t| t.grid.level = 11);
    breaks(Assign::Aabb, "is not that of the mesh", |t| t.grid.lo[1] -= 1.0);
    breaks(Assign::Aabb, "is the first leaf, NO", |t| t.grid.first_leaf += 1);
    breaks(Assign::Aabb, "NO has 4 levels, the grid 3", |t| t.grid.level -= 1);
}

#[test]
fn lengths() {
    breaks(Assign::Aabb, "PO has", |t| t.po.truncate(5));
    breaks(Assign::Aabb, "CO has", |t| t.co.push(0));
    breaks(Assign::Aabb, "BF has", |t| t.flags.push(0));
    breaks(Assign::Aabb, "mask has", |t| t.masks.clear());
    breaks(Assign::Aabb, "BV has", |t| t.boxes = Some(Vec::new()));
    breaks(Assign::Aabb, "NO has 0 levels", |t| t.no.clear());
    breaks(Assign::Aabb, "elements", |t| t.no[3] = u32::MAX);
    breaks(Assign::Aabb, "BF has bits past", |t| *t.flags.last_mut().unwrap() |= 1 << 31);
    breaks(Assign::Aabb, "mask has bits past", |t| *t.masks.last_mut().unwrap() |= 1 << 31);
}

#[test]
fn levels() {
    breaks(Assign::Aabb, "NO[0] = 2", |t| t.no[0] = 2);
    breaks(Assign::Aabb, "NO[1] = 1 puts 0 nodes below 1", |t| t.no[1] = 1);
    breaks(Assign::Aabb, "NO[1] = 10 puts 9 nodes below 1", |t| t.no[1] = 10);
}

#[test]
fn children() {
    breaks(Assign::Aabb, "CO[0] = 1", |t| t.co[0] = 1);
    breaks(Assign::Aabb, "node 3 has 0 children", |t| t.co[4] = t.co[3]);
    breaks(Assign::Aabb, "node 3 has 16 children", |t| t.co[4] = t.co[3] + 16);
    breaks(Assign::Aabb, "node 3 has -1 children", |t| t.co[4] = t.co[3] - 1);
    breaks(Assign::Aabb, "the level of its children ends", |t| *t.co.last_mut().unwrap() -= 1);
}

#[test]
fn masks() {
    breaks(Assign::Aabb, "mask of node 0", |t| t.masks[0] &= !1);
    breaks(Assign::Aabb, "mask of node 5", |t| t.masks[1] &= !(1 << 8));
    breaks(Assign::Aabb, "mask of leaf", |t| *t.masks.last_mut().unwrap() &= !1);
}

#[test]
fn quarters() {
    let (mesh, topology) = prepared(kuhn_jittered([7, 5, 6], 0.2, 4).unwrap());
    let tree = build(&mesh, &topology, &BuildOptions::default()).unwrap();
    tree.validate(&mesh, &topology).unwrap();
    let refused = |change: fn(&mut TreeArrays)| {
        let mut broken = tree.clone();
        change(&mut broken);
        broken.validate(&mesh, &topology).unwrap_err().to_string()
    };
    assert!(refused(|t| t.quarters.truncate(3)).contains("quarters has 3 elements"));
    assert!(refused(|t| t.quarters[2] ^= 1 << 3).contains("near quarters"));
}

#[test]
fn offsets() {
    breaks(Assign::Aabb, "PO[0] = 1", |t| t.po[0] = 1);
    breaks(Assign::Aabb, "PO[12]", |t| t.po[12] = t.po[11]);
    breaks(Assign::Aabb, "the longest list has", |t| t.grid.longest += 1);
    breaks(Assign::Aabb, "the leaves end at entry", |t| *t.po.last_mut().unwrap() += 1);
}

#[test]
fn lists() {
    for assign in Assign::EVERY {
        breaks(assign, "no valid cell", |t| t.p[10] = 1_000_000);
        breaks(assign, "not above", |t| {
            let at = t.entries(leaf(t, 3)).start;
            t.p.swap(at, at + 1);
        });
        breaks(assign, "not above", |t| {
            let at = t.entries(leaf(t, 3)).start;
            t.p[at + 1] = t.p[at];
        });
        breaks(assign, "it does not belong there", |t| {
            let (first, last) = (t.entries(t.leaves().start), t.entries(t.nodes() - 1));
            t.p[first.end - 1] = t.p[last.end - 1];
        });
        // One entry is missing; everything else is in order.
        breaks(assign, "entries, the assignment", |t| {
            let j = leaf(t, 2);
            let slots = t.entries(j);
            t.p.remove(slots.end - 1);
            for end in &mut t.po {
                *end -= u32::from(*end as usize >= slots.end);
            }
        });
    }
    // Entries of another assignment than the one named.
    breaks(Assign::Aabb, "by the assignment exact it does not belong there", |t| t.assign = Assign::Exact);
    breaks(Assign::Exact, "the assignment aabb makes", |t| t.assign = Assign::Aabb);
}

#[test]
fn flags() {
    breaks(Assign::Aabb, "BF[0]", |t| t.flags[0] &= !1);
    breaks(Assign::Aabb, "BF[", |t| {
        let j = t.leaves().find(|&j| !t.is_boundary(j)).unwrap();
        t.flags[j as usize / 32] |= 1 << (j % 32);
    });
    breaks(Assign::Aabb, "its primitives say true", |t| {
        let j = t.leaves().find(|&j| t.is_boundary(j)).unwrap();
        t.flags[j as usize / 32] &= !(1 << (j % 32));
    });
}

#[test]
fn boxes() {
    breaks(Assign::Aabb, "BV[0]", |t| t.boxes.as_mut().unwrap()[0][3] += 1.0);
    breaks(Assign::Aabb, "BV[", |t| {
        let j = t.leaves().start as usize;
        t.boxes.as_mut().unwrap()[j][0] = -0.0;
    });
    let (mesh, topology, mut tree) = valid(Assign::Aabb);
    tree.boxes = None;
    tree.validate(&mesh, &topology).unwrap();
}

type Pick = fn(&mut TreeArrays) -> &mut Vec<u32>;

/// Whichever single word is changed, and to whatever value, validation ends without a panic, and if it reports nothing,
/// nothing was changed.
#[test]
fn no_change_of_a_word_goes_unnoticed() {
    let (mesh, topology) = prepared(kuhn_jittered([2, 3, 2], 0.2, 4).unwrap());
    for alpha in [0.0, 2.0, 10.0] {
        for assign in Assign::EVERY {
            let tree = tree(&mesh, &topology, alpha, assign);
            let arrays: [Pick; 6] = [|t| &mut t.p, |t| &mut t.po, |t| &mut t.co, |t| &mut t.no, |t| &mut t.flags, |t| &mut t.masks];
            for pick in arrays {
                let mut broken = tree.clone();
                let n = pick(&mut broken).len();
                for i in (0..n).step_by(n / 40 + 1) {
                    let before = pick(&mut broken)[i];
                    for value in [0, 1, before.wrapping_sub(1), before.wrapping_add(1), before ^ 0x80, before << 1, u32::MAX] {
                        pick(&mut broken)[i] = value;
                        assert_eq!(broken.validate(&mesh, &topology).is_ok(), value == before, "word {i} from {before} to {value}");
                    }
                    pick(&mut broken)[i] = before;
                }
            }
        }
    }
}
