//! The CPU reference, tested against its own definitions and against brute force.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod assign;
mod boundary;
mod build;
mod grading;
mod lists;
mod locate;
mod nearest;
mod oracle;
mod order;
mod overlap;
mod slabs;
mod slice;
mod slice_files;
mod traverse;
mod unflagged_leaves;
mod validate;

use olbvh::mesh::Mesh;
use olbvh::options::{Assign, BuildOptions, Lists};
use olbvh::reference::boundary::{Topology, topology};
use olbvh::reference::build::build;
use olbvh::tree::TreeArrays;

/// Values of α that the tests use.
const ALPHAS: [f32; 7] = [0.0, 0.5, 1.0, 2.0, 4.0, 7.25, 10.0];

fn options(alpha: f32, assign: Assign) -> BuildOptions {
    BuildOptions { alpha, assign, lists: Lists::All, boxes: true, ..BuildOptions::default() }
}

fn tree(mesh: &Mesh, topology: &Topology, alpha: f32, assign: Assign) -> TreeArrays {
    build(mesh, topology, &options(alpha, assign)).unwrap()
}

/// A mesh with its topology.
fn prepared(mesh: Mesh) -> (Mesh, Topology) {
    let topology = topology(&mesh).unwrap();
    (mesh, topology)
}

/// The level of a node.
fn level_of(tree: &TreeArrays, node: u32) -> u32 {
    tree.no.partition_point(|&n| n <= node) as u32
}

/// Reproducible random numbers from 0 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / 16_777_216.0
    }

    fn below(&mut self, n: usize) -> usize {
        ((f64::from(self.next()) * n as f64) as usize).min(n - 1)
    }

    /// Barycentric coordinates of a point on a corner (1), edge (2) or face (3), or inside (4), of a tetrahedron.
    fn weights(&mut self, corners: usize) -> [f32; 4] {
        let mut w = [0.0; 4];
        let first = self.below(4);
        for i in 0..corners {
            w[(first + i) % 4] = self.next() + 1e-3;
        }
        let sum: f32 = w.iter().sum();
        w.map(|x| x / sum)
    }

    /// A point of a random valid tetrahedron of `mesh`: on a vertex, an edge or a face, or inside, as `corners` says.
    fn point(&mut self, mesh: &Mesh, topology: &Topology, corners: usize) -> [f32; 3] {
        loop {
            let t = self.below(mesh.tets.len());
            if topology.is_valid(t as u32) {
                let w = self.weights(corners);
                let v = mesh.tets[t].map(|v| mesh.points[v as usize]);
                return [0, 1, 2].map(|c| (w[0] * v[0][c] + w[1] * v[1][c]) + (w[2] * v[2][c] + w[3] * v[3][c]));
            }
        }
    }
}
