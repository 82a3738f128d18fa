//! Slabs: they change no answer, and tell most points beside a mesh.

use super::{Random, prepared};
use olbvh::grid::{MAX_LEVEL, morton, unmorton};
use olbvh::mesh::cases::cases;
use olbvh::mesh::{far_field, graded, kuhn_jittered, shell, slivers};
use olbvh::options::{BuildOptions, Lists};
use olbvh::reference::assign::{cell_centre, half_cell};
use olbvh::reference::brute;
use olbvh::reference::build::{Construction, build, construct};
use olbvh::reference::locate::{Locator, place};
use olbvh::reference::separate::{box_touches, touch_slack};
use olbvh::reference::slabs::{EVERYTHING, SlabCell};
use olbvh::reference::vertices::Vertices;
use rayon::prelude::*;

/// A point on a vertex, an edge or a face or within a tetrahedron, moved by up to three units in the last place.
fn beside_corners(random: &mut Random, corners: [[f32; 3]; 4], count: usize) -> [f32; 3] {
    let weights: Vec<f32> = (0..4).map(|k| if k < count { random.next() + 0.01 } else { 0.0 }).collect();
    let sum: f32 = weights.iter().sum();
    let mut p = [0, 1, 2].map(|c| (0..4).map(|k| weights[k] / sum * corners[k][c]).sum::<f32>());
    for x in &mut p {
        for _ in 0..(random.next() * 4.0) as u32 {
            *x = if random.next() < 0.5 { x.next_up() } else { x.next_down() };
        }
    }
    p
}

#[test]
fn owners_stay_the_same() {
    let made = [
        ("slivers", slivers(3)),
        ("graded", graded(4)),
        ("shell", shell(9)),
        ("jittered", kuhn_jittered([5; 3], 0.3, 7)),
        ("far field", far_field(8)),
    ];
    let made = made.into_iter().map(|(name, mesh)| (name.to_owned(), mesh.unwrap()));
    let meshes = cases().unwrap().into_iter().map(|case| (case.name.to_string(), case.mesh)).chain(made);
    let mut told = 0;
    for (name, mesh) in meshes.filter(|(_, mesh)| !mesh.tets.is_empty()) {
        let (mesh, topology) = prepared(mesh);
        let normalised = Vertices::new(&mesh, &topology.grid).normalised;
        let (mut random, grid) = (Random(5), topology.grid);
        let points: Vec<_> = (0..400)
            .map(|i| {
                let t = (random.next() * mesh.tets.len() as f32) as usize;
                let corners = mesh.tets[t].map(|v| mesh.points.get(v as usize).copied().unwrap_or_default());
                let anywhere = [0, 1, 2].map(|c| grid.lo[c] + (1.1 * random.next() - 0.05) * (grid.hi[c] - grid.lo[c]));
                if i % 5 == 0 { anywhere } else { beside_corners(&mut random, corners, i % 5) }
            })
            .collect();
        let expected: Vec<_> = points.par_iter().map(|&p| brute::owners(&mesh, &topology, &normalised, p)).collect();
        for level in [0, 2, 3, 5, 7] {
            let plain = BuildOptions { level: Some(level), ..BuildOptions::default() };
            let without = build(&mesh, &topology, &plain).unwrap();
            let with = build(&mesh, &topology, &BuildOptions { slabs: true, ..plain }).unwrap();
            with.validate(&mesh, &topology).unwrap();
            assert!(without.slabs.is_empty() && with.slabs.len() == with.leaves().len());
            told += with.slabs.iter().filter(|&&slab| slab != EVERYTHING).count();
            for tolerance in [0.0, 1e-5, 2e-4] {
                let [without, with] = [&without, &with].map(|tree| Locator::new(&mesh, &topology, tree).with_tolerance(tolerance));
                for (&p, owners) in points.iter().zip(&expected) {
                    let (found, plainly) = (with.locate(p), without.locate(p));
                    assert_eq!(found, plainly, "{name} level {level} tolerance {tolerance} {p:?}");
                    assert!(owners.is_empty() || owners.contains(&found.owner), "{name} level {level} {p:?}");
                }
            }
        }
    }
    assert!(told > 1000, "{told} slabs");
}

#[test]
fn most_points_beside_thin_walls_need_no_search() {
    let (mesh, topology) = prepared(shell(30).unwrap());
    let tree = build(&mesh, &topology, &BuildOptions { level: Some(5), slabs: true, ..BuildOptions::default() }).unwrap();
    let (grid, locator, mut random) = (tree.grid, Locator::new(&mesh, &topology, &tree).with_tolerance(0.0), Random(3));
    let (mut beside, mut told) = (0, 0);
    for _ in 0..40_000 {
        let p = [0, 1, 2].map(|c| grid.lo[c] + random.next() * (grid.hi[c] - grid.lo[c]));
        let Some((cell, x)) = place(&grid, p) else { continue };
        let Some(leaf) = tree.find_leaf(cell).filter(|_| locator.locate(p).found().is_none()) else { continue };
        let slab = tree.slabs[(leaf - tree.internal_nodes()) as usize];
        let leaf_cell = unmorton(morton(cell) >> (3 * (MAX_LEVEL - grid.level)));
        beside += 1;
        told += u32::from(SlabCell::new(&grid, leaf_cell).is_outside(slab, x));
    }
    assert!(beside > 500 && 10 * told > 6 * beside, "{told} of {beside}");
}

/// Three unit vectors that are perpendicular to each other: those of the grid, or turned by a random quaternion.
fn turned_axes(random: &mut Random) -> [[f32; 3]; 3] {
    let [x, y, z, w] = if random.next() < 0.3 { [0.0, 0.0, 0.0, 1.0] } else { [0; 4].map(|_| random.next() - 0.5) };
    let turn = glam::Quat::from_xyzw(x, y, z, w + 1e-3).normalize();
    [glam::Vec3::X, glam::Vec3::Y, glam::Vec3::Z].map(|axis| (turn * axis).to_array())
}

/// Boxes of any direction, from a hundredth of a leaf to several leaves large.
#[test]
fn boxes_beside_slabs_are_not_touched() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/flow_sphere_50k.vtu");
    let loaded = olbvh::formats::load(&file, &olbvh::formats::LoadOptions::default()).unwrap();
    let made = [("slivers", slivers(3)), ("graded", graded(4)), ("shell", shell(9)), ("jittered", kuhn_jittered([5; 3], 0.3, 7))];
    let made = made.into_iter().map(|(name, mesh)| (name.to_owned(), mesh.unwrap())).chain([("flow_sphere".into(), loaded.mesh)]);
    let meshes = cases().unwrap().into_iter().map(|case| (case.name.to_string(), case.mesh)).chain(made);
    let (mut tried, mut told, mut random) = (0, 0, Random(11));
    for (name, mesh) in meshes.filter(|(_, mesh)| !mesh.tets.is_empty()) {
        let (mesh, topology) = prepared(mesh);
        let vertices = Vertices::new(&mesh, &topology.grid);
        for level in [2, 5] {
            let options = BuildOptions { slabs: true, ..BuildOptions::default() };
            let Construction { codes, tree } = construct(&mesh, &topology, &vertices, level, &options).unwrap();
            let (first, half) = (tree.internal_nodes(), half_cell(&tree.grid, tree.grid.level, [0; 3]));
            for leaf in
                tree.leaves().filter(|leaf| tree.slabs[(leaf - first) as usize] != EVERYTHING).step_by(1 + tree.leaves().len() / 100)
            {
                let i = (leaf - first) as usize;
                let (slab, cell) = (tree.slabs[i], unmorton(codes[tree.po[i] as usize]));
                let centre = cell_centre(&tree.grid, tree.grid.level, half, cell);
                for _ in 0..20 {
                    let size = 0.01 * 500f32.powf(random.next());
                    let axes = turned_axes(&mut random).map(|axis| [0, 1, 2].map(|c| axis[c] * size * half[c]));
                    let x = [0, 1, 2].map(|c| centre[c] + (3.0 * random.next() - 1.5) * half[c]);
                    tried += 1;
                    if !SlabCell::new(&tree.grid, cell).is_box_outside(slab, x, &axes) {
                        continue;
                    }
                    told += 1;
                    for &t in tree.tets(leaf) {
                        let v = mesh.tets[t as usize].map(|id| [0, 1, 2].map(|c| vertices.normalised[id as usize][c] - x[c]));
                        let touches = box_touches(&v, &axes, touch_slack(&v, &axes));
                        assert!(!touches, "{name} level {level} leaf {leaf} tetrahedron {t} at {x:?} {axes:?}");
                    }
                }
            }
        }
    }
    assert!(told > 5_000 && told < tried, "{told} of {tried}");
}

#[test]
fn full_lists_have_none() {
    let (mesh, topology) = prepared(shell(8).unwrap());
    let tree = build(&mesh, &topology, &BuildOptions { slabs: true, lists: Lists::All, ..BuildOptions::default() }).unwrap();
    assert!(tree.slabs.is_empty() && tree.grid.slabs == 0 && tree.memory().slabs == 0);
}
