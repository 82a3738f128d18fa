//! The place of the surface that is closest to a point. Twin of `glsl/query/nearest`.

use super::boundary::{NONE, Topology};
use super::leaf_walk::walk_leaves;
use super::leaves::cell_box;
use super::locate::{Location, place};
use super::separate::{Closest, box_square, closest_on};
use super::tet::{Tet, Vec3, dot, sub};
use super::traverse::Node;
use super::vertices::Vertices;
use crate::grid::{per_axis, two_to};
use crate::mesh::Mesh;
use crate::tree::TreeArrays;
use std::cell::Cell;

/// Finds the places of a mesh's surface that are closest to points.
pub struct Surface<'a> {
    mesh: &'a Mesh,
    topology: &'a Topology,
    tree: &'a TreeArrays,
    vertices: Vertices,
}

impl<'a> Surface<'a> {
    /// Prepares queries. `topology` and `tree` must be those of `mesh`.
    pub fn new(mesh: &'a Mesh, topology: &'a Topology, tree: &'a TreeArrays) -> Self {
        Self { mesh, topology, tree, vertices: Vertices::new(mesh, &tree.grid) }
    }

    /// The place of the surface closest to `p`, and its squared distance as [`crate::layout::NearState::square`] has it:
    /// of the faces without neighbour, the one with the smallest squared distance (ties: that of the tetrahedron with the
    /// lowest id). `None` if it is farther away than `within`, or than 1 / scale of the grid.
    pub fn nearest(&self, p: [f32; 3], within: f32) -> Option<(Location, f32)> {
        let grid = &self.tree.grid;
        let (_, x) = place(grid, p).filter(|_| within >= 0.0)?;
        let reach = (within * grid.scale).min(1.0) * two_to(19);
        let best = Cell::new((reach * reach, NONE));
        let measure = |leaf: u32| {
            for &t in self.tree.primitives(leaf).iter().filter(|&&t| self.topology.neighbours[t as usize].contains(&NONE)) {
                let (tet, v) = self.around(t, x);
                let (least, owner) = best.get();
                if box_square(&v) <= least {
                    let Closest { square, .. } = closest_on(&v, self.surface_of(t, tet.rank));
                    if square < least || square == least && t < owner {
                        best.set((square, t));
                    }
                }
            }
        };
        let enters = |node: Node| self.tree.is_boundary(node.index) && self.node_square(node, x) <= best.get().0;
        // The order of the leaves does not matter; a close one saves most of the others.
        if let Some(leaf) = self.close_leaf(x) {
            measure(leaf);
        }
        walk_leaves(self.tree, enters, |leaf| {
            measure(leaf.index);
            false
        });
        let (square, owner) = best.get();
        (owner != NONE).then(|| {
            let (tet, v) = self.around(owner, x);
            let Closest { weights, .. } = closest_on(&v, self.surface_of(owner, tet.rank));
            (Location { owner, barycentric: tet.rank.map(|r| weights[r]) }, square)
        })
    }

    /// The distance, in units of the mesh, that a squared distance of [`Surface::nearest`] stands for.
    pub fn distance(&self, square: f32) -> f32 {
        distance(square, self.tree.grid.scale)
    }

    fn around(&self, t: u32, x: Vec3) -> (Tet, [Vec3; 4]) {
        let tet = self.vertices.tet(self.mesh.tets[t as usize]);
        (tet, tet.v.map(|v| sub(v, x)))
    }

    /// The faces of tetrahedron `t` at the surface, each by the place in ascending order of the vertex opposite to it.
    fn surface_of(&self, t: u32, rank: [usize; 4]) -> [bool; 4] {
        let mut faces = [false; 4];
        rank.iter().zip(self.topology.neighbours[t as usize]).for_each(|(&r, beside)| faces[r] = beside == NONE);
        faces
    }

    /// Squared distance of a node's cell, never larger than that of what it contains.
    fn node_square(&self, node: Node, x: Vec3) -> f32 {
        let grid = &self.tree.grid;
        let [x0, y0, z0, x1, y1, z1] = cell_box(grid, node.level, node.code);
        let (below, above) = (sub(grid.normalise([x0, y0, z0]), x), sub(x, grid.normalise([x1, y1, z1])));
        let d = per_axis(|c| (below[c].max(above[c]) * two_to(-21) - 1.0).max(0.0));
        dot(d, d)
    }

    /// A leaf with surface in it, close to a point.
    fn close_leaf(&self, x: Vec3) -> Option<u32> {
        let mut node = Node::default();
        while node.level < self.tree.grid.level {
            let children = (0..8).filter_map(|digit| {
                let index = self.tree.child(node.index, digit).filter(|&child| self.tree.is_boundary(child))?;
                Some(Node { index, level: node.level + 1, code: node.code << 3 | digit })
            });
            node = children.min_by(|a, b| self.node_square(*a, x).total_cmp(&self.node_square(*b, x)))?;
        }
        Some(node.index)
    }
}

/// The distance, in units of the mesh, of a squared distance in a grid of this scale.
pub fn distance(square: f32, scale: f32) -> f32 {
    (f64::from(square).sqrt() / (f64::from(scale) * f64::from(1 << 19))) as f32
}
