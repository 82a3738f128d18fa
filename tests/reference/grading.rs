//! Graded grids: which meshes have one, that quantization keeps to the sides of cells, and that trees stay small.

use super::{Random, prepared};
use olbvh::grid::{CellRange, Grid, MAX_LEVEL, STRETCHES};
use olbvh::mesh::{Mesh, far_field, graded, kuhn, kuhn_jittered, shell, slivers, valid_grid};
use olbvh::options::{BuildOptions, Fineness, Lists};
use olbvh::reference::boundary::Topology;
use olbvh::reference::brute;
use olbvh::reference::build::build;
use olbvh::reference::leaves::{cell_side, longest_list};
use olbvh::reference::locate::Locator;
use olbvh::reference::vertices::Vertices;

#[test]
fn only_steep_meshes_have_one() {
    for mesh in [kuhn([1; 3]), kuhn([17, 1, 3]), kuhn_jittered([9, 8, 7], 0.4, 1), shell(20), slivers(9), graded(6), graded(20)] {
        assert_eq!(valid_grid(&mesh.unwrap()).graded, 0);
    }
    let mesh = far_field(16).unwrap();
    let grid = valid_grid(&mesh);
    assert_eq!(grid.graded, 1);
    // Neither bad tetrahedra nor the number of the others change that.
    let bad: Vec<_> = mesh.tets.chunks(7).flat_map(|some| [some, &[[some[0][0]; 4]]].concat()).collect();
    assert_eq!(valid_grid(&Mesh::new(mesh.points.clone(), bad)).graded, 1);
    let few = Mesh::new(mesh.points.clone(), mesh.tets.iter().copied().step_by(500).collect());
    assert!(few.tets.len() < 100 && valid_grid(&few).graded == 1);
    assert_eq!(valid_grid(&Mesh::new(mesh.points, vec![[0; 4]; 9])).graded, 0);
}

/// One axis of this mesh has tetrahedra of very different sizes, another one none at all.
fn long_channel() -> Mesh {
    let mut mesh = kuhn_jittered([60, 5, 1], 0.2, 8).unwrap();
    mesh.points.iter_mut().for_each(|p| *p = [1.3f32.powf(p[0]) - 7.0, 3e3 * p[1], 5.0]);
    mesh
}

#[test]
fn quantization_keeps_to_the_sides_of_cells() {
    let mut random = Random(4);
    for mesh in [far_field(16).unwrap(), long_channel()] {
        let grid = valid_grid(&mesh);
        assert_eq!(grid.graded, 1);
        for c in 0..3 {
            let extent = grid.hi[c] - grid.lo[c];
            let mut places: Vec<f32> = (0..20_000).map(|i| extent * random.next().powi(1 + i % 20)).collect();
            places.extend((0..=1024).map(|k| grid.graded_side(c, k)).flat_map(|x| [x.next_down(), x, x.next_up()]));
            places.retain(|&x| x >= 0.0 && x <= extent);
            places.sort_by(f32::total_cmp);
            let cells: Vec<u32> = places.iter().map(|&x| (grid.in_cells(c, x) as u32).min(1023)).collect();
            assert!(cells.is_sorted() && places.iter().all(|&x| (0.0..=1024.0).contains(&grid.in_cells(c, x))));
            if extent == 0.0 {
                assert!(cells.iter().all(|&k| k == 0));
                continue;
            }
            assert!(cells[0] == 0 && cells[cells.len() - 1] == 1023);
            let [mut below, mut above] = [0.0f32; 2];
            for (&x, &k) in places.iter().zip(&cells) {
                below = below.max(grid.graded_side(c, k) - x);
                above = above.max(x - grid.graded_side(c, k + 1));
            }
            let most = extent * (0.5f32).powi(20);
            assert!(below < most && above < most, "{below} {above} of {most}");
            assert!((0..1024).all(|k| grid.graded_side(c, k) < grid.graded_side(c, k + 1)));
            assert!((0..STRETCHES as usize).all(|j| grid.knots[j + 1][c] - grid.knots[j][c] > extent / 1100.0));
            for level in 0..=MAX_LEVEL {
                assert_eq!([cell_side(&grid, c, level, 0), cell_side(&grid, c, level, 1 << level)], [grid.lo[c], grid.hi[c]]);
            }
        }
    }
}

/// The same topology with a grid of cells of equal size.
fn even(topology: &Topology) -> Topology {
    let [lo, hi] = [topology.grid.lo, topology.grid.hi].map(|[x, y, z, _]| [x, y, z]);
    Topology { grid: Grid::new(lo, hi), ..topology.clone() }
}

/// Owners are those of brute force, with lists of all tetrahedra and of those at the surface.
#[test]
fn owners_are_those_of_any_other_grid() {
    let (mesh, topology) = prepared(far_field(8).unwrap());
    let normalised = Vertices::new(&mesh, &topology.grid).normalised;
    let mut random = Random(6);
    let points: Vec<_> = (0..2000).map(|i| random.point(&mesh, &topology, 1 + i % 4)).collect();
    let owners: Vec<_> = points.iter().map(|&p| brute::owners(&mesh, &topology, &normalised, p)).collect();
    let uneven = even(&topology);
    for lists in Lists::EVERY {
        for level in [0, 2, 4, 6] {
            let options = BuildOptions { lists, level: Some(level), ..BuildOptions::default() };
            for topology in [&topology, &uneven] {
                let tree = build(&mesh, topology, &options).unwrap();
                tree.validate(&mesh, topology).unwrap();
                let locator = Locator::new(&mesh, topology, &tree);
                for (&p, owners) in points.iter().zip(&owners).filter(|(_, owners)| !owners.is_empty()) {
                    assert_eq!(locator.locate(p).owner, owners[0], "{lists} level {level} {p:?}");
                }
            }
        }
    }
}

#[test]
fn lists_stay_short() {
    let (mesh, topology) = prepared(far_field(24).unwrap());
    let options = BuildOptions { fineness: Fineness::Points, ..BuildOptions::default() };
    let [longest, even] = [&topology, &even(&topology)].map(|topology| {
        let tree = build(&mesh, topology, &options).unwrap();
        tree.validate(&mesh, topology).unwrap();
        longest_list(&tree.po)
    });
    assert!(longest < 1000 && even > 5 * longest, "{longest} {even} of {}", mesh.tets.len());
    assert!(CellRange::WHOLE.contains(topology.grid.quantize([0.0; 3])));
}
