//! The assignments `Planes` and `Exact`: no cell that a tetrahedron touches is dropped, and few others are kept.

use super::{Random, prepared};
use olbvh::grid::{Grid, MAX_LEVEL};
use olbvh::mesh::cases::cases;
use olbvh::mesh::{Mesh, kuhn_jittered};
use olbvh::options::Assign;
use olbvh::reference::assign::{Filter, cell_centre, half_cell};
use olbvh::reference::boundary::Topology;
use olbvh::reference::vertices::Vertices;

/// Whether a tetrahedron and a box touch, in double precision without any allowance but `margin` (relative to the
/// products).
fn touches_exactly(v: [[f64; 3]; 4], centre: [f64; 3], half: [f64; 3], edges: bool, margin: f64) -> bool {
    let sub = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let cross = |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // Whether the axis separates them. The normal of a face separates only on its outer side.
    let apart = |axis: [f64; 3], both: bool, opposite: usize| {
        let t = v.map(|p| dot(axis, sub(p, centre)));
        let r = dot(axis.map(f64::abs), half);
        let (lo, hi) = (t.into_iter().fold(f64::INFINITY, f64::min), t.into_iter().fold(f64::NEG_INFINITY, f64::max));
        let allow = margin * (r + hi.abs().max(lo.abs()));
        let (above, below) = (lo > r + allow, hi < -r - allow);
        if both {
            above || below
        } else if t[opposite] > (lo + hi) * 0.5 {
            above
        } else {
            below
        }
    };
    let faces = [[0, 1, 2, 3], [0, 1, 3, 2], [0, 2, 3, 1], [1, 2, 3, 0]];
    let mut separated = faces.iter().any(|&[p, q, r, o]| apart(cross(sub(v[q], v[p]), sub(v[r], v[p])), false, o));
    for (p, q) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
        for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            separated |= edges && apart(cross(sub(v[q], v[p]), axis), true, 0);
        }
    }
    !separated
}

struct Stage {
    mesh: Mesh,
    topology: Topology,
    vertices: Vertices,
}

impl Stage {
    fn new(mesh: Mesh) -> Self {
        let (mesh, topology) = prepared(mesh);
        let vertices = Vertices::new(&mesh, &topology.grid);
        Self { mesh, topology, vertices }
    }

    fn grid(&self) -> &Grid {
        &self.topology.grid
    }

    /// The numbers of candidates of all tetrahedra, of those kept, and of those that touch without any allowance.
    fn compare(&self, level: u32, assign: Assign) -> [u64; 3] {
        let mut n = [0; 3];
        for &ids in self.mesh.tets.iter().enumerate().filter(|t| self.topology.is_valid(t.0 as u32)).map(|t| t.1) {
            let tet = self.vertices.tet(ids);
            for cell in self.vertices.cells(ids, level).iter() {
                let h = half_cell(self.grid(), level, cell);
                let filter = Filter::new(&tet, self.grid(), h, assign);
                let centre = cell_centre(self.grid(), level, h, cell);
                let exact = |margin| {
                    touches_exactly(
                        tet.v.map(|p| p.map(f64::from)),
                        centre.map(f64::from),
                        h.map(f64::from),
                        assign == Assign::Exact,
                        margin,
                    )
                };
                let kept = filter.touches(centre);
                n[0] += 1;
                n[1] += u64::from(kept);
                n[2] += u64::from(exact(0.0));
                assert!(kept || !exact(-1e-9), "{ids:?} loses cell {cell:?} of level {level} under {assign}");
            }
        }
        n
    }
}

#[test]
fn no_touched_cell_is_dropped_and_few_others_are_kept() {
    let stage = Stage::new(kuhn_jittered([10; 3], 0.3, 4).unwrap());
    for assign in [Assign::Planes, Assign::Exact] {
        for level in [1, 3, 4, 5] {
            let [candidates, kept, exact] = stage.compare(level, assign);
            println!("{assign} level {level}: {candidates} candidates, {kept} kept, {exact} without allowance");
            assert!(exact <= kept && kept <= candidates);
            assert!(((kept - exact) as f64) < 1e-3 * exact as f64, "{assign} level {level}: {kept} instead of {exact}");
        }
    }
}

#[test]
fn no_touched_cell_is_dropped_in_strange_meshes() {
    for case in cases().unwrap().into_iter().filter(|c| c.name != "identical-1000" && c.name != "point") {
        let stage = Stage::new(case.mesh);
        for assign in [Assign::Planes, Assign::Exact] {
            for level in [0, 2, 4] {
                stage.compare(level, assign);
            }
        }
    }
}

/// The second promise: a tetrahedron keeps the cell of every point that floating point puts inside it.
#[test]
fn no_cell_with_a_point_inside_is_dropped() {
    let mut random = Random(3);
    for case in cases().unwrap() {
        let stage = Stage::new(case.mesh);
        if stage.topology.valid_cells() == 0 {
            continue;
        }
        for i in 0..4000 {
            let p = random.point(&stage.mesh, &stage.topology, 1 + i % 4);
            let (cell, x) = (stage.grid().quantize(p), stage.grid().normalise(p));
            // Random tetrahedra, which may contain the point as well.
            for _ in 0..8 {
                let t = random.below(stage.mesh.tets.len());
                check_point(&stage, t, cell, x, case.name);
            }
            if stage.mesh.tets.len() < 400 {
                (0..stage.mesh.tets.len()).for_each(|t| check_point(&stage, t, cell, x, case.name));
            }
        }
    }
}

fn check_point(stage: &Stage, t: usize, cell: [u32; 3], x: [f32; 3], name: &str) {
    if !stage.topology.is_valid(t as u32) {
        return;
    }
    let ids = stage.mesh.tets[t];
    let tet = stage.vertices.tet(ids);
    if !tet.weights(x).inside {
        return;
    }
    for level in 0..=MAX_LEVEL {
        let cell = cell.map(|q| q >> (MAX_LEVEL - level));
        assert!(stage.vertices.cells(ids, level).contains(cell), "{name}: cell {cell:?} of level {level} is no candidate of {ids:?}");
        for assign in Assign::EVERY {
            let h = half_cell(stage.grid(), level, cell);
            let kept = Filter::new(&tet, stage.grid(), h, assign).touches(cell_centre(stage.grid(), level, h, cell));
            assert!(kept, "{name}: {ids:?} loses cell {cell:?} of level {level} under {assign}, which holds {x:?}");
        }
    }
}

/// Slivers of every thinness and orientation: points that rounding puts inside spread far along them.
#[test]
fn no_cell_with_a_point_inside_a_sliver_is_dropped() {
    let mut random = Random(5);
    let mut inside = 0;
    for round in 0..3000 {
        let thin = 0.5f32.powi(round % 24);
        let mut axis = || [0, 1, 2].map(|_| random.next() - 0.5);
        let (o, u, v, w) = (axis(), axis(), axis(), axis());
        let kind = round / 24 % 3;
        let corner = |a: f32, b: f32, c: f32| [0, 1, 2].map(|k| o[k] + a * u[k] + b * v[k] + c * thin * w[k]);
        let points = match kind {
            0 => vec![corner(0.0, 0.0, 0.0), corner(1.0, 0.0, 1.0), corner(0.0, 1.0, 1.0), corner(1.0, 1.0, 0.0)],
            1 => vec![corner(0.0, 0.0, 0.0), corner(1.0, 0.0, 0.0), corner(0.0, 1.0, 0.0), corner(0.3, 0.3, 1.0)],
            _ => vec![corner(0.0, 0.0, 0.0), corner(1.0, 0.0, 0.0), corner(1.0, thin, 0.0), corner(1.0, 0.0, 1.0)],
        };
        // A second tetrahedron widens the grid.
        let wide = [[-2.0, -2.0, -2.0], [2.0, -2.0, -2.0], [-2.0, 2.0, -2.0], [-2.0, -2.0, 2.0]];
        let stage = Stage::new(Mesh::new(points.into_iter().chain(wide).collect(), vec![[0, 1, 2, 3], [4, 5, 6, 7]]));
        let tet = stage.vertices.tet([0, 1, 2, 3]);
        for i in 0..200 {
            let w = random.weights(1 + i % 4);
            let push = if i < 100 { 0.0 } else { 1e-6 };
            let p = [0, 1, 2].map(|c| (0..4).map(|k| w[k] * stage.mesh.points[k][c]).sum::<f32>() + push * (random.next() - 0.5));
            let x = stage.grid().normalise(p);
            inside += u32::from(tet.weights(x).inside);
            check_point(&stage, 0, stage.grid().quantize(p), x, "sliver");
        }
    }
    assert!(inside > 50_000, "only {inside} points were inside");
}

#[test]
fn candidates_are_numbered_x_fastest() {
    let stage = Stage::new(kuhn_jittered([3; 3], 0.2, 4).unwrap());
    for &ids in &stage.mesh.tets {
        let cells = stage.vertices.cells(ids, 5);
        let listed: Vec<_> = cells.iter().collect();
        assert_eq!(listed, (0..cells.count()).map(|i| cells.cell(i)).collect::<Vec<_>>());
    }
}
