//! Overlaps equal those of brute force in all poses, do not depend on the tree, and are symmetric.

use super::oracle::{P, tet_gap};
use super::{Random, prepared, tree};
use olbvh::mesh::cases::cases;
use olbvh::mesh::{Mesh, kuhn_jittered};
use olbvh::options::Assign;
use olbvh::reference::boundary::Topology;
use olbvh::reference::overlap::{Overlap, OverlapSide, overlap};

type Prepared = (Mesh, Topology);

fn run(a: &Prepared, b: &Prepared, alpha: f32, assign: Assign, pairs: bool) -> Overlap {
    let (tree_a, tree_b) = (tree(&a.0, &a.1, alpha, assign), tree(&b.0, &b.1, alpha, assign));
    overlap(OverlapSide { mesh: &a.0, topology: &a.1, tree: &tree_a }, OverlapSide { mesh: &b.0, topology: &b.1, tree: &tree_b }, pairs)
}

/// A mesh turned, scaled and moved at random.
fn posed(mesh: &Mesh, random: &mut Random, reach: f32) -> Mesh {
    let q = [0; 4].map(|_| random.next() - 0.5);
    let n = q.iter().map(|x| x * x).sum::<f32>().sqrt().max(1e-3);
    let [w, x, y, z] = q.map(|c| c / n);
    let rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ];
    let scale = 0.25 + 1.5 * random.next() * random.next();
    let shift = [0; 3].map(|_| (random.next() - 0.5) * reach);
    let mut mesh = mesh.clone();
    for p in &mut mesh.points {
        let at = p.map(|x| x - 1.5);
        *p = [0, 1, 2].map(|c| 1.5 + shift[c] + scale * (rows[c][0] * at[0] + rows[c][1] * at[1] + rows[c][2] * at[2]));
    }
    mesh
}

/// Every answer must contain what certainly intersects, and nothing that is certainly apart.
fn check(name: &str, a: &Prepared, b: &Prepared, found: &Overlap) {
    let tets = |m: &Prepared| -> Vec<Option<[P; 4]>> {
        let of = |(t, ids): (u32, &[u32; 4])| m.1.is_valid(t).then(|| ids.map(|i| m.0.points[i as usize].map(f64::from)));
        (0..).zip(&m.0.tets).map(of).collect()
    };
    let (in_a, in_b) = (tets(a), tets(b));
    let all: Vec<P> = in_a.iter().chain(&in_b).flatten().flatten().copied().collect();
    let size = |c: usize| all.iter().map(|p| p[c]).fold(f64::MIN, f64::max) - all.iter().map(|p| p[c]).fold(f64::MAX, f64::min);
    let diagonal = (0..3).map(|c| size(c) * size(c)).sum::<f64>().sqrt();
    let band = 1e-6 * diagonal;
    let mut least = [vec![f64::MAX; in_a.len()], vec![f64::MAX; in_b.len()]];
    for (i, x) in in_a.iter().enumerate() {
        for (j, y) in in_b.iter().enumerate() {
            let (Some(x), Some(y)) = (x, y) else { continue };
            let apart = (0..3).any(|c| {
                let range = |t: &[P; 4]| (t.iter().map(|p| p[c]).fold(f64::MAX, f64::min), t.iter().map(|p| p[c]).fold(f64::MIN, f64::max));
                let (x, y) = (range(x), range(y));
                x.0 > y.1 + band || y.0 > x.1 + band
            });
            let gap = if apart { f64::MAX } else { tet_gap(x, y, 0.0) };
            least[0][i] = least[0][i].min(gap);
            least[1][j] = least[1][j].min(gap);
            if let (Some(pairs), false) = (&found.pairs, apart) {
                let listed = pairs.binary_search(&[i as u32, j as u32]).is_ok();
                assert!(if listed { gap < band } else { gap > -band }, "{name}: pair {i} {j}, listed {listed}, gap {gap:e}");
            }
        }
    }
    for (side, (ids, least)) in [&found.a, &found.b].into_iter().zip(&least).enumerate() {
        assert!(ids.is_sorted_by(|x, y| x < y), "{name}");
        for (t, &gap) in least.iter().enumerate() {
            let listed = ids.binary_search(&(t as u32)).is_ok();
            assert!(if listed { gap < band } else { gap > -band }, "{name}: side {side}, {t} listed {listed}, gap {gap:e} of {diagonal}");
        }
    }
}

#[test]
fn two_hundred_poses() {
    let mut random = Random(7);
    let meshes =
        [kuhn_jittered([3, 3, 3], 0.0, 0).unwrap(), kuhn_jittered([3, 3, 3], 0.25, 1).unwrap(), kuhn_jittered([3, 1, 2], 0.2, 2).unwrap()];
    let (mut some, mut none) = (0, 0);
    for pose in 0..200 {
        let a = prepared(meshes[random.below(3)].clone());
        let b = prepared(posed(&meshes[random.below(3)], &mut random, 5.0));
        let name = format!("pose {pose}");
        let assign = Assign::EVERY[pose % 3];
        let found = run(&a, &b, 0.0, assign, false);
        check(&name, &a, &b, &found);
        let back = run(&b, &a, 0.0, assign, false);
        assert_eq!((&found.a, &found.b), (&back.b, &back.a), "{name}: exchanged");
        assert_eq!(found.effort, [back.effort[1], back.effort[0]], "{name}: exchanged");
        if pose % 4 == 0 {
            let pairs = run(&a, &b, 0.0, assign, true);
            check(&name, &a, &b, &pairs);
            let other = run(&a, &b, 1.0, Assign::EVERY[(pose + 1) % 3], true);
            assert_eq!((&pairs.a, &pairs.b, &pairs.pairs), (&other.a, &other.b, &other.pairs), "{name}");
            let mut back = run(&b, &a, 0.0, assign, true).pairs.unwrap();
            for pair in &mut back {
                pair.swap(0, 1);
            }
            back.sort_unstable();
            assert_eq!(pairs.pairs.unwrap(), back, "{name}: exchanged");
        }
        *(if found.a.is_empty() { &mut none } else { &mut some }) += 1;
    }
    assert!(some > 100 && none > 10, "{some} {none}");
}

/// A mesh and its translate: every edge is parallel to one of the other mesh, but for rounding, so that their cross
/// product has any direction.
#[test]
fn moved_copies() {
    for (jitter, shift) in [(0.9, [1.096; 3]), (0.2, [0.7, 0.6, 0.9]), (0.5, [-0.3, 1.4, 0.55])] {
        let a = kuhn_jittered([6; 3], jitter, 1).unwrap();
        let mut b = a.clone();
        b.points.iter_mut().for_each(|p| *p = [0, 1, 2].map(|c| p[c] + shift[c]));
        let (a, b) = (prepared(a), prepared(b));
        for pairs in [false, true] {
            check(&format!("moved by {shift:?}"), &a, &b, &run(&a, &b, 0.0, Assign::Planes, pairs));
        }
    }
}

#[test]
fn contained_touching_identical_apart() {
    let cube = |n: u32, at: [f32; 3], scale: f32| {
        let mut mesh = kuhn_jittered([n; 3], 0.0, 0).unwrap();
        mesh.points.iter_mut().for_each(|p| *p = [0, 1, 2].map(|c| at[c] + scale * p[c]));
        prepared(mesh)
    };
    let big = cube(4, [0.0; 3], 1.0);
    let all = |m: &Prepared| (0..m.0.tets.len() as u32).collect::<Vec<_>>();
    for pairs in [false, true] {
        for assign in Assign::EVERY {
            let identical = run(&big, &big, 0.0, assign, pairs);
            assert_eq!((&identical.a, &identical.b), (&all(&big), &all(&big)));
            let inner = cube(2, [1.6, 1.7, 1.55], 0.2);
            let found = run(&big, &inner, 0.0, assign, pairs);
            assert_eq!(found.b, all(&inner));
            check("contained", &big, &inner, &found);
            // This contact is exact in floating point, so it counts whatever the band.
            let beside = cube(4, [4.0, 0.0, 0.0], 1.0);
            let found = run(&big, &beside, 0.0, assign, pairs);
            check("touching", &big, &beside, &found);
            let touches = |m: &Prepared, x: f32| {
                let on = |t: &&u32| m.0.tets[**t as usize].iter().any(|&v| m.0.points[v as usize][0] == x);
                all(m).iter().filter(on).copied().collect::<Vec<_>>()
            };
            assert_eq!((&found.a, &found.b), (&touches(&big, 4.0), &touches(&beside, 4.0)));
            let corner = cube(4, [4.0; 3], 1.0);
            assert!(!run(&big, &corner, 0.0, assign, pairs).a.is_empty());
            let apart = run(&big, &cube(4, [4.01, 0.0, 0.0], 1.0), 0.0, assign, pairs);
            assert!(apart.a.is_empty() && apart.b.is_empty());
        }
    }
}

/// Rounding cannot part what has a vertex in common: whatever the shapes are, all such pairs are found.
#[test]
fn a_common_vertex_always_touches() {
    let mesh = prepared(kuhn_jittered([5, 4, 4], 0.35, 3).unwrap());
    let tets = &mesh.0.tets;
    let common = |a: u32, b: u32| tets[a as usize].iter().any(|v| tets[b as usize].contains(v));
    for assign in Assign::EVERY {
        let found = run(&mesh, &mesh, 0.0, assign, true).pairs.unwrap();
        let count = (0..tets.len() as u32).flat_map(|a| (0..tets.len() as u32).map(move |b| (a, b))).filter(|&(a, b)| common(a, b)).count();
        assert!(count > 10_000 && found.iter().filter(|p| common(p[0], p[1])).count() == count, "{assign}: {count}");
    }
}

#[test]
fn deep_overlaps_need_few_tests() {
    let cube = prepared(kuhn_jittered([16; 3], 0.25, 1).unwrap());
    let mut moved = kuhn_jittered([16; 3], 0.25, 2).unwrap();
    moved.points.iter_mut().for_each(|p| *p = [p[0] + 1.37, p[1] - 2.21, p[2] + 0.73]);
    let found = run(&cube, &prepared(moved), 0.0, Assign::Aabb, false);
    let narrow = found.effort.iter().map(|e| e.narrow).sum::<u64>();
    let primitives = 2 * cube.0.tets.len() as u64;
    assert!(found.a.len() > cube.0.tets.len() / 2, "{}", found.a.len());
    assert!(narrow * 100 < 15 * primitives, "{narrow} narrow tests for {primitives} primitives: {:?}", found.effort);
}

#[test]
fn bad_meshes_have_answers() {
    let cube = prepared(kuhn_jittered([2; 3], 0.2, 1).unwrap());
    let flat = ["flat-z", "flat-line", "flat-x", "point", "flat-between"];
    for case in cases().unwrap() {
        let mesh = prepared(case.mesh);
        for pairs in [false, true] {
            for (alpha, assign) in [(0.0, Assign::Aabb), (2.0, Assign::Exact)] {
                let found = run(&cube, &mesh, alpha, assign, pairs);
                // Flat tetrahedra have no interior that axes could show.
                if !flat.contains(&case.name) {
                    check(case.name, &cube, &mesh, &found);
                }
                assert_eq!(run(&mesh, &cube, alpha, assign, pairs).a, found.b, "{}", case.name);
            }
        }
    }
}
