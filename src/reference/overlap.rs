//! Overlap of two meshes (SPEC 3.5): the tetrahedra of each mesh that intersect the other one, or all intersecting
//! pairs. Twin of `glsl/query/overlap_*`.
//!
//! Both meshes lie in one space, but each tree has a grid of its own. Geometry that involves both meshes is computed in
//! normalised coordinates of the [`joint_grid`] over both bounds.
//!
//! # Sets
//! The following steps are taken for each mesh in turn, which is called A here, and the other mesh B. All but the last
//! step decide by inference.
//! 1. A vertex of A in the cell of a non-boundary leaf of B lies in B. One in a boundary leaf is searched for in the
//!    leaf's list; the tetrahedron of B that contains it intersects A. A tetrahedron of A with a vertex in B intersects
//!    B.
//! 2. Each of the remaining tetrahedra whose box meets the bounds of B descends B's tree over the cells that its box
//!    meets. A tetrahedron that touches the box of a non-boundary node, enlarged by 2^18 (about 2^-22 of the joint
//!    bounds) on each side, intersects B. Nodes below such a node are not visited.
//! 3. Tetrahedra that are still undecided are tested by separating axes against the tetrahedra of boundary leaves, up
//!    to the first that touches (the narrow phase). With the assignment `Aabb` each pair is tested once, in the cell of
//!    the lower corner of the two boxes' intersection.
//!
//! All rounding errors are below 2^-21 of the joint bounds, so the result is uncertain only for pairs that are nearer
//! to touching than 1e-6 of the scene's diagonal.
//!
//! # Pairs
//! Pairs cannot be inferred. All pairs of tetrahedra whose boxes meet are tested; they are found through the cells of
//! B. The sets then consist of the tetrahedra that occur in pairs.

use super::boundary::Topology;
use super::leaf_walk::{meets, walk_leaves};
use super::separate::{box_touches, tets_touch};
use super::tet::{Tet, Vec3, sub};
use super::traverse::Node;
use crate::grid::{CellRange, Grid, MAX_LEVEL, canonical, per_axis, two_to, unmorton};
use crate::layout::{NodeFrame, bit};
use crate::mesh::Mesh;
use crate::options::Assign;
use crate::tree::TreeArrays;
use rayon::prelude::*;

/// A mesh with its topology and tree.
#[derive(Clone, Copy)]
pub struct OverlapSide<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Its topology.
    pub topology: &'a Topology,
    /// Its tree.
    pub tree: &'a TreeArrays,
}

/// The effort of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Tetrahedra with a vertex in the other mesh, or around one of its vertices.
    pub by_vertex: u32,
    /// Tetrahedra that touch a non-boundary node of the other tree.
    pub by_node: u32,
    /// Tetrahedra that needed a search in the other tree.
    pub searched: u32,
    /// Vertices that were searched for in the list of a leaf.
    pub located: u32,
    /// Tests of two tetrahedra by separating axes.
    pub narrow: u64,
}

/// Which tetrahedra of each mesh intersect the other mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlap {
    /// Tetrahedra of A that intersect B, ascending.
    pub a: Vec<u32>,
    /// Tetrahedra of B that intersect A, ascending.
    pub b: Vec<u32>,
    /// Intersecting pairs, if requested, ascending by A, then by B.
    pub pairs: Option<Vec<[u32; 2]>>,
    /// The effort of A against B, then of B against A.
    pub effort: [Effort; 2],
}

/// The grid over the bounds of both meshes. A mesh without valid tetrahedra does not count.
pub fn joint_grid(a: &Grid, b: &Grid, valid: [bool; 2]) -> Grid {
    let three = |v: [f32; 4]| [v[0], v[1], v[2]];
    match valid {
        [true, false] => Grid::new(three(a.lo), three(a.hi)),
        [false, _] => Grid::new(three(b.lo), three(b.hi)),
        [true, true] => {
            let lo = per_axis(|c| a.lo[c].min(b.lo[c]));
            Grid::new(lo, per_axis(|c| a.hi[c].max(b.hi[c])))
        }
    }
}

/// The cells of the tree with grid `grid`, in normalised coordinates of the joint grid.
pub(crate) fn node_frame(grid: &Grid, joint: &Grid) -> NodeFrame {
    let corner = joint.normalise([grid.lo[0], grid.lo[1], grid.lo[2]]);
    let half = per_axis(|c| (canonical(grid.hi[c] - grid.lo[c]) * joint.scale) * two_to(39));
    let flat = per_axis(|c| if grid.inv[c] == 0.0 { 1.0 } else { 0.0 });
    let pad = |v: [f32; 3]| [v[0], v[1], v[2], 0.0];
    NodeFrame {
        corner: pad(corner),
        half_size: pad(half),
        flat_axis: pad(flat),
        joint_lo: joint.lo,
        scale: joint.scale,
        ..NodeFrame::default()
    }
}

/// Centre and half size of the box of a node, the half size with the allowance of step 2.
fn node_box(grid: &Grid, frame: &NodeFrame, node: Node) -> (Vec3, Vec3) {
    let cell = unmorton(node.code);
    let half = per_axis(|c| if frame.flat_axis[c] == 0.0 { frame.half_size[c] * two_to(-(node.level as i32)) } else { frame.half_size[c] });
    let mut away = per_axis(|c| (2 * cell[c] + 1) as f32 * half[c]);
    let mut half = half;
    for c in (0..3).filter(|&c| grid.graded != 0 && frame.flat_axis[c] == 0.0) {
        let [lower, upper] = [cell[c], cell[c] + 1].map(|k| grid.graded_side(c, k << (MAX_LEVEL - node.level)));
        let unit = frame.scale * two_to(39);
        (half[c], away[c]) = ((upper - lower) * unit, (upper + lower) * unit);
    }
    let centre = per_axis(|c| ((frame.corner[c] + away[c]) * two_to(42)).floor() * two_to(-42));
    (centre, half.map(|h| h + two_to(18)))
}

/// Closed bounding box of a tetrahedron in the units of the mesh.
fn raw_box(mesh: &Mesh, t: u32) -> (Vec3, Vec3) {
    let v = mesh.tets[t as usize].map(|i| mesh.points[i as usize].map(canonical));
    let fold = |pick: fn(f32, f32) -> f32| per_axis(|c| pick(pick(v[0][c], v[1][c]), pick(v[2][c], v[3][c])));
    (fold(f32::min), fold(f32::max))
}

fn boxes_meet(a: &(Vec3, Vec3), b: &(Vec3, Vec3)) -> bool {
    (0..3).all(|c| a.0[c] <= b.1[c] && b.0[c] <= a.1[c])
}

/// One direction: the tetrahedra of `own` against the tree of `other`.
struct Direction<'a> {
    own: OverlapSide<'a>,
    other: OverlapSide<'a>,
    own_joint: &'a [Vec3],
    other_joint: &'a [Vec3],
    frame: NodeFrame,
}

/// Where a vertex lies relative to the other mesh; the tetrahedron is known only if a list was searched.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Outside,
    Inside,
    In(u32),
}

impl Direction<'_> {
    /// The place of a vertex, and whether a list was searched for it.
    fn place(&self, point: [f32; 3], other_normalised: &[Vec3]) -> (Place, bool) {
        let grid = &self.other.tree.grid;
        let p = point.map(canonical);
        if !(0..3).all(|c| grid.lo[c] <= p[c] && p[c] <= grid.hi[c]) {
            return (Place::Outside, false);
        }
        let tree = self.other.tree;
        match tree.find_leaf(grid.quantize(p)) {
            None => (Place::Outside, false),
            Some(leaf) if !tree.is_boundary(leaf) && !tree.p.is_empty() => (Place::Inside, false),
            Some(leaf) => {
                let x = grid.normalise(p);
                let holds = |&&t: &&u32| Tet::new(self.other.mesh.tets[t as usize], other_normalised).weights(x).inside;
                (tree.tets(leaf).iter().find(holds).map_or(Place::Outside, |&t| Place::In(t)), true)
            }
        }
    }

    fn own_tet(&self, t: u32) -> [Vec3; 4] {
        Tet::new(self.own.mesh.tets[t as usize], self.own_joint).v
    }

    fn other_tet(&self, t: u32) -> [Vec3; 4] {
        Tet::new(self.other.mesh.tets[t as usize], self.other_joint).v
    }

    /// The finest cells of the other grid that a box meets.
    fn cells(&self, bounds: &(Vec3, Vec3)) -> CellRange {
        CellRange { lo: self.other.tree.grid.quantize(bounds.0), hi: self.other.tree.grid.quantize(bounds.1) }
    }

    /// Whether tetrahedra with these boxes are compared in that leaf.
    fn compared_in(&self, leaf: Node, own: &(Vec3, Vec3), other: &(Vec3, Vec3)) -> bool {
        if !boxes_meet(own, other) {
            return false;
        }
        if self.other.tree.assign != Assign::Aabb {
            return true;
        }
        let corner = per_axis(|c| own.0[c].max(other.0[c]));
        self.other.tree.grid.quantize(corner).map(|q| q >> (MAX_LEVEL - leaf.level)) == unmorton(leaf.code)
    }

    /// Steps 2 and 3: whether tetrahedron `t` intersects the other mesh.
    fn search(&self, t: u32, effort: &mut Effort) -> bool {
        let (bounds, v) = (raw_box(self.own.mesh, t), self.own_tet(t));
        let (cells, tree) = (self.cells(&bounds), self.other.tree);
        let mut found = false;
        let inner = |node: Node| {
            if found || !meets(node, &cells) {
                return false;
            }
            if tree.is_boundary(node.index) {
                return node.level < tree.grid.level;
            }
            let (centre, h) = node_box(&tree.grid, &self.frame, node);
            let half = [[h[0], 0.0, 0.0], [0.0, h[1], 0.0], [0.0, 0.0, h[2]]];
            found = box_touches(&v.map(|p| sub(p, centre)), &half, [0.0; 3]);
            false
        };
        walk_leaves(tree, inner, |_| false);
        if found {
            effort.by_node += 1;
            return true;
        }
        walk_leaves(
            tree,
            |node| tree.is_boundary(node.index) && meets(node, &cells),
            |leaf| {
                let touches = |&&b: &&u32| {
                    let compared = self.compared_in(leaf, &bounds, &raw_box(self.other.mesh, b));
                    effort.narrow += u64::from(compared);
                    compared && tets_touch(&v, &self.other_tet(b))
                };
                found = tree.tets(leaf.index).iter().find(touches).is_some();
                found
            },
        );
        found
    }

    /// All tetrahedra of the other mesh that touch tetrahedron `t`, ascending.
    fn partners(&self, t: u32, effort: &mut Effort) -> Vec<u32> {
        let (bounds, v) = (raw_box(self.own.mesh, t), self.own_tet(t));
        let (cells, tree) = (self.cells(&bounds), self.other.tree);
        let mut partners = Vec::new();
        walk_leaves(
            tree,
            |node| meets(node, &cells),
            |leaf| {
                for &b in tree.tets(leaf.index) {
                    if self.compared_in(leaf, &bounds, &raw_box(self.other.mesh, b)) {
                        effort.narrow += 1;
                        if tets_touch(&v, &self.other_tet(b)) {
                            partners.push(b);
                        }
                    }
                }
                false
            },
        );
        partners.sort_unstable();
        partners.dedup();
        partners
    }

    fn bounds_meet(&self, t: u32) -> bool {
        let grid = &self.other.tree.grid;
        let three = |v: [f32; 4]| [v[0], v[1], v[2]];
        boxes_meet(&raw_box(self.own.mesh, t), &(three(grid.lo), three(grid.hi)))
    }
}

/// Step 1 of one direction: the places of the vertices that valid tetrahedra use.
fn places(direction: &Direction, effort: &mut Effort) -> Vec<Place> {
    let OverlapSide { mesh, topology, .. } = direction.own;
    let mut used = vec![false; mesh.points.len()];
    for (t, ids) in (0..).zip(&mesh.tets) {
        if topology.is_valid(t) {
            for &v in ids {
                used[v as usize] = true;
            }
        }
    }
    let normalised: Vec<Vec3> = direction.other.mesh.points.par_iter().map(|&p| direction.other.tree.grid.normalise(p)).collect();
    let place = |(&p, &used): (&[f32; 3], &bool)| if used { direction.place(p, &normalised) } else { (Place::Outside, false) };
    let places: Vec<(Place, bool)> = mesh.points.par_iter().zip(&used).map(place).collect();
    effort.located = places.iter().filter(|p| p.1).count() as u32;
    places.into_iter().map(|p| p.0).collect()
}

/// Steps 1 to 3 of one direction. `around` has a bit for each tetrahedron of `own` that contains a vertex of the other
/// mesh.
fn sets(direction: &Direction, places: &[Place], around: &[u32], effort: &mut Effort) -> Vec<u32> {
    let OverlapSide { mesh, topology, .. } = direction.own;
    let one = |t: u32| {
        let mut effort = Effort::default();
        if !topology.is_valid(t) {
            return (false, effort);
        }
        let ids = mesh.tets[t as usize];
        if bit(around, t) || ids.iter().any(|&v| places[v as usize] != Place::Outside) {
            effort.by_vertex = 1;
            return (true, effort);
        }
        if !direction.bounds_meet(t) {
            return (false, effort);
        }
        effort.searched = 1;
        (direction.search(t, &mut effort), effort)
    };
    let answers: Vec<(bool, Effort)> = (0..mesh.tets.len() as u32).into_par_iter().map(one).collect();
    for (_, e) in &answers {
        effort.add(e);
    }
    (0..).zip(&answers).filter(|(_, answer)| answer.0).map(|(t, _)| t).collect()
}

impl Effort {
    /// Adds the counts of `other`.
    pub(crate) fn add(&mut self, other: &Self) {
        // A tetrahedron counts in every pair of blocks that it is in.
        self.by_vertex = self.by_vertex.saturating_add(other.by_vertex);
        self.by_node = self.by_node.saturating_add(other.by_node);
        self.searched = self.searched.saturating_add(other.searched);
        self.located = self.located.saturating_add(other.located);
        self.narrow += other.narrow;
    }
}

/// Overlap of A and B, with all pairs if `pairs` is true. The trees must have been built over these meshes, and that of
/// B with `Lists::All` if pairs are requested.
pub fn overlap(a: OverlapSide, b: OverlapSide, pairs: bool) -> Overlap {
    let mut overlap = Overlap { pairs: pairs.then(Vec::new), ..Overlap::default() };
    let valid = [a, b].map(|s| s.topology.valid_cells() > 0);
    if valid.contains(&false) {
        return overlap;
    }
    let joint = joint_grid(&a.tree.grid, &b.tree.grid, valid);
    let [in_a, in_b] = [a, b].map(|s| s.mesh.points.par_iter().map(|&p| joint.normalise(p)).collect::<Vec<Vec3>>());
    let forth = Direction { own: a, other: b, own_joint: &in_a, other_joint: &in_b, frame: node_frame(&b.tree.grid, &joint) };
    let back = Direction { own: b, other: a, own_joint: &in_b, other_joint: &in_a, frame: node_frame(&a.tree.grid, &joint) };
    if pairs {
        let one = |t: u32| {
            let mut effort = Effort::default();
            let of = if a.topology.is_valid(t) && forth.bounds_meet(t) { forth.partners(t, &mut effort) } else { Vec::new() };
            (of, effort)
        };
        let found: Vec<(Vec<u32>, Effort)> = (0..a.mesh.tets.len() as u32).into_par_iter().map(one).collect();
        for (_, effort) in &found {
            overlap.effort[0].add(effort);
        }
        let all: Vec<[u32; 2]> = (0..).zip(&found).flat_map(|(t, (of, _))| of.iter().map(move |&b| [t, b])).collect();
        (overlap.a, overlap.b) = members(&all);
        overlap.pairs = Some(all);
        return overlap;
    }
    let [mut effort_a, mut effort_b] = overlap.effort;
    let (places_a, places_b) = (places(&forth, &mut effort_a), places(&back, &mut effort_b));
    let around = |places: &[Place], tets: usize| {
        let mut bits = vec![0u32; tets.div_ceil(32)];
        for place in places {
            if let Place::In(t) = place {
                bits[(t / 32) as usize] |= 1 << (t % 32);
            }
        }
        bits
    };
    let (around_a, around_b) = (around(&places_b, a.mesh.tets.len()), around(&places_a, b.mesh.tets.len()));
    overlap.a = sets(&forth, &places_a, &around_a, &mut effort_a);
    overlap.b = sets(&back, &places_b, &around_b, &mut effort_b);
    overlap.effort = [effort_a, effort_b];
    overlap
}

/// The tetrahedra of A, and those of B, that occur in pairs, ascending and each once.
pub fn members(pairs: &[[u32; 2]]) -> (Vec<u32>, Vec<u32>) {
    let of = |side: usize| {
        let mut ids: Vec<u32> = pairs.iter().map(|p| p[side]).collect();
        ids.par_sort_unstable();
        ids.dedup();
        ids
    };
    (of(0), of(1))
}
