//! Meshes in the order of a Z curve, and answers over them.

use super::{Random, options, prepared};
use olbvh::grid::morton;
use olbvh::mesh::cases::cases;
use olbvh::mesh::{Field, Mesh, On, fault_of, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, Lists};
use olbvh::reference::boundary::Topology;
use olbvh::reference::build::build;
use olbvh::reference::locate::Locator;
use olbvh::reference::overlap::{OverlapSide, overlap};
use olbvh::tree::TreeArrays;

/// The mesh with its points and tetrahedra in random order, and fields that number them.
fn shuffled(mesh: Mesh, seed: u64) -> Mesh {
    let mut random = Random(seed);
    let mut order = |n: usize| {
        let mut order: Vec<u32> = (0..n as u32).collect();
        (1..n).for_each(|i| order.swap(i, random.below(i + 1)));
        order
    };
    let (points, tets) = (order(mesh.points.len()), order(mesh.tets.len()));
    let mut place = vec![0; points.len()];
    (0..).zip(&points).for_each(|(new, &old)| place[old as usize] = new);
    let field = |name: &str, on, n: usize| Field { name: name.into(), on, values: (0..n).map(|i| i as f32).collect() };
    let fields = vec![field("point", On::Points, points.len()), field("cell", On::Cells, tets.len())];
    let moved = |ids: [u32; 4]| ids.map(|v| place.get(v as usize).copied().unwrap_or(v));
    let tets = tets.iter().map(|&t| moved(mesh.tets[t as usize])).collect();
    Mesh { points: points.iter().map(|&p| mesh.points[p as usize]).collect(), tets, fields, cell_ids: None, ..mesh }
}

#[test]
fn every_mesh_comes_in_the_order_of_the_curve() {
    for case in cases().unwrap() {
        let name = case.name;
        let (source, topology) = prepared(shuffled(case.mesh, 5));
        let mesh = source.clone().along_curve().unwrap();
        let (points, cells) = (mesh.point_ids.clone().unwrap(), mesh.cell_ids.clone().unwrap());
        for (ids, n) in [(&points, source.points.len()), (&cells, source.tets.len())] {
            let mut all = ids.clone();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..n as u32), "{name}");
        }
        // Bits are compared, since there are NaN.
        let bits = |p: [f32; 3]| p.map(f32::to_bits);
        assert!(mesh.points.iter().zip(&points).all(|(&p, &old)| bits(p) == bits(source.points[old as usize])), "{name}");
        let named = |v: u32| points.get(v as usize).copied().unwrap_or(v);
        assert!(mesh.tets.iter().zip(&cells).all(|(ids, &old)| ids.map(named) == source.tets[old as usize]), "{name}");
        for (field, ids) in mesh.fields.iter().zip([&points, &cells]) {
            assert!(field.values.iter().zip(ids).all(|(&v, &id)| v as u32 == id), "{name} {}", field.name);
        }
        // Valid tetrahedra come first, along the curve; then the bad ones as they were, with the numbers that the
        // source gives to their points.
        let good = topology.valid_cells() as usize;
        let codes: Vec<u32> = mesh.tets[..good]
            .iter()
            .map(|ids| {
                let corners = ids.map(|v| mesh.points[v as usize]);
                morton(
                    topology.grid.quantize([0, 1, 2].map(|c| 0.25 * ((corners[0][c] + corners[1][c]) + (corners[2][c] + corners[3][c])))),
                )
            })
            .collect();
        assert!((1..good).all(|i| (codes[i - 1], cells[i - 1]) < (codes[i], cells[i])), "{name}");
        let bad: Vec<_> = (good as u32..).zip(&cells[good..]).map(|(t, &id)| (id, fault_of(&mesh, t).unwrap())).collect();
        assert_eq!(bad, topology.bad, "{name}");
        let again = mesh.clone().along_curve().unwrap();
        assert_eq!((again.tets, again.cell_ids), (mesh.tets, mesh.cell_ids), "{name}: nothing is left to do");
    }
    assert!(Mesh::default().along_curve().unwrap().tets.is_empty());
}

/// A mesh with its tree.
struct Built(Mesh, Topology, TreeArrays);

impl Built {
    fn new(mesh: Mesh, lists: Lists) -> Self {
        let (mesh, topology) = prepared(mesh);
        let tree = build(&mesh, &topology, &BuildOptions { lists, ..options(0.0, Assign::Aabb) }).unwrap();
        Self(mesh, topology, tree)
    }

    fn side(&self) -> OverlapSide<'_> {
        OverlapSide { mesh: &self.0, topology: &self.1, tree: &self.2 }
    }

    fn names(&self, tets: &[u32]) -> Vec<u32> {
        let mut names: Vec<u32> = tets.iter().map(|&t| self.0.cell_id(t)).collect();
        names.sort_unstable();
        names
    }
}

#[test]
fn answers_name_the_callers_cells() {
    // Five tetrahedra per file cell, as where hexahedra are split.
    let mut source = shuffled(kuhn_jittered([6, 5, 4], 0.3, 1).unwrap(), 3);
    source.cell_ids = Some((0..source.tets.len() as u32).map(|t| t / 5).collect());
    let mut other = kuhn_jittered([4; 3], 0.3, 2).unwrap();
    other.points.iter_mut().for_each(|p| *p = [p[0] + 1.3, p[1] + 0.7, p[2] - 1.1]);
    for lists in Lists::EVERY {
        let [given, sorted] = [source.clone(), source.clone().along_curve().unwrap()].map(|mesh| Built::new(mesh, lists));
        let locators = [&given, &sorted].map(|b| Locator::new(&b.0, &b.1, &b.2));
        let mut random = Random(7);
        for _ in 0..500 {
            let p = random.point(&given.0, &given.1, 4);
            let [a, b] = [0, 1].map(|i| locators[i].locate(p));
            assert_eq!(given.0.cell_id(a.owner), sorted.0.cell_id(b.owner), "{p:?}");
            // The vertices of a tetrahedron keep their order.
            assert!((0..4).all(|i| (a.barycentric[i] - b.barycentric[i]).abs() < 1e-4), "{a:?} {b:?}");
            for (i, built) in [&given, &sorted].into_iter().enumerate() {
                let value = [a, b][i].value(&built.0, &built.0.fields[1]);
                assert_eq!(value as u32 / 5, given.0.cell_id(a.owner));
            }
        }
        let other = Built::new(other.clone(), lists);
        let [a, b] = [&given, &sorted].map(|mine| {
            let found = overlap(mine.side(), other.side(), false);
            (mine.names(&found.a), found.b)
        });
        assert!(a == b && !a.0.is_empty() && !a.1.is_empty());
    }
}
