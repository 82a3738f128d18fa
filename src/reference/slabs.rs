//! Slabs: for each leaf that the surface of the mesh may pass through, two parallel planes between which all
//! tetrahedra of its list lie. The surface is nearly flat in most leaves, so for most points and voxels beside the mesh
//! the slab proves in a few operations what otherwise takes a search of the whole list. Twin of
//! `glsl/shared/{slab,box_slab}.glsl` and `glsl/build/43_fit_slabs`.
//!
//! **Coordinates.** `y = (x − centre)·inverse` runs from −1 to 1 across the leaf's cell; it is 0 on axes that normalised
//! coordinates are too coarse for.
//!
//! **Normal.** That of the largest boundary face among the first 16 tetrahedra of the list, measured by the largest component
//! of the cross of its edges in these coordinates, without the six lowest bits; the first face if several are as large. It
//! is divided by that component; the other two are rounded to multiples of 1/64.
//!
//! **Word.** From the lowest bit: 8 bits for the place of the lower plane and 8 for the upper, 7 for each of the two
//! smaller components of the normal, plus 64, and 2 for the axis of the largest. The place of a distance d is
//! `⌊42·d + 127.5⌋`, from 0 to 255: distances in the cell are at most 3. A leaf without boundary faces there, one within
//! the mesh, and one with a very long list have [`EVERYTHING`].
//!
//! **Rounding.** A tetrahedron may own a point beside it by virtue of rounding or of a tolerance t < 2^-12. Let E be 2^-18 of the
//! volume of the tetrahedron's box, enlarged by two finest cells, within which its points must lie, and V six times its
//! volume. Then barycentric coordinates are at least −e with e = t + E/(V − E), so the distance of the point is beyond
//! those of the vertices by at most 3e times their range. If V ≤ 4E, the enlarged box is taken instead of the vertices.
//! Distances themselves are off by less than 2^-20 of their summands.
//!
//! **Boxes.** A box counts as touching a tetrahedron that is up to about 2^-19 of the size of both away
//! ([`super::separate`]). So a range is enlarged by 2^-16 of its summands, that of a box by as much of itself, and 2^-10 is
//! room to spare.

use super::assign::{centre_of, half_cell};
use super::boundary::Topology;
use super::quarters::COARSE;
use super::splits::Splits;
use super::tet::{Bounds, FACES, Vec3, abs, cross, dot, orient, sub};
use super::vertices::Vertices;
use crate::grid::{Grid, per_axis, reciprocal, two_to, unmorton};
use crate::layout::NONE;
use crate::layout::constants::fit_slabs::{LOOKED_AT, MAX_LIST_FOR_SLAB, PLACES};
use crate::mesh::Mesh;
use rayon::prelude::*;

pub use crate::layout::constants::slab::EVERYTHING;

/// The coordinates in a leaf's cell that slabs are given in.
#[derive(Clone, Copy, Debug)]
pub struct SlabCell {
    centre: Vec3,
    inverse: Vec3,
}

impl SlabCell {
    /// Those of a cell of the leaves' level.
    pub fn new(grid: &Grid, cell: [u32; 3]) -> Self {
        let half = half_cell(grid, grid.level, [0; 3]);
        let inverse = per_axis(|c| if grid.extent[c] < COARSE { 0.0 } else { reciprocal(half[c]) });
        Self { centre: centre_of(grid, grid.level, cell), inverse }
    }

    /// A point in normalised coordinates.
    fn in_cell(&self, x: Vec3) -> Vec3 {
        per_axis(|c| (x[c] - self.centre[c]) * self.inverse[c])
    }

    /// Whether x lies outside of this leaf's slab, so that no tetrahedron owns it.
    pub fn is_outside(&self, slab: u32, x: Vec3) -> bool {
        let at = place(dot(normal(slab), self.in_cell(x)));
        at < (slab & 255) || at > (slab >> 8 & 255)
    }

    /// Whether the box with centre x and these half axes lies outside of this leaf's slab, so that no tetrahedron of its list
    /// touches it as [`super::separate::box_touches`] tells.
    pub fn is_box_outside(&self, slab: u32, x: Vec3, half: &[Vec3; 3]) -> bool {
        let n = normal(slab);
        let [a, b, c] = half.map(|h| dot(n, per_axis(|k| h[k] * self.inverse[k])).abs());
        let (reach, d) = ((a + b) + c, dot(n, self.in_cell(x)));
        let more = reach + reach * two_to(-16);
        place(d + more) < (slab & 255) || place(d - more) > (slab >> 8 & 255)
    }
}

/// The place of a plane or a point at distance d.
fn place(d: f32) -> u32 {
    (d * 42.0 + 127.5).clamp(0.0, 255.0) as u32
}

/// The normal of a slab, whose largest component is 1.
fn normal(slab: u32) -> Vec3 {
    let [u, v] = [16, 23].map(|bit| ((slab >> bit & 127) as f32 - 64.0) * two_to(-6));
    match slab >> 30 {
        0 => [1.0, u, v],
        1 => [v, 1.0, u],
        _ => [u, v, 1.0],
    }
}

/// The bits of a slab that give its normal.
fn normal_bits(n: Vec3) -> u32 {
    let [x, y, z] = abs(n);
    let axis = if x >= y && x >= z { 0 } else { 2 - usize::from(y >= z) };
    let r = reciprocal(n[axis]);
    let part = |by: usize| ((n[(axis + by) % 3] * r) * 64.0 + 64.5).clamp(0.0, 127.0) as u32;
    (axis as u32) << 30 | part(2) << 23 | part(1) << 16
}

/// What slabs are fitted to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) topology: &'a Topology,
    pub(super) vertices: &'a Vertices,
    pub(super) grid: &'a Grid,
}

impl Fit<'_> {
    /// The slab of a leaf with this list, boundary flag and Morton code.
    pub(super) fn slab(&self, listed: &[u32], boundary: bool, code: u32) -> u32 {
        if !boundary || listed.len() > MAX_LIST_FOR_SLAB as usize || self.grid.graded != 0 {
            return EVERYTHING;
        }
        let cell = SlabCell::new(self.grid, unmorton(code));
        let Some(n) = self.largest_face(listed, &cell) else { return EVERYTHING };
        let bits = normal_bits(n);
        let (mut lowest, mut highest) = (255, 0);
        for &t in listed {
            let [lo, hi] = self.range(t, &cell, normal(bits));
            (lowest, highest) = (lowest.min(place(lo)), highest.max(place(hi)));
        }
        bits | highest << 8 | lowest
    }

    /// The normal of the largest boundary face of the first listed tetrahedra.
    fn largest_face(&self, listed: &[u32], cell: &SlabCell) -> Option<Vec3> {
        let (mut largest, mut normal) = (PLACES, None);
        for (i, &t) in listed.iter().take(LOOKED_AT as usize).enumerate() {
            let v = self.corners(t);
            for (f, [a, b, c]) in FACES.into_iter().enumerate() {
                if self.topology.neighbours[t as usize][f] != NONE {
                    continue;
                }
                let edge = |to: usize| per_axis(|k| (v[to][k] - v[a][k]) * cell.inverse[k]);
                let n = cross(edge(b), edge(c));
                let size = abs(n).into_iter().fold(0.0, f32::max);
                let key = (size.to_bits() & !PLACES) | (PLACES - (4 * i + f) as u32);
                if key > largest {
                    (largest, normal) = (key, Some(n));
                }
            }
        }
        normal
    }

    fn corners(&self, t: u32) -> [Vec3; 4] {
        self.mesh.tets[t as usize].map(|id| self.vertices.normalised[id as usize])
    }

    /// The smallest and the largest distance along n of a point in the cell that a tetrahedron may own.
    fn range(&self, t: u32, cell: &SlabCell, n: Vec3) -> [f32; 2] {
        let v @ [a, b, c, d] = self.corners(t);
        let Bounds { lo, hi, .. } = Bounds::new(v);
        let beyond = per_axis(|c| self.grid.extent[c] * two_to(-9));
        let size = per_axis(|c| (hi[c] - lo[c]) + beyond[c]);
        let rounding = ((size[0] * size[1]) * size[2]) * two_to(-18);
        let volume = orient(a, b, c, d).abs();
        if volume <= 4.0 * rounding {
            let (a, b) = (cell.in_cell(sub(lo, beyond)), cell.in_cell(per_axis(|c| hi[c] + beyond[c])));
            let side = |of: fn(f32, f32) -> f32| per_axis(|c| of(n[c] * a[c], n[c] * b[c]));
            let ([x, y, z], [p, q, r]) = (side(f32::min), side(f32::max));
            return enlarged((x + y) + z, (p + q) + r, dot(abs(n), per_axis(|c| a[c].abs().max(b[c].abs()))), 0.0);
        }
        let y = v.map(|v| cell.in_cell(v));
        let d = y.map(|y| dot(n, y));
        let far = dot(abs(n), per_axis(|k| y.iter().fold(0.0, |far: f32, y| far.max(y[k].abs()))));
        let (least, most) = (d[0].min(d[1]).min(d[2].min(d[3])), d[0].max(d[1]).max(d[2].max(d[3])));
        let e = two_to(-12) + rounding * reciprocal(volume - rounding);
        enlarged(least, most, far, (3.0 * (most - least)) * e)
    }
}

/// A range of distances, enlarged by `by` and for the rounding of distances whose summands amount to `far`.
fn enlarged(least: f32, most: f32, far: f32, by: f32) -> [f32; 2] {
    let more = by + (far * two_to(-16) + two_to(-10));
    [least - more, most + more]
}

/// The slab of each leaf, given the boundary flags of the leaves.
pub fn slabs(
    primitives: &[u32],
    splits: &Splits,
    flags: &[bool],
    mesh: &Mesh,
    topology: &Topology,
    vertices: &Vertices,
    grid: &Grid,
) -> Vec<u32> {
    let fit = Fit { mesh, topology, vertices, grid };
    let codes = &splits.codes[splits.codes.len() - flags.len()..];
    let slab = |(i, &flag): (usize, &bool)| fit.slab(&primitives[splits.po[i] as usize..splits.po[i + 1] as usize], flag, codes[i]);
    flags.par_iter().enumerate().map(slab).collect()
}
