//! `Lists::Boundary`: its trees keep every rule, and walks find the same owners as `Lists::All`.

use super::{Random, options, prepared};
use olbvh::layout::NONE;
use olbvh::mesh::cases::{axle, cases};
use olbvh::mesh::{Mesh, kuhn, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, Lists};
use olbvh::reference::boundary::Topology;
use olbvh::reference::build::build;
use olbvh::reference::locate::{Locator, order_of};
use olbvh::reference::tet::Tet;
use olbvh::reference::walk::{DETOURS, LeafCell, STAR, STEPS, Walker};
use olbvh::tree::TreeArrays;
use rayon::prelude::*;

/// The tree with either kind of lists.
fn both(mesh: &Mesh, topology: &Topology, alpha: f32, assign: Assign) -> [TreeArrays; 2] {
    Lists::EVERY.map(|lists| build(mesh, topology, &BuildOptions { lists, ..options(alpha, assign) }).unwrap())
}

#[test]
fn trees_keep_every_rule() {
    for case in cases().unwrap() {
        let (mesh, topology) = prepared(case.mesh);
        for alpha in [0.0, 1.0, 3.0] {
            for assign in Assign::EVERY {
                let [all, tree] = both(&mesh, &topology, alpha, assign);
                let stats = tree.validate(&mesh, &topology).unwrap_or_else(|e| panic!("{} α {alpha} {assign}: {e}", case.name));
                assert_eq!(all.grid.level, tree.grid.level);
                // Cells that the boundary touches still have lists.
                for leaf in tree.leaves().filter(|&j| tree.is_boundary(j)) {
                    assert!(!tree.tets(leaf).is_empty());
                }
                assert!(stats.entries <= all.p.len() as u64, "{} α {alpha} {assign}", case.name);
            }
        }
    }
}

#[test]
fn entries_grow_with_the_surface() {
    let share = |n: u32| {
        let (mesh, topology) = prepared(kuhn_jittered([n; 3], 0.3, 5).unwrap());
        let [all, tree] = both(&mesh, &topology, 0.0, Assign::Aabb);
        let full = tree.leaves().filter(|&j| !tree.is_boundary(j));
        assert!(full.clone().all(|j| tree.entries(j).len() == 1));
        // With `Lists::All`, the list of a leaf that is full of mesh may start with tetrahedra that do not touch its
        // cell, and only the first ones are tested.
        assert!(full.count() >= all.leaves().filter(|&j| !all.is_boundary(j)).count());
        tree.p.len() as f64 / all.p.len() as f64
    };
    let shares = [8, 16, 32].map(share);
    assert!(shares[0] > shares[1] && shares[1] > shares[2] && shares[2] < 0.35, "{shares:?}");
}

/// Points on faces, edges and vertices, an ulp away from them, along the extensions of edges, and anywhere.
fn adversarial(mesh: &Mesh, topology: &Topology, seed: u64, n: usize) -> Vec<[f32; 3]> {
    let mut random = Random(seed);
    let grid = &topology.grid;
    let ulp = |x: f32, d: usize| [x.next_down(), x, x.next_up()][d];
    (0..n)
        .map(|i| match i % 8 {
            k @ 0..=3 => random.point(mesh, topology, 1 + k),
            4 => {
                let kind = 1 + random.below(3);
                random.point(mesh, topology, kind).map(|x| ulp(x, random.below(3)))
            }
            5 => {
                let ids = mesh.tets[random.below(mesh.tets.len())];
                let [a, b] = [ids[0], ids[1]].map(|v| mesh.points[v as usize]);
                let t = random.next() * 4.0 - 1.5;
                [0, 1, 2].map(|c| (a[c] + t * (b[c] - a[c])).clamp(grid.lo[c], grid.hi[c]))
            }
            6 => {
                // Multiples of half a cell of the finest grid: on the sides and centres of leaves.
                [0, 1, 2].map(|c| grid.lo[c] + (random.below(2049) as f32 / 2048.0) * (grid.hi[c] - grid.lo[c]))
            }
            _ => [0, 1, 2].map(|c| grid.lo[c] + random.next() * (grid.hi[c] - grid.lo[c])),
        })
        .collect()
}

fn same_owners(name: &str, mesh: Mesh, n: usize) -> (u32, u32) {
    let (mesh, topology) = prepared(mesh);
    let points = adversarial(&mesh, &topology, 23, n);
    let (mut steps, mut detours) = (0, 0);
    for (alpha, assign) in [(0.0, Assign::Aabb), (1.0, Assign::Exact), (2.0, Assign::Planes)] {
        let [all, tree] = both(&mesh, &topology, alpha, assign);
        let (all, walking) = (Locator::new(&mesh, &topology, &all), Locator::new(&mesh, &topology, &tree));
        let some = &points[..if alpha > 1.0 { n / 10 } else { n }];
        let expected = all.locate_each(some);
        for order in [(0..some.len() as u32).collect(), order_of(&topology.grid, some, 16), order_of(&topology.grid, some, 22)] {
            for locator in [&all, &walking] {
                assert!(locator.locate_in_runs(some, &order) == expected, "{name} α {alpha} {assign}: runs");
            }
        }
        let walks = some.par_iter().enumerate().map(|(i, &p)| {
            let what = || format!("{name} α {alpha} {assign} point {i} {p:?}");
            let (expected, found) = (all.locate(p), walking.locate(p));
            assert_eq!(expected, found, "{}", what());
            assert_eq!(all.owners(p), walking.owners(p), "{}", what());
            let others = all.owners(p);
            for hint in others.into_iter().chain([NONE, i as u32 % mesh.tets.len() as u32]) {
                assert_eq!(walking.locate_near(p, hint), expected, "{}, hint {hint}", what());
            }
            assert_eq!(walking.locate_by_traversal(p, 3), expected, "{}", what());
            walking.walk(p).map_or((0, 0), |w| (w.steps, w.detours))
        });
        let (s, d) = walks.reduce(|| (0, 0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
        (steps, detours) = (steps.max(s), detours.max(d));
    }
    (steps, detours)
}

/// No walk circles or loses its point. `OLBVH_TEST_POINTS=100000000` asks for this many points, in a larger mesh.
#[test]
fn every_walk_ends() {
    let asked = std::env::var("OLBVH_TEST_POINTS").ok().and_then(|n| n.parse::<usize>().ok());
    let (n, side) = asked.map_or((40_000, 14), |n| (n, 40));
    let (mesh, topology) = prepared(kuhn_jittered([side; 3], 0.2, 11).unwrap());
    let tree = build(&mesh, &topology, &BuildOptions { lists: Lists::Boundary, ..options(1.0, Assign::Exact) }).unwrap();
    let locator = Locator::new(&mesh, &topology, &tree);
    let (mut walked, mut longest, mut detours) = (0, 0, 0);
    for chunk in 0..n.div_ceil(1 << 20) {
        let points = adversarial(&mesh, &topology, 23 + chunk as u64, (n - (chunk << 20)).min(1 << 20));
        let walk = |p: &[f32; 3]| {
            // A point that was moved by an ulp may lie outside, by more than the tolerance where tetrahedra are flat.
            let p = [0, 1, 2].map(|c| p[c].clamp(topology.grid.lo[c], topology.grid.hi[c]));
            assert_ne!(locator.locate(p).owner, NONE, "{p:?} is lost");
            let Some(walk) = locator.walk(p) else { return (0, 0, 0) };
            assert!(walk.best.owner != NONE && walk.detours < DETOURS && walk.steps < STEPS, "{p:?}: {walk:?}");
            (1, walk.steps, usize::from(walk.detours > 0))
        };
        let (walks, steps, by) = points.par_iter().map(walk).reduce(|| (0, 0, 0), |a, b| (a.0 + b.0, a.1.max(b.1), a.2 + b.2));
        (walked, longest, detours) = (walked + walks, longest.max(steps), detours + by);
    }
    println!(
        "{walked} of {n} points walked to, {detours} of them by way of another, the others searched in lists; longest walk {longest} steps"
    );
    assert!(walked > n / 4);
}

/// Stars that a walk could not hold: their vertices are crowded, and lie in lists.
#[test]
fn owners_at_crowded_vertices_are_those_of_the_lists() {
    for sectors in [10, 70, 300] {
        let (mesh, topology) = prepared(axle(sectors).unwrap());
        let axis = |t: &&[u32; 4]| t.contains(&(4 * (sectors + 1) * 4));
        let met = mesh.tets.iter().filter(axis).count();
        assert_eq!(met > STAR, topology.counts.crowded >= 7, "{sectors} sectors: {met} tetrahedra at a vertex on the axis");
        let [all, tree] = both(&mesh, &topology, 0.0, Assign::Planes);
        let (all, walking) = (Locator::new(&mesh, &topology, &all), Locator::new(&mesh, &topology, &tree));
        let mut walked = 0;
        for i in 0..=512u16 {
            let p = [0.0, 0.0, f32::from(i) / 64.0];
            assert_eq!(all.owners(p), walking.owners(p), "{sectors} sectors, {p:?}");
            assert_eq!(all.locate(p), walking.locate(p), "{sectors} sectors, {p:?}");
            walked += usize::from(walking.walk(p).is_some());
        }
        assert!(met > STAR || walked > 0, "{sectors} sectors: no walk is tested");
    }
}

/// Round an edge, some cells may be near a point and others between them not, so that its star falls into parts. A walk
/// that meets the wrong one must go on.
#[test]
fn walks_do_not_end_in_the_wrong_part_of_a_star() {
    let mut random = Random(5);
    let mut parted = 0;
    for ring in 0..20_000 {
        let [s, c] = [random.next() * 0.8 + 0.1, random.next() * 0.8 + 0.1];
        let tilted = |[x, y, z]: [f32; 3]| [x, y + s * x + c * z, z + c * x];
        let mut points = vec![[0.0; 3], [1.0, 0.0, 0.0]].into_iter().map(tilted).collect::<Vec<_>>();
        for i in 0..8u8 {
            let (sin, cos) = ((f32::from(i) + 0.8 * random.next()) * std::f32::consts::FRAC_PI_4).sin_cos();
            let radius = (random.next() * 5.0 - 4.0).exp2();
            points.push(tilted([random.next(), radius * cos, radius * sin]));
        }
        let (mesh, topology) = prepared(Mesh::new(points, (0..8).map(|i| [0, 1, 2 + i, 2 + (i + 1) % 8]).collect()));
        let normalised: Vec<_> = mesh.points.iter().map(|&p| topology.grid.normalise(p)).collect();
        let walker = Walker { mesh: &mesh, neighbours: &topology.neighbours, normalised: &normalised };
        let tets: Vec<_> = mesh.tets.iter().map(|&ids| Tet::new(ids, &normalised)).collect();
        let away = (random.next() * 6.0 - 19.0).exp2();
        let (sin, cos) = (random.next() * std::f32::consts::TAU).sin_cos();
        let x = topology.grid.normalise(tilted([0.5, away * cos, away * sin]));
        let weights: Vec<_> = tets.iter().map(|tet| tet.weights(x)).collect();
        let Some(owner) = weights.iter().position(|w| w.inside) else { continue };
        parted += usize::from(weights.iter().filter(|w| w.near()).count() > 2 && weights.iter().any(|w| !w.near()));
        for (seed, tet) in (0..).zip(&tets) {
            let centre = [0, 1, 2].map(|c| tet.v.iter().map(|v| v[c] / 4.0).sum());
            let walk = walker.walk(seed, &LeafCell { centre, half: [0.0; 3] }, x);
            assert_eq!((walk.best.owner, walk.best.inside), (owner as u32, true), "ring {ring} from {seed}: {walk:?}");
        }
    }
    assert!(parted > 1000, "{parted} stars in parts");
}

#[test]
fn owners_are_those_of_the_lists() {
    for (name, mesh) in [
        ("kuhn", kuhn([16; 3]).unwrap()),
        ("kuhn, off the grid", kuhn([13, 17, 15]).unwrap()),
        ("jittered", kuhn_jittered([20, 18, 22], 0.12, 11).unwrap()),
        ("more", kuhn_jittered([20; 3], 0.2, 3).unwrap()),
    ] {
        let (steps, detours) = same_owners(name, mesh, 12_000);
        println!("{name}: longest walk {steps} steps, {detours} detours");
        assert!(detours == 0, "{name}: {detours}");
    }
}
