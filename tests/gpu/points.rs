//! Ten million points on faces, edges and vertices and at random in a jittered Kuhn grid: none is lost, and every tree
//! gives the same owners.
//!
//! `OLBVH_TEST_POINTS=10000000` runs all of them; otherwise a part is run, to keep the suite short, and the output says
//! so. Drivers other than the reference driver also get a smaller grid: on SwiftShader, most of the time went into the
//! seven trees over it.

use glam::DVec3;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Binding, Gpu, GpuOptions};
use olbvh::mesh::{Mesh, kuhn, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, Lists};
use olbvh::query::{LocateMethod, LocateOptions, OwnersMemory, SILENT, locate, locate_all, overlap};
use olbvh::reference::boundary::topology;
use olbvh::reference::build::build;
use olbvh::reference::locate::Locator;
use std::cell::RefCell;
use std::env;

const FULL: usize = 10_000_000;
const SOME: usize = 100_000;

/// Whether tests run on the reference driver, lavapipe 25 with 256 bits, or without a named driver.
fn is_reference() -> bool {
    let driver = env::var("OLBVH_TEST_DRIVER").unwrap_or_default();
    env::var("OLBVH_TEST_VALIDATION").is_err() && (driver.is_empty() || driver == "lavapipe25-256")
}

fn points() -> usize {
    let some = if is_reference() { SOME } else { SOME / 4 };
    env::var("OLBVH_TEST_POINTS").ok().and_then(|n| n.parse().ok()).unwrap_or(some)
}

fn mix(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// Point number `i`: by turns a vertex, on an edge, on a face, or anywhere; never outside of the grid.
fn point(mesh: &Mesh, cells: f32, i: usize) -> [f32; 3] {
    let mut state = mix(i as u32 ^ 0x51ed_270b);
    let mut next = || {
        state = mix(state.wrapping_add(0x9e37_79b9));
        state
    };
    let unit = |next: &mut dyn FnMut() -> u32| (next() >> 8) as f32 / 16_777_216.0;
    if i % 4 == 3 {
        return [0; 3].map(|_| unit(&mut next) * cells);
    }
    let tet = mesh.tets[next() as usize % mesh.tets.len()];
    let turn = next() as usize;
    let v = [0, 1, 2].map(|k| mesh.points[tet[(turn + k) % 4] as usize]);
    let [a, b] = match i % 4 {
        0 => [1.0, 0.0],
        1 => {
            let t = if turn & 8 == 0 { 0.5 } else { unit(&mut next) };
            [t, 1.0 - t]
        }
        _ => {
            let (s, t) = (unit(&mut next), unit(&mut next));
            if s + t > 1.0 { [1.0 - s, 1.0 - t] } else { [s, t] }
        }
    };
    let c = 1.0 - a - b;
    [0, 1, 2].map(|k| (a * v[0][k] + b * v[1][k] + c * v[2][k]).clamp(0.0, cells))
}

/// α, and how many of a thousand points are located in its trees. Lists grow with α, to thousands of entries at 4.
const SHARES: [(f32, usize); 4] = [(0.0, 450), (1.0, 400), (2.0, 145), (4.0, 5)];

/// Whether the vertices of each tetrahedron are numbered in positive orientation.
fn signs(mesh: &Mesh) -> Vec<bool> {
    let positive = |ids: &[u32; 4]| {
        let [a, b, c, d] = ids.map(|i| DVec3::from_array(mesh.points[i as usize].map(f64::from)));
        (b - a).cross(c - a).dot(d - a) > 0.0
    };
    mesh.tets.iter().map(positive).collect()
}

/// Locates the share of `n` points of one α: a third of it with each assignment, in trees with both kinds of lists, and
/// in a tree of α = 0. Each point is thus located three times.
fn no_point_is_lost(binding: Binding, n: usize, which: usize) {
    let (alpha, share) = SHARES[which];
    let before: usize = SHARES[..which].iter().map(|s| s.1).sum();
    let (begin, count) = (n / 1000 * before, n / 1000 * share);
    let gpu = Gpu::new(&GpuOptions { binding: Some(binding), ..GpuOptions::default() }).unwrap();
    let side = if is_reference() || n == FULL { 40 } else { 16 };
    let mesh = kuhn_jittered([side; 3], 0.2, 11).unwrap();
    // Where tetrahedra overlap, a walk may find another one that contains the point (SPEC 3.1). Here, none has turned
    // over.
    assert!(signs(&mesh) == signs(&kuhn([side; 3]).unwrap()));
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let build =
        |alpha, assign, lists| Tree::build(&gpu, &device, &BuildOptions { alpha, assign, lists, ..BuildOptions::default() }).unwrap();
    let first = build(0.0, Assign::Exact, Lists::Boundary);
    let third = count.div_ceil(3);
    let mut located = 0;
    for (k, assign) in Assign::EVERY.into_iter().enumerate() {
        let from = begin + k * third;
        let points: Vec<_> = (from..(from + third).min(begin + count)).map(|i| point(&mesh, side as f32, i)).collect();
        let find = |tree: &Tree| locate(tree, &points, None, &LocateOptions::default(), SILENT).unwrap().owners;
        let expected = find(&first);
        for lists in Lists::EVERY {
            let found = find(&build(alpha, assign, lists));
            for (i, (a, b)) in expected.iter().zip(&found).enumerate() {
                assert_ne!(*a, u32::MAX, "point {} {:?} is lost", from + i, points[i]);
                assert_eq!(a, b, "owner of point {} {:?} with alpha {alpha}, {assign}, lists {lists}", from + i, points[i]);
            }
        }
        located += points.len();
    }
    println!("{located} points located by {binding:?} with alpha {alpha} as with alpha 0, none lost");
    if n < FULL {
        println!("NOT ALL: {n} of {FULL} points in the four tests; OLBVH_TEST_POINTS={FULL} runs them all");
    }
    crate::silent(&gpu);
}

#[test]
fn alpha_0() {
    no_point_is_lost(Binding::Address, points(), 0);
}

#[test]
fn alpha_1() {
    no_point_is_lost(Binding::Address, points(), 1);
}

#[test]
fn alpha_2() {
    no_point_is_lost(Binding::Address, points(), 2);
}

#[test]
fn alpha_4() {
    no_point_is_lost(Binding::Address, points(), 3);
}

#[test]
fn by_descriptors() {
    no_point_is_lost(Binding::Descriptors, SOME.min(points()) / 4, 1);
}

/// Where lists are long, few points are asked about at a time, so that all their owners can be numbered. Here, tens of
/// thousands of tetrahedra share an edge. Most points lie outside, since it would take long if none did.
#[test]
fn all_owners_of_points_on_a_crowded_edge() {
    let n = 66_000_u32;
    let rim = |i: u32| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        [angle.cos() as f32, angle.sin() as f32, 0.5]
    };
    let points = [[0.0; 3], [0.0, 0.0, 1.0]].into_iter().chain((0..n).map(rim)).collect();
    let mesh = Mesh::new(points, (0..n).map(|i| [0, 1, 2 + i, 2 + (i + 1) % n]).collect());
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let options = BuildOptions { level: Some(2), assign: Assign::Aabb, lists: Lists::All, ..BuildOptions::default() };
    let tree = Tree::build(&gpu, &device, &options).unwrap();
    let at_once = OwnersMemory::most_points(tree.status().longest_leaf) as usize;
    assert!(tree.status().longest_leaf >= n && at_once < 33_000, "{}", tree.status().longest_leaf);
    let on_edge = |i: usize| i % (at_once / 2) == 7;
    let points: Vec<_> = (0..2 * at_once + 9).map(|i| if on_edge(i) { [0.0, 0.0, 0.25] } else { [90.0; 3] }).collect();
    let told = RefCell::new(Vec::new());
    let found = locate_all(&tree, &points, 0.0, &|done, all| {
        told.borrow_mut().push((done, all));
        Ok(())
    })
    .unwrap();
    let all = points.len() as u64;
    assert_eq!(told.into_inner(), [at_once as u64, 2 * at_once as u64, all].map(|done| (done, all)));
    assert_eq!((0..points.len()).filter(|&i| on_edge(i)).count(), 5);
    for (i, owners) in found.owners.iter().enumerate() {
        assert!(if on_edge(i) { owners.iter().copied().eq(0..n) } else { owners.is_empty() }, "point {i}: {} owners", owners.len());
    }
}

/// Leaves that list more tetrahedra than 16 dispatches of the usual length search. Mesa 22 ends the loops of an invocation
/// after 65,535 passes.
#[test]
fn long_lists_are_searched_to_their_end() {
    let mesh = kuhn([37; 3]).unwrap();
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let [single, fine] = [Some(0), None]
        .map(|level| Tree::build(&gpu, &device, &BuildOptions { level, lists: Lists::All, ..BuildOptions::default() }).unwrap());
    assert!(single.status().longest_leaf > 16 * 16_384);
    let points: Vec<_> = (0..60u32).map(|i| [0, 1, 2].map(|c| mix(3 * i + c) as f32 * (37.0 / 4_294_967_296.0))).collect();
    let found = |tree| locate(tree, &points, None, &LocateOptions::default(), SILENT).unwrap().owners;
    let owners = found(&single);
    assert!(owners == found(&fine) && owners.iter().all(|&owner| owner != u32::MAX), "{owners:?}");
    let all = locate_all(&single, &points, 0.0, SILENT).unwrap();
    assert!(all.owners.iter().zip(&owners).all(|(all, owner)| all.first() == Some(owner)), "{all:?}");
    let other = Mesh::new(
        points
            .iter()
            .flat_map(|&p| [[0.0; 3], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]].map(|d| [0, 1, 2].map(|c| p[c] + d[c])))
            .collect(),
        (0..60).map(|i| [0, 1, 2, 3].map(|k| 4 * i + k)).collect(),
    );
    let other = DeviceMesh::upload(&gpu, &other, BadCells::Skip).unwrap();
    let other = Tree::build(&gpu, &other, &BuildOptions::default()).unwrap();
    let [a, b] = [&single, &fine].map(|tree| overlap(&other, tree, SILENT).unwrap().overlap);
    assert_eq!((a.a, a.b, a.effort[0].by_vertex), (b.a, b.b, b.effort[0].by_vertex));
}

/// Six times the signed volume of four points with integer coordinates, exactly.
fn volume(v: [[i64; 3]; 4]) -> i128 {
    let [a, b, c] = [1, 2, 3].map(|i| [0, 1, 2].map(|k| i128::from(v[i][k] - v[0][k])));
    let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
    a[0] * minor(1, 2) - a[1] * minor(0, 2) + a[2] * minor(0, 1)
}

/// Tetrahedra that share nothing, 1/`thinness` as thick as long, with points strictly inside them. Coordinates are
/// multiples of 2^-22 below 4, so floats hold them, and integers tell exactly where a point is.
#[test]
fn no_point_strictly_inside_a_sliver_is_lost() {
    const UNIT: i64 = 1 << 22;
    let mut state = 7u32;
    let mut next = |below: i64| {
        state = mix(state.wrapping_add(0x9e37_79b9));
        (i64::from(state >> 2) * below) >> 30
    };
    let float = |p: [i64; 3]| p.map(|x| x as f32 / UNIT as f32);
    let (mut mesh, mut points, mut owners) = (Mesh::default(), Vec::new(), Vec::new());
    for thinness in [300, 3_000, 30_000, 300_000] {
        for place in 0..16i64 {
            let corner = [place % 4 * UNIT, place / 4 * UNIT, mesh.tets.len() as i64 / 16 * UNIT];
            let tet = loop {
                let [a, b, c] = [0; 3].map(|_| corner.map(|x| x + next(UNIT)));
                let (s, t) = (next(UNIT), next(UNIT));
                // Near the plane of the others, but not beyond the cell of this tetrahedron.
                let d = [0, 1, 2]
                    .map(|k| a[k] + ((b[k] - a[k]) * s + (c[k] - a[k]) * t) / (2 * UNIT) + next(2 * UNIT / thinness + 2) - UNIT / thinness);
                let within = (0..3).all(|k| (corner[k]..corner[k] + UNIT).contains(&d[k]));
                if within && volume([a, b, c, d]) != 0 {
                    break [a, b, c, d];
                }
            };
            let (owner, whole) = (mesh.tets.len() as u32, volume(tet));
            for _ in 0..400 {
                let shares = [0; 4].map(|_| 1 + next(UNIT));
                let sum: i64 = shares.iter().sum();
                let p = [0, 1, 2].map(|k| (0..4).map(|i| tet[i][k] * shares[i]).sum::<i64>() / sum);
                let inside = |i: usize| {
                    let mut v = tet;
                    v[i] = p;
                    volume(v).signum() == whole.signum()
                };
                if (0..4).all(inside) {
                    points.push(float(p));
                    owners.push(owner);
                }
            }
            let first = mesh.points.len() as u32;
            mesh.points.extend(tet.map(float));
            mesh.tets.push([0, 1, 2, 3].map(|i| first + i));
        }
    }
    assert!(points.len() > 15_000, "{} points strictly inside", points.len());
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    for lists in [Lists::All, Lists::Boundary] {
        let tree = Tree::build(&gpu, &device, &BuildOptions { lists, ..BuildOptions::default() }).unwrap();
        let found = locate(&tree, &points, None, &LocateOptions { tolerance: 0.0, ..LocateOptions::default() }, SILENT).unwrap();
        let lost: Vec<usize> = (0..points.len()).filter(|&i| found.owners[i] != owners[i]).collect();
        assert!(lost.is_empty(), "{lists:?}: {} of {} points are lost, first {:?}", lost.len(), points.len(), points[lost[0]]);
    }
}

fn tree_over(gpu: &Gpu, mesh: &Mesh, options: &BuildOptions) -> Tree {
    Tree::build(gpu, &DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap(), options).unwrap()
}

/// A hint must not lead a point that is not finite to an owner, nor may a tolerance decide that is none.
#[test]
fn what_is_no_number_has_no_owner() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn([4; 3]).unwrap();
    let tree = tree_over(&gpu, &mesh, &BuildOptions::default());
    let inside = [1.3, 2.1, 1.7];
    let mut points = vec![inside; 32];
    for (k, nowhere) in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY].into_iter().enumerate() {
        points[7 * k + 3][k % 3] = nowhere;
    }
    for method in [LocateMethod::Descent, LocateMethod::Runs, LocateMethod::Sorted, LocateMethod::SortedRuns] {
        let found = locate(&tree, &points, None, &LocateOptions { method, ..LocateOptions::default() }, SILENT).unwrap();
        for (i, (point, owner)) in points.iter().zip(&found.owners).enumerate() {
            assert_eq!(*owner == u32::MAX, !point.iter().all(|x| x.is_finite()), "{method:?}, point {i}");
        }
    }
    for tolerance in [f32::NAN, f32::INFINITY, -1e-5] {
        let refused = locate(&tree, &points, None, &LocateOptions { tolerance, ..LocateOptions::default() }, SILENT);
        assert!(refused.is_err_and(|e| e.to_string().contains("a tolerance of")), "{tolerance}");
        assert!(locate_all(&tree, &points, tolerance, SILENT).is_err(), "{tolerance}");
    }
    crate::silent(&gpu);
}

/// Signs of zeros would differ between devices.
#[test]
fn coordinates_of_corners_have_no_sign() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn([3; 3]).unwrap();
    let tree = tree_over(&gpu, &mesh, &BuildOptions::default());
    let found = locate(&tree, &mesh.points, None, &LocateOptions::default(), SILENT).unwrap();
    assert!(
        found.barycentrics.iter().all(|b| b.iter().all(|w| w.is_sign_positive()) && b.iter().any(|w| *w > 0.9999)),
        "{:?}",
        found.barycentrics
    );
}

/// Points so far from two small tetrahedra that rounding leaves nothing of their weights. Some of them once had owners.
#[test]
fn far_outside_there_are_no_owners() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let far = 100_000.0;
    let corners = [[6.0, 6.0, 1.0], [6.0, 9.0, 2.0], [0.0, 0.0, 4.0], [4.0, 2.0, 0.0]];
    let others = [[far; 3], [far - 9.0, far, far], [far, far - 9.0, far], [far, far, far - 9.0]];
    let mesh = Mesh::new([corners, others].concat(), vec![[0, 1, 2, 3], [4, 5, 6, 7]]);
    let mut points = vec![[-41_235.0, -40_316.0, -10_397.0], [-35_765.0, -28_373.0, -54_901.0], [-34_276.0, -50_925.0, -29_764.0]];
    points.extend((0..20_000u32).map(|i| [0, 1, 2].map(|k| -60_000.0 + (mix(3 * i + k) >> 8) as f32 * (59_000.0 / 16_777_216.0))));
    // Just outside of the bounds, within the tolerance.
    points.push([far + 2e-5, far - 1.0, far - 1.0]);
    for (lists, level, tolerance) in [(Lists::Boundary, None, 1e-5), (Lists::All, Some(0), 0.0), (Lists::Boundary, Some(10), 1e-2)] {
        let options = BuildOptions { lists, level, ..BuildOptions::default() };
        let tree = tree_over(&gpu, &mesh, &options);
        for method in [LocateMethod::Descent, LocateMethod::Traversal(8)] {
            let found = locate(&tree, &points, None, &LocateOptions { method, tolerance }, SILENT).unwrap();
            let owned = found.owners[..points.len() - 1].iter().filter(|&&owner| owner != u32::MAX).count();
            assert_eq!(owned, 0, "{method:?}, {lists:?}, level {level:?}");
        }
        let topology = topology(&mesh).unwrap();
        let arrays = build(&mesh, &topology, &options).unwrap();
        let locator = Locator::new(&mesh, &topology, &arrays).with_tolerance(tolerance);
        assert!(points[..points.len() - 1].iter().all(|&p| locator.locate(p).found().is_none() && locator.owners(p).is_empty()));
        let all = locate_all(&tree, &points, tolerance, SILENT).unwrap();
        assert_eq!(all.owners.iter().flatten().count(), locator.owners(points[points.len() - 1]).len());
    }
    crate::silent(&gpu);
}
