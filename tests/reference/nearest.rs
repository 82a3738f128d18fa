//! The closest place of the surface is that of brute force, from every tree.

use super::oracle::{P, distance};
use super::slice::wide;
use super::{ALPHAS, prepared, tree};
use olbvh::layout::NONE;
use olbvh::mesh::cases::{Case, cases};
use olbvh::mesh::{far_field, kuhn, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions};
use olbvh::reference::build::build;
use olbvh::reference::nearest::Surface;

/// Places in and around a box.
fn places(lo: P, hi: P, n: u32) -> impl Iterator<Item = [f32; 3]> {
    let part = |i: u32, c: u32| f64::from(i.wrapping_mul(2_654_435_761).rotate_left(7 * c) >> 12) / f64::from(1 << 20) * 1.6 - 0.3;
    (0..n).map(move |i| [0, 1, 2].map(|c| (lo[c] + part(i, c as u32) * (hi[c] - lo[c])) as f32))
}

/// Around a box, distances and places are known.
#[test]
fn the_surface_of_a_box() {
    let (mesh, topology) = prepared(kuhn([3, 4, 5]).unwrap());
    let tree = build(&mesh, &topology, &BuildOptions::default()).unwrap();
    let surface = Surface::new(&mesh, &topology, &tree);
    let hi = [3.0f32, 4.0, 5.0];
    let mut outside = 0;
    for p in places([0.0; 3], [3.0, 4.0, 5.0], 4000) {
        let nearest = [0, 1, 2].map(|c| p[c].clamp(0.0, hi[c]));
        let gap = (0..3).map(|c| f64::from(p[c] - nearest[c]).powi(2)).sum::<f64>().sqrt();
        let depth = (0..3).map(|c| p[c].min(hi[c] - p[c])).fold(f32::MAX, f32::min);
        let expected = if gap > 0.0 { gap } else { f64::from(depth) };
        let (location, square) = surface.nearest(p, f32::INFINITY).unwrap();
        assert!((f64::from(surface.distance(square)) - expected).abs() < 1e-5, "{p:?}: {expected}");
        let v = mesh.tets[location.owner as usize].map(|i| mesh.points[i as usize]);
        let at = [0, 1, 2].map(|c| (0..4).map(|k| location.barycentric[k] * v[k][c]).sum::<f32>());
        if gap > 0.0 {
            // Squares in single precision tell places apart that differ by 2^-12 of the distance, or more.
            let most = 1e-5 + 4e-4 * gap as f32;
            assert!((0..3).all(|c| (at[c] - nearest[c]).abs() < most), "{p:?}: {at:?}");
            outside += 1;
        }
        // A distance that is just too small, and one that is just large enough.
        let [less, more] = [0.999, 1.001].map(|part| (expected * part) as f32);
        assert!(expected < 1e-3 || surface.nearest(p, less).is_none() && surface.nearest(p, more) == Some((location, square)));
    }
    assert!(outside > 1000 && outside < 3900, "{outside}");
    for p in [[f32::NAN; 3], [f32::INFINITY, 0.0, 0.0], [-9.0, 0.0, 0.0]] {
        assert_eq!(surface.nearest(p, f32::INFINITY), None, "{p:?}");
    }
    assert!([-1.0, f32::NAN].iter().all(|&within| surface.nearest([-0.5; 3], within).is_none()));
    assert_eq!(surface.nearest([1.0, 0.0, 2.0], 0.0).map(|found| found.1), Some(0.0));
}

#[test]
fn no_tree_misses_the_closest_place() {
    let jittered = Case { name: "jittered", mesh: kuhn_jittered([5, 4, 3], 0.3, 3).unwrap() };
    let graded = Case { name: "far field", mesh: far_field(8).unwrap() };
    let mut measured = 0;
    for Case { name, mesh } in cases().unwrap().into_iter().filter(|case| case.mesh.tets.len() < 2000).chain([jittered, graded]) {
        let (mesh, topology) = prepared(mesh);
        let at_surface = |&t: &u32| topology.is_valid(t) && topology.neighbours[t as usize].contains(&NONE);
        let boundary: Vec<u32> = (0..mesh.tets.len() as u32).filter(at_surface).collect();
        let corners = |t: u32| mesh.tets[t as usize].map(|i| wide(mesh.points[i as usize]));
        // A face is a tetrahedron without volume.
        let gap = |t: u32, p: P| {
            let (v, beside) = (corners(t), topology.neighbours[t as usize]);
            let face = |k: usize| [v[(k + 1) % 4], v[(k + 2) % 4], v[(k + 3) % 4], v[(k + 1) % 4]];
            (0..4).filter(|&k| beside[k] == NONE).map(|k| distance(&face(k), p)).fold(f64::INFINITY, f64::min)
        };
        let mut answers: Option<Vec<_>> = None;
        for (alpha, assign) in ALPHAS.into_iter().zip([Assign::Planes, Assign::Aabb, Assign::Exact].into_iter().cycle()) {
            let tree = tree(&mesh, &topology, alpha, assign);
            let surface = Surface::new(&mesh, &topology, &tree);
            let grid = &tree.grid;
            let [lo, hi] = [grid.lo, grid.hi].map(|v| [0, 1, 2].map(|c| f64::from(v[c])));
            let points: Vec<_> = places(lo, hi, 60).collect();
            let found: Vec<_> = points.iter().map(|&p| surface.nearest(p, f32::INFINITY)).collect();
            if answers.is_none() {
                for (p, found) in points.iter().zip(&found) {
                    let least = boundary.iter().map(|&t| gap(t, wide(*p))).fold(f64::INFINITY, f64::min);
                    let Some((location, square)) = found else {
                        assert!(boundary.is_empty() || least > 0.9 / f64::from(grid.scale), "{name}: {p:?} has none at {least}");
                        continue;
                    };
                    let slack = 1e-5 / f64::from(grid.scale) + 1e-6 * least;
                    assert!(
                        location.owner != NONE && (f64::from(surface.distance(*square)) - least).abs() <= slack,
                        "{name}: {p:?}: {least}"
                    );
                    assert!(gap(location.owner, wide(*p)) <= least + slack, "{name}: {p:?}");
                    measured += 1;
                }
            }
            assert!(answers.get_or_insert_with(|| found.clone()) == &found, "{name}, alpha {alpha}, {assign}");
        }
    }
    assert!(measured > 1000, "{measured}");
}
