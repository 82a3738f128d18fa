//! Point location: owners, hints, tolerance and values.

use super::{Random, prepared, tree};
use olbvh::formats::{LoadOptions, load};
use olbvh::layout::NONE;
use olbvh::mesh::cases::cases;
use olbvh::mesh::{Field, Mesh, On, kuhn, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, Lists};
use olbvh::reference::boundary::Topology;
use olbvh::reference::brute;
use olbvh::reference::build::build;
use olbvh::reference::locate::{Location, Locator};
use olbvh::reference::vertices::Vertices;
use rayon::prelude::*;

/// Points on vertices, edges and faces, inside of tetrahedra, in and around the bounds, and nowhere.
fn points(mesh: &Mesh, topology: &Topology, n: usize, seed: u64) -> Vec<[f32; 3]> {
    let mut random = Random(seed);
    let grid = &topology.grid;
    let mut points =
        vec![[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0], [0.0, f32::NEG_INFINITY, 0.0], [f32::MAX; 3], [f32::MIN; 3], [1e-45; 3]];
    for i in 0..n {
        if topology.valid_cells() > 0 && i % 4 != 3 {
            points.push(random.point(mesh, topology, 1 + i / 4 % 4));
        } else {
            points.push([0, 1, 2].map(|c| grid.lo[c] + (1.4 * random.next() - 0.2) * (grid.hi[c] - grid.lo[c])));
        }
    }
    points
}

#[test]
fn owners_are_those_of_brute_force() {
    for case in cases().unwrap() {
        let (mesh, topology) = prepared(case.mesh);
        let normalised = Vertices::new(&mesh, &topology.grid).normalised;
        let points = points(&mesh, &topology, if mesh.tets.len() > 400 { 300 } else { 1000 }, 17);
        let expected: Vec<Vec<u32>> = points.par_iter().map(|&p| brute::owners(&mesh, &topology, &normalised, p)).collect();
        for alpha in [0.0, 1.0, 2.0, 4.0] {
            for assign in Assign::EVERY {
                let tree = tree(&mesh, &topology, alpha, assign);
                let locator = Locator::new(&mesh, &topology, &tree);
                points.par_iter().zip(&expected).for_each(|(&p, expected)| {
                    let found = locator.locate(p);
                    let owners = locator.owners(p);
                    let name = || format!("{} α {alpha} {assign} {p:?}", case.name);
                    if let Some(&first) = expected.first() {
                        assert_eq!((found.owner, &owners), (first, expected), "{}", name());
                    } else {
                        // No tetrahedron contains it: it has no owner, or one that it comes near.
                        assert_eq!(owners, found.found().into_iter().collect::<Vec<_>>(), "{}", name());
                    }
                    for stack in [0, 3, 100] {
                        assert_eq!(locator.locate_by_traversal(p, stack), found, "{}", name());
                    }
                    if expected.len() < 2 {
                        let near = locator.locate_near(p, found.owner);
                        assert_eq!(near, found, "{}", name());
                    }
                });
            }
        }
    }
}

/// A quarter of a million points of a closed mesh are all found, with one owner whatever the tree. (Only a part of them
/// is located where leaves list thousands of entries.)
#[test]
fn no_point_of_a_mesh_is_lost() {
    let n = 24;
    let (mesh, topology) = prepared(kuhn_jittered([n; 3], 0.12, 11).unwrap());
    assert_eq!(topology.counts.flat, 0);
    let mut random = Random(1);
    let inside = |random: &mut Random| [0; 3].map(|_| random.next() * n as f32);
    let points: Vec<[f32; 3]> = (0..250_000)
        .map(|i| match i % 7 {
            0 => mesh.points[i / 7 % mesh.points.len()],
            1 => random.point(&mesh, &topology, 2),
            2 => random.point(&mesh, &topology, 3),
            _ => inside(&mut random),
        })
        .collect();
    let mut expected: Option<Vec<Location>> = None;
    for (alpha, part) in [(0.0, 1), (1.0, 1), (2.0, 8), (4.0, 250)] {
        for assign in Assign::EVERY {
            let tree = tree(&mesh, &topology, alpha, assign);
            let some: Vec<[f32; 3]> = points.iter().copied().step_by(part).collect();
            let found = Locator::new(&mesh, &topology, &tree).locate_each(&some);
            for (p, location) in some.iter().zip(&found) {
                assert_ne!(location.owner, NONE, "α {alpha} {assign}: {p:?} is lost");
            }
            let expected = expected.get_or_insert_with(|| found.clone());
            for ((p, a), b) in some.iter().zip(expected.iter().step_by(part)).zip(&found) {
                assert_eq!(a, b, "α {alpha} {assign}: {p:?} has another owner");
            }
        }
    }
    for (p, location) in points.iter().zip(expected.unwrap_or_default()) {
        let v = mesh.tets[location.owner as usize].map(|v| mesh.points[v as usize]);
        let b = location.barycentric;
        for c in 0..3 {
            let x: f32 = (0..4).map(|k| b[k] * v[k][c]).sum();
            assert!((x - p[c]).abs() < 2e-5, "{p:?}: {location:?} gives {x}");
        }
        assert!(b.iter().all(|&b| (-2e-5..=1.00002).contains(&b)), "{p:?}: {location:?}");
    }
}

/// Every tetrahedron contains its own vertices, exactly, so that the owner of a vertex is the lowest-numbered
/// tetrahedron around it, and all of these are among its owners.
#[test]
fn a_vertex_lies_in_all_tetrahedra_around_it() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bracket_50k.vtu");
    let bracket = load(file, &LoadOptions::default()).unwrap().mesh;
    for mesh in [kuhn_jittered([9, 8, 7], 0.3, 5).unwrap(), bracket] {
        let (mesh, topology) = prepared(mesh);
        let mut around = vec![Vec::new(); mesh.points.len()];
        (0u32..).zip(&mesh.tets).for_each(|(t, ids)| ids.iter().for_each(|&v| around[v as usize].push(t)));
        for lists in Lists::EVERY {
            let options = BuildOptions { lists, ..BuildOptions::default() };
            let tree = build(&mesh, &topology, &options).unwrap();
            let locator = Locator::new(&mesh, &topology, &tree);
            for (v, expected) in around.iter().enumerate() {
                let p = mesh.points[v];
                assert_eq!(locator.owners(p), *expected, "vertex {v} with {lists}");
                assert_eq!(locator.locate(p).owner, expected[0], "vertex {v} with {lists}");
            }
        }
    }
}

/// The order of the vertices of a tetrahedron changes nothing but the order of the barycentric coordinates.
#[test]
fn the_owner_does_not_depend_on_the_order_of_vertices() {
    let (mesh, topology) = prepared(kuhn_jittered([6; 3], 0.2, 11).unwrap());
    let mut turned = mesh.clone();
    turned.tets.iter_mut().for_each(|t| t.swap(0, 3));
    let (turned, turned_topology) = prepared(turned);
    let (a, b) = (tree(&mesh, &topology, 0.0, Assign::Exact), tree(&turned, &turned_topology, 0.0, Assign::Exact));
    assert_eq!(a, b);
    let (a, b) = (Locator::new(&mesh, &topology, &a), Locator::new(&turned, &turned_topology, &b));
    for p in points(&mesh, &topology, 3000, 2) {
        let (a, b) = (a.locate(p), b.locate(p));
        let [w, x, y, z] = b.barycentric;
        assert_eq!((a.owner, a.barycentric), (b.owner, [z, x, y, w]));
    }
}

#[test]
fn points_outside_are_nowhere_and_the_tolerance_is_kept() {
    let (mesh, topology) = prepared(kuhn([4; 3]).unwrap());
    let tree = tree(&mesh, &topology, 0.0, Assign::Aabb);
    let locator = Locator::new(&mesh, &topology, &tree);
    for p in [[-0.001, 2.0, 2.0], [2.0, 4.001, 2.0], [2.0, 2.0, 9.0], [-100.0, 0.0, 0.0], [f32::NAN, 1.0, 1.0], [1.0, 1.0, f32::INFINITY]] {
        assert_eq!(locator.locate(p), Location::NOWHERE, "{p:?}");
        assert!(locator.owners(p).is_empty() && locator.locate_by_traversal(p, 8) == Location::NOWHERE);
    }
    assert_eq!(Location::NOWHERE.found(), None);
    let near = [-5e-6, 2.3, 2.2];
    let found = locator.locate(near);
    assert!(found.owner != NONE && found.barycentric.iter().any(|&b| b < 0.0));
    assert_eq!(locator.owners(near), [found.owner]);
    assert_eq!(locator.clone().with_tolerance(0.0).locate(near), Location::NOWHERE);
    assert!(locator.with_tolerance(1.0).locate([-0.4, 2.3, 2.2]).found().is_some());
}

#[test]
fn a_hint_gives_the_owner() {
    let (mesh, topology) = prepared(kuhn_jittered([5; 3], 0.15, 3).unwrap());
    let tree = tree(&mesh, &topology, 1.0, Assign::Planes);
    let locator = Locator::new(&mesh, &topology, &tree);
    let mut random = Random(8);
    let mut last = NONE;
    for p in points(&mesh, &topology, 5000, 6) {
        let expected = locator.locate(p);
        // The other tetrahedra that contain a point on a face, an edge or a vertex are the hints most likely to win
        // wrongly.
        let others = locator.owners(p);
        for hint in others.into_iter().chain([last, random.below(mesh.tets.len()) as u32, expected.owner, NONE, mesh.tets.len() as u32]) {
            assert_eq!(locator.locate_near(p, hint), expected, "{p:?}, hint {hint}");
        }
        last = expected.owner;
    }
    // Bad tetrahedra do not serve as hints.
    let (mesh, topology) = prepared(cases().unwrap().into_iter().find(|c| c.name == "bad-some").unwrap().mesh);
    let tree = super::tree(&mesh, &topology, 0.0, Assign::Aabb);
    let locator = Locator::new(&mesh, &topology, &tree);
    for hint in 0..12 {
        assert_eq!(locator.locate_near([0.1, 0.1, 0.1], hint).owner, 0);
    }
}

#[test]
fn values_are_interpolated() {
    let (mut mesh, topology) = prepared(kuhn_jittered([5; 3], 0.2, 1).unwrap());
    let linear = |p: [f32; 3]| 1.0 + 2.0 * p[0] - 3.0 * p[1] + 0.5 * p[2];
    mesh.fields.push(Field { name: "linear".into(), on: On::Points, values: mesh.points.iter().map(|&p| linear(p)).collect() });
    mesh.fields.push(Field { name: "id".into(), on: On::Cells, values: (0..mesh.tets.len()).map(|t| t as f32).collect() });
    mesh.fields.push(Field { name: "short".into(), on: On::Points, values: Vec::new() });
    let tree = tree(&mesh, &topology, 0.0, Assign::Aabb);
    let locator = Locator::new(&mesh, &topology, &tree);
    let mut random = Random(4);
    for _ in 0..2000 {
        let p = [0; 3].map(|_| random.next() * 5.0);
        let location = locator.locate(p);
        let value = |name| location.value(&mesh, mesh.field(name).unwrap());
        assert!((value("linear") - linear(p)).abs() < 1e-4);
        assert_eq!(value("id"), location.owner as f32);
        assert!(value("short").is_nan());
    }
    assert!(Location::NOWHERE.value(&mesh, &mesh.fields[1]).is_nan());
}
