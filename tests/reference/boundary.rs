//! Neighbours, boundary tetrahedra and bad tetrahedra.

use super::prepared;
use olbvh::layout::NONE;
use olbvh::mesh::cases::cases;
use olbvh::mesh::{Fault, Mesh, kuhn, kuhn_jittered};
use olbvh::reference::boundary::{Topology, topology};
use std::collections::HashMap;

fn named(name: &str) -> (Mesh, Topology) {
    prepared(cases().unwrap().into_iter().find(|c| c.name == name).unwrap().mesh)
}

/// Neighbours, by a map from faces to tetrahedra.
fn naive_neighbours(mesh: &Mesh, topology: &Topology) -> Vec<[u32; 4]> {
    let face = |t: usize, i: usize| {
        let mut f: Vec<u32> = (0..4).filter(|&k| k != i).map(|k| mesh.tets[t][k]).collect();
        f.sort_unstable();
        f
    };
    let mut faces: HashMap<Vec<u32>, Vec<u32>> = HashMap::new();
    for t in (0..mesh.tets.len()).filter(|&t| topology.is_valid(t as u32)) {
        for i in 0..4 {
            faces.entry(face(t, i)).or_default().push(t as u32);
        }
    }
    let neighbour = |t: usize, i: usize| match faces.get(&face(t, i)).map(Vec::as_slice) {
        Some(&[a, b]) if topology.is_valid(t as u32) => a + b - t as u32,
        _ => NONE,
    };
    (0..mesh.tets.len()).map(|t| [0, 1, 2, 3].map(|i| neighbour(t, i))).collect()
}

#[test]
fn neighbours_are_those_of_a_map() {
    for case in cases().unwrap() {
        let (mesh, topology) = prepared(case.mesh);
        assert_eq!(topology.neighbours, naive_neighbours(&mesh, &topology), "{}", case.name);
    }
}

#[test]
fn kuhn_grids_have_their_surface_as_boundary() {
    for n in [1u32, 2, 3, 8] {
        let (mesh, topology) = prepared(kuhn([n; 3]).unwrap());
        let open: u32 = topology.neighbours.iter().flatten().map(|&x| u32::from(x == NONE)).sum();
        assert_eq!(open, 12 * n * n);
        let outer = |t: &[u32; 4]| t.iter().map(|&v| mesh.points[v as usize]).collect::<Vec<_>>();
        let on_surface = |p: &[[f32; 3]]| (0..3).any(|c| [0.0, n as f32].iter().any(|&x| p.iter().filter(|p| p[c] == x).count() == 3));
        let expected: Vec<bool> = mesh.tets.iter().map(|t| on_surface(&outer(t))).collect();
        let found: Vec<bool> = (0..mesh.tets.len() as u32).map(|t| topology.is_boundary(t)).collect();
        assert_eq!(expected, found);
        let counts = topology.counts;
        assert_eq!((counts.cells, counts.bad, counts.flat, counts.negative), (6 * n * n * n, 0, 0, 3 * n * n * n));
    }
}

#[test]
fn sign_of_cells_means_nothing() {
    let mesh = kuhn_jittered([5; 3], 0.2, 9).unwrap();
    let mut turned = mesh.clone();
    for (i, t) in turned.tets.iter_mut().enumerate() {
        t.rotate_left(i % 4);
        if i % 3 == 0 {
            t.swap(1, 2);
        }
    }
    let (a, b) = (topology(&mesh).unwrap(), topology(&turned).unwrap());
    assert_eq!((a.boundary, a.counts.flat, a.counts.bad), (b.boundary, b.counts.flat, b.counts.bad));
}

#[test]
fn negative_cells_are_counted_in_the_order_of_the_caller() {
    assert_eq!(named("single").1.counts.negative, 0);
    assert_eq!(named("single-negative").1.counts.negative, 1);
    let (mesh, topology) = named("share-face");
    assert_eq!(topology.neighbours, [[1, NONE, NONE, NONE], [0, NONE, NONE, NONE]]);
    assert_eq!(topology.counts.negative, negative(&mesh));
    for seed in 0..5 {
        let (mut mesh, _) = prepared(kuhn_jittered([6; 3], 0.4, seed).unwrap());
        for (i, t) in mesh.tets.iter_mut().enumerate() {
            t.swap(i % 4, i / 4 % 4);
        }
        assert_eq!(topology_of(&mesh).counts.negative, negative(&mesh));
    }
}

#[test]
fn folds_and_flat_cells_are_boundary() {
    // A fold, and a flat tetrahedron between two others.
    let (_, topology) = named("fold");
    assert_eq!(topology.neighbours, [[NONE, NONE, NONE, 1], [NONE, NONE, 0, NONE]]);
    let (_, topology) = named("flat-between");
    assert_eq!(topology.counts.flat, 1);
    assert!(topology.is_boundary(2));
    assert_eq!(topology.neighbours[2].map(|n| n == NONE), [false; 4]);

    // In the middle of a grid, a vertex pushed through the opposite face turns tetrahedra over. These and their
    // neighbours become boundary.
    let clean = kuhn([5; 3]).unwrap();
    let mut tangled = clean.clone();
    let centre = tangled.points.iter().position(|p| *p == [2.0, 2.0, 2.0]).unwrap();
    tangled.points[centre] = [2.9, 3.3, 2.2];
    let (before, after) = (topology_of(&clean), topology_of(&tangled));
    assert!(after.counts.boundary > before.counts.boundary);
    let turned = (0..clean.tets.len()).filter(|&t| volume(&clean, t) * volume(&tangled, t) < 0.0).collect::<Vec<_>>();
    assert!(!turned.is_empty());
    for &t in &turned {
        let straight = before.neighbours[t].iter().filter(|&&n| n != NONE && !turned.contains(&(n as usize))).collect::<Vec<_>>();
        assert!(straight.is_empty() || after.is_boundary(t as u32));
        for &&n in &straight {
            assert!(after.is_boundary(n));
        }
    }
}

fn negative(mesh: &Mesh) -> u32 {
    (0..mesh.tets.len()).map(|t| u32::from(volume(mesh, t) < 0.0)).sum()
}

fn topology_of(mesh: &Mesh) -> Topology {
    topology(mesh).unwrap()
}

fn volume(mesh: &Mesh, t: usize) -> f64 {
    let [a, b, c, d] = mesh.tets[t].map(|v| mesh.points[v as usize].map(f64::from));
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0])
}

#[test]
fn bad_cells_are_named_and_left_out() {
    let (_, topology) = named("bad-some");
    let expected = [
        (1, Fault::Index(8)),
        (2, Fault::Index(u32::MAX)),
        (3, Fault::Repeated(1)),
        (4, Fault::Repeated(3)),
        (5, Fault::Coordinate(4)),
        (6, Fault::Coordinate(5)),
        (7, Fault::Coordinate(6)),
        (9, Fault::Index(9)),
    ];
    assert_eq!(topology.bad, expected);
    assert_eq!(topology.counts.bad, 8);
    assert_eq!(topology.valid, [0b1_0000_0001]);
    assert_eq!((topology.grid.lo, topology.grid.hi), ([0.0; 4], [1.0, 1.0, 1.0, 0.0]));
    assert_eq!(topology.neighbours[0], [8, NONE, NONE, NONE]);
    let (_, all) = named("bad-all");
    assert_eq!((all.valid_cells(), all.counts.boundary), (0, 0));
}

#[test]
fn identical_cells_and_crowded_faces_have_no_neighbours() {
    let (_, topology) = named("identical-1000");
    assert!(topology.neighbours.iter().all(|n| *n == [NONE; 4]));
    assert_eq!((topology.counts.boundary, topology.counts.branched), (1000, 4));
    let (_, topology) = named("three-on-a-face");
    assert!(topology.neighbours.iter().all(|n| *n == [NONE; 4]));
    assert_eq!(topology.counts.branched, 1);
    // Two equal tetrahedra share all four faces, each of which is a fold.
    let (_, topology) = prepared(Mesh::new(named("single").0.points, vec![[0, 1, 2, 3], [3, 2, 0, 1]]));
    assert_eq!(topology.neighbours, [[1; 4], [0; 4]]);
    assert_eq!(topology.counts.boundary, 2);
}
