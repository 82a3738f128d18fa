//! The place of the surface that is closest to a point. Twin of `glsl/query/nearest` and `nearest_places`.

use super::assign::{cell_centre, half_cell};
use super::boundary::Topology;
use super::locate::{Location, place};
use super::separate::{Closest, box_square, closest_on};
use super::tet::{Tet, Vec3, dot, sub};
use super::vertices::Vertices;
use crate::grid::{canonical, per_axis, two_to, unmorton};
use crate::layout::NONE;
use crate::mesh::Mesh;
use crate::tree::TreeArrays;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A node: its index, its level, and the Morton code of its cell.
type Node = (u32, u32, u32);

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
        let reach = (canonical(within) * grid.scale).min(1.0) * two_to(19);
        let (mut least, mut owner) = (reach * reach, NONE);
        // Nearest nodes first. The order of the leaves does not matter, but a close one saves most of the others.
        let mut waiting = BinaryHeap::from([Reverse((0, (0, 0, 0)))]);
        while let Some(Reverse((square, (index, level, code)))) = waiting.pop() {
            if f32::from_bits(square) > least {
                break;
            }
            if level < grid.level {
                let children = (0..8).filter_map(|digit| {
                    let index = self.tree.child(index, digit).filter(|&child| self.tree.is_boundary(child))?;
                    let child = (index, level + 1, code << 3 | digit);
                    // Squares are not negative, so their bits are in their order.
                    Some(Reverse((self.square_of(child, x).to_bits(), child)))
                });
                waiting.extend(children);
                continue;
            }
            for &t in self.tree.tets(index).iter().filter(|&&t| self.topology.neighbours[t as usize].contains(&NONE)) {
                let (tet, v) = self.around(t, x);
                if box_square(&v) <= least {
                    let Closest { square, .. } = closest_on(&v, self.surface_of(t, tet.rank));
                    if square < least || square == least && t < owner {
                        (least, owner) = (square, t);
                    }
                }
            }
        }
        (owner != NONE).then(|| {
            let (tet, v) = self.around(owner, x);
            let Closest { weights, .. } = closest_on(&v, self.surface_of(owner, tet.rank));
            (Location { owner, barycentric: tet.rank.map(|r| weights[r]) }, least)
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
    fn square_of(&self, (_, level, code): Node, x: Vec3) -> f32 {
        let (grid, cell) = (&self.tree.grid, unmorton(code));
        let h = half_cell(grid, level, cell);
        let from = sub(cell_centre(grid, level, h, cell), x);
        let d = per_axis(|c| ((from[c].abs() - h[c]) * two_to(-21) - 2.0).max(0.0));
        dot(d, d)
    }
}

/// The distance, in units of the mesh, of a squared distance in a grid of this scale.
pub fn distance(square: f32, scale: f32) -> f32 {
    (f64::from(square).sqrt() / (f64::from(scale) * f64::from(1 << 19))) as f32
}
