//! Point location by lists and by walks: every point of the mesh has one owner (SPEC 3.1). Twin of `glsl/query/locate`.

use super::assign::{cell_centre, half_cell};
use super::best_owner::Best;
use super::boundary::Topology;
use super::quarters::{is_near, leaves_room, reach};
use super::slabs::SlabCell;
use super::tet::{Tet, Vec3, Weights};
use super::traverse::{Node, traverse_leaves};
use super::vertices::Vertices;
use super::walk::{HINTED, LeafCell, STRIDE, Walked, Walker, weighed};
use crate::grid::{Grid, MAX_LEVEL, canonical, morton, two_to};
use crate::layout::NONE;
use crate::mesh::{Field, Mesh, On};
use crate::options::{LIST_PART, Lists, POINT_CODE_BITS, POINT_RUN, TOLERANCE};
use crate::tree::TreeArrays;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// The order of points along the Morton curve, as [`crate::query::cmd_sort_points`] computes it with this many leading
/// bits of the code, at most [`POINT_CODE_BITS`]. Points too far outside the bounds for any mesh come last.
pub fn order_of(grid: &Grid, points: &[[f32; 3]], bits: u32) -> Vec<u32> {
    let bits = bits.min(POINT_CODE_BITS);
    let code = |p: [f32; 3]| place(grid, p).map_or(NONE, |(cell, _)| morton(cell)) >> (3 * MAX_LEVEL - bits) & ((1 << bits) - 1);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_by_cached_key(|&i| code(points[i as usize]));
    order
}

/// The owner of a point, and the point's place in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Location {
    /// The tetrahedron that owns the point, or [`NONE`].
    pub owner: u32,
    /// Barycentric coordinates in the caller's order of the owner's vertices; all 0 without an owner.
    pub barycentric: [f32; 4],
}

impl Location {
    /// No owner.
    pub const NOWHERE: Self = Self { owner: NONE, barycentric: [0.0; 4] };

    /// The owner, if there is one.
    pub fn found(&self) -> Option<u32> {
        (self.owner != NONE).then_some(self.owner)
    }

    /// The value here of a field of `mesh`: interpolated by [`weighed`] over the owner's vertices in the caller's order,
    /// or the owner's value if the field has values per tetrahedron. NaN without an owner, or if the field is too short.
    pub fn value(&self, mesh: &Mesh, field: &Field) -> f32 {
        let at = |i: u32| field.values.get(i as usize).copied().unwrap_or(f32::NAN);
        match (field.on, mesh.tets.get(self.owner as usize)) {
            (_, None) => f32::NAN,
            (On::Points, Some(ids)) => weighed(self.barycentric, ids.map(at)),
            (On::Cells, _) => at(self.owner),
        }
    }
}

/// The finest cell of a point and its normalised coordinates. `None` if no mesh can be there: a coordinate is NaN or
/// infinite, or `(p − lo)·scale` is not in [−1, 3] (the bounds reach from 0 to less than 2). Points just outside the
/// bounds belong to the nearest cell.
pub fn place(grid: &Grid, p: [f32; 3]) -> Option<([u32; 3], Vec3)> {
    let near = |c: usize| (-1.0..=3.0).contains(&(canonical(canonical(p[c]) - grid.lo[c]) * grid.scale));
    (near(0) && near(1) && near(2)).then(|| (grid.quantize(p), grid.normalise(p)))
}

/// Answers point queries about one mesh and its (valid) tree.
#[derive(Clone, Debug)]
pub struct Locator<'a> {
    mesh: &'a Mesh,
    tree: &'a TreeArrays,
    neighbours: &'a [[u32; 4]],
    vertices: Vertices,
    tolerance: f32,
}

impl<'a> Locator<'a> {
    /// Prepares queries with the default tolerance. `topology` and `tree` must be those of `mesh`.
    pub fn new(mesh: &'a Mesh, topology: &'a Topology, tree: &'a TreeArrays) -> Self {
        Self { mesh, tree, neighbours: &topology.neighbours, vertices: Vertices::new(mesh, &tree.grid), tolerance: TOLERANCE }
    }

    /// Replaces the tolerance (see [`TOLERANCE`]).
    #[must_use]
    pub fn with_tolerance(self, tolerance: f32) -> Self {
        Self { tolerance, ..self }
    }

    /// As [`place`]. `None` also for a point that is farther outside of the bounds than it can be from its owner: by 3 t times
    /// their size, with tolerance t, and what rounding adds. Farther away, the weights of a small tetrahedron are nothing but
    /// rounding.
    fn place_in_reach(&self, p: [f32; 3]) -> Option<([u32; 3], Vec3)> {
        let (cell, x) = place(&self.tree.grid, p)?;
        let grow = self.tolerance.min(1e10) * 3.0 + two_to(-16);
        let in_reach = |c: usize| {
            let extent = self.tree.grid.extent[c];
            let beyond = extent * grow;
            x[c] >= -beyond && x[c] <= extent + beyond
        };
        (0..3).all(in_reach).then_some((cell, x))
    }

    /// The owner of `p`: of the tetrahedra listed in the point's leaf, the lowest id that contains it. If none does,
    /// the nearest one owns it: preferably one whose box contains the point, then the one with the largest smallest
    /// barycentric coordinate, then the lowest id, but never a flat tetrahedron; in a boundary leaf only if that
    /// coordinate is at least −tolerance. In a leaf without list (SPEC 2.6) a walk finds the same owner.
    pub fn locate(&self, p: [f32; 3]) -> Location {
        let Some((cell, x)) = self.place_in_reach(p) else { return Location::NOWHERE };
        self.tree.find_leaf(cell).map_or(Location::NOWHERE, |leaf| self.in_leaf(leaf, cell, x))
    }

    /// As [`Locator::locate`], but first takes a few steps from `hint` (any number, such as the owner of the last
    /// point) towards the point. If they reach a tetrahedron that clearly contains the point, or one of two that share
    /// a face near the point, that one is the result. In a mesh whose tetrahedra do not overlap it is the owner that
    /// [`Locator::locate`] finds.
    pub fn locate_near(&self, p: [f32; 3], hint: u32) -> Location {
        self.stride_to(p, hint, HINTED).unwrap_or_else(|| self.locate(p))
    }

    /// Locates points in runs of [`POINT_RUN`] along `order`, in which every point occurs once, each with the owner of
    /// the one before as its hint. There is no hint if that owner was searched for in a list longer than [`LIST_PART`].
    pub fn locate_in_runs(&self, points: &[[f32; 3]], order: &[u32]) -> Vec<Location> {
        let run = |places: &[u32]| {
            let mut hint = NONE;
            let next = |&i: &u32| {
                let p = points[i as usize];
                let near = self.stride_to(p, hint, HINTED);
                let location = near.unwrap_or_else(|| self.locate(p));
                hint = if near.is_none() && self.searches_long_list(p) { NONE } else { location.owner };
                (i, location)
            };
            places.iter().map(next).collect::<Vec<_>>()
        };
        let mut located = vec![Location::NOWHERE; points.len()];
        for (i, location) in order.par_chunks(POINT_RUN as usize).flat_map_iter(run).collect::<Vec<_>>() {
            located[i as usize] = location;
        }
        located
    }

    /// Whether [`Locator::locate`] searches for a point in a list that takes more than one dispatch.
    fn searches_long_list(&self, p: [f32; 3]) -> bool {
        let leaf = place(&self.tree.grid, p).and_then(|(cell, x)| Some((self.tree.find_leaf(cell)?, x)));
        leaf.is_some_and(|(leaf, x)| {
            self.tree.tets(leaf).len() > LIST_PART as usize && self.tree.seed(leaf).is_none() && self.stride_from_middle(leaf, x).is_none()
        })
    }

    /// Every tetrahedron that contains `p`, ascending; if none does, the owner within the tolerance alone, if there is
    /// one. Where tetrahedra overlap, a leaf with a seed tells only those that are connected by faces around the point.
    pub fn owners(&self, p: [f32; 3]) -> Vec<u32> {
        let Some((cell, x)) = self.place_in_reach(p) else { return Vec::new() };
        let Some(leaf) = self.tree.find_leaf(cell) else { return Vec::new() };
        let mut owners = Vec::new();
        if self.tree.seed(leaf).is_some() {
            let owner = self.in_leaf(leaf, cell, x).owner;
            self.walker().star(owner, x, |t, _, weights| {
                owners.extend(weights.inside.then_some(t));
                false
            });
            owners.sort_unstable();
        } else {
            owners.extend(self.tree.tets(leaf).iter().filter(|&&t| self.weights(t, x).1.inside));
        }
        if owners.is_empty() { self.in_leaf(leaf, cell, x).found().into_iter().collect() } else { owners }
    }

    /// As [`Locator::locate`], but finds the leaf by the paper's traversal with a stack of `stack` nodes instead of the
    /// descent.
    pub fn locate_by_traversal(&self, p: [f32; 3], stack: usize) -> Location {
        let Some((cell, x)) = self.place_in_reach(p) else { return Location::NOWHERE };
        let code = morton(cell);
        let holds = |node: Node| node.code == code >> (3 * (MAX_LEVEL - node.level));
        let mut location = Location::NOWHERE;
        traverse_leaves(self.tree, stack, holds, |leaf| {
            location = self.in_leaf(leaf.index, cell, x);
            ControlFlow::Break(())
        });
        location
    }

    /// [`Locator::locate`] for many points, in parallel.
    pub fn locate_each(&self, points: &[[f32; 3]]) -> Vec<Location> {
        points.par_iter().map(|&p| self.locate(p)).collect()
    }

    fn weights(&self, tet: u32, x: Vec3) -> (Tet, Weights) {
        let tet = self.vertices.tet(self.mesh.tets[tet as usize]);
        (tet, tet.weights(x))
    }

    pub(super) fn walker(&self) -> Walker<'_> {
        Walker { mesh: self.mesh, neighbours: self.neighbours, normalised: &self.vertices.normalised }
    }

    fn location(&self, owner: u32, x: Vec3) -> Location {
        Location { owner, barycentric: self.vertices.tet(self.mesh.tets[owner as usize]).barycentric(x) }
    }

    /// The walk that [`Locator::locate`] takes to a point whose leaf has a seed; `None` for other leaves.
    pub fn walk(&self, p: [f32; 3]) -> Option<Walked> {
        let (cell, x) = place(&self.tree.grid, p)?;
        let seed = self.tree.seed(self.tree.find_leaf(cell)?)?;
        Some(self.walker().walk(seed, &self.leaf_cell(cell), x))
    }

    /// The owner of `p`, if it can be reached from `hint` in fewer than `most` steps across faces and `p` is not near
    /// an edge; see [`Walker::stride_to`]. A bad tetrahedron is no hint.
    pub fn stride_to(&self, p: [f32; 3], hint: u32, most: u32) -> Option<Location> {
        let usable = |t: &[u32; 4]| t.iter().enumerate().all(|(i, &v)| (v as usize) < self.mesh.points.len() && !t[..i].contains(&v));
        self.mesh.tets.get(hint as usize).filter(|t| usable(t))?;
        let (_, x) = place(&self.tree.grid, p)?;
        Some(self.location(self.walker().stride_to(hint, x, most)?, x))
    }

    /// The cell of a leaf, given one of its finest cells.
    fn leaf_cell(&self, finest: [u32; 3]) -> LeafCell {
        let (grid, level) = (&self.tree.grid, self.tree.grid.level);
        let cell = finest.map(|q| q >> (MAX_LEVEL - level));
        let half = half_cell(grid, level, cell);
        LeafCell { centre: cell_centre(grid, level, half, cell), half }
    }

    /// The owner among the tetrahedra of a leaf, whether they are listed or reached by a walk.
    fn in_leaf(&self, leaf: u32, finest: [u32; 3], x: Vec3) -> Location {
        if self.is_beside(leaf, finest, x) {
            return Location::NOWHERE;
        }
        let walk = |seed| self.walker().walk(seed, &self.leaf_cell(finest), x).best;
        let walked = self.stride_from_middle(leaf, x).map(Best::inside).or_else(|| self.tree.seed(leaf).map(walk));
        let best = walked.unwrap_or_else(|| self.listed(leaf, finest, x));
        let close = best.inside || !self.tree.is_boundary(leaf) || best.smallest >= -self.tolerance;
        if best.owner != NONE && close { self.location(best.owner, x) } else { Location::NOWHERE }
    }

    /// Whether the leaf's slab says that x lies beside the mesh.
    fn is_beside(&self, leaf: u32, finest: [u32; 3], x: Vec3) -> bool {
        let (grid, slabs) = (&self.tree.grid, &self.tree.slabs);
        let slab = slabs.get((leaf - self.tree.internal_nodes()) as usize).filter(|_| leaves_room(&self.tree.grid, self.tolerance));
        slab.is_some_and(|&slab| SlabCell::new(grid, finest.map(|q| q >> (MAX_LEVEL - grid.level))).is_outside(slab, x))
    }

    /// The owner by a stride from the tetrahedron in the middle of the list, in trees with seeds.
    fn stride_from_middle(&self, leaf: u32, x: Vec3) -> Option<u32> {
        let list = self.tree.tets(leaf);
        let middle = *list.get(list.len() / 2).filter(|_| self.tree.lists == Lists::Boundary)?;
        self.walker().stride_to(middle, x, STRIDE)
    }

    /// The best tetrahedron of a leaf's list among those near the point, searched up to the first that contains x.
    fn listed(&self, leaf: u32, finest: [u32; 3], x: Vec3) -> Best {
        let reach = reach(&self.tree.grid, self.tolerance);
        let near = |&&t: &&u32| is_near(&self.vertices.cells(self.mesh.tets[t as usize], MAX_LEVEL), finest, reach);
        let mut best = Best::NONE;
        for &t in self.tree.tets(leaf).iter().filter(near) {
            let (tet, weights) = self.weights(t, x);
            best.consider(t, &tet, &weights);
            if best.inside {
                break;
            }
        }
        best
    }
}
