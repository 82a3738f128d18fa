//! Tests whether a tetrahedron touches an octree cell: the filters of the assignments `Planes` and `Exact` (SPEC 2.2).
//! Twin of `glsl/shared/assign.glsl`: the same operations in the same order.
//!
//! The separating axes, in normalised coordinates, are the normals of the four face planes, and for `Exact` also the
//! crosses of the six edges with the three coordinate axes. (The range of candidates itself accounts for the three face
//! normals of the box.) The test guarantees two properties, in floating point too:
//! 1. It keeps every candidate that the closed tetrahedron touches.
//! 2. It keeps every candidate that contains a point p with `Tet::weights(p).inside`.
//!
//! **Box of cell k** on axis c: `h = extent_c·2^-(l+1)`, or `extent_c/2` on an axis that is flat to the quantization
//! (`inv_c = 0`: cell 0 stands for all of it). The centre is `floor(((2k+1)·h)·2^42)·2^-42`, a multiple of 2^-42 like
//! every vertex, so that no product below is denormal. The half size is `h + (extent_c·2^-20 + 2^-41)`, because
//! quantization is off by at most four roundings (2^-22 of the extent), and the centre by 2^-42.
//!
//! **Slack.** On axis c, a candidate's centre is at most `reach_c = E_c + 2·half_c` away from a vertex, where E is the
//! size of the tetrahedron's bounding box. A determinant over such lengths is off by less than 2^-21·Σ|products|. The
//! tests allow 2^-18, that is, `slack_c = reach_c·2^-18 + 2^-42` per unit of |product of edges|; this is part of the
//! limits that are computed once per tetrahedron.
//!
//! **Spread.** For edges, property 2 needs more. Let B be the volume of the bounding box, and V six times the volume of
//! the tetrahedron. A point may be inside only by virtue of the rounding ε ≤ 2^-21·6B of the four determinants; such a
//! point may lie outside an edge's shadow by 3ε/|V| of the shadow's width. The limits of edges therefore get
//! `(B·reciprocal(|V|))·2^-16` of the width, and slivers with `|V| ≤ B·2^-12` have no edge tests.

use super::tet::{EDGES, FACES, Tet, Vec3, abs, cross, cross_bound, dot, sub};
use crate::grid::{Grid, MAX_LEVEL, canonical, per_axis, reciprocal, two_to};
use crate::options::Assign;

/// A face plane. A box is outside if `dot(normal, centre − at) > limit`.
#[derive(Clone, Copy, Debug, Default)]
struct Face {
    normal: Vec3,
    at: Vec3,
    limit: f32,
}

/// The cross of an edge and a coordinate axis. A box is outside if `u_i·along_j − u_j·along_i`, with `u = centre − at`,
/// is below `lo` or above `hi`.
#[derive(Clone, Copy, Debug, Default)]
struct Shadow {
    lo: f32,
    hi: f32,
}

/// The test of one tetrahedron against cells of one level.
#[derive(Clone, Debug)]
pub struct Filter {
    assign: Assign,
    faces: [Face; 4],
    edges: bool,
    at: [Vec3; 6],
    along: [Vec3; 6],
    shadows: [[Shadow; 3]; 6],
}

/// The lower side of a cell of the finest grid in normalised coordinates, if the grid is graded.
fn normalised_side(grid: &Grid, c: usize, k: u32) -> f32 {
    (canonical(grid.graded_side(c, k) * grid.scale) * two_to(82)).floor() * two_to(-42)
}

/// Half the size of a cell of `level` per axis in normalised coordinates, without allowance for rounding. Unless the grid
/// is graded, it is that of all cells of the level.
pub fn half_cell(grid: &Grid, level: u32, cell: [u32; 3]) -> Vec3 {
    let (scale, shift) = (two_to(-1 - level as i32), MAX_LEVEL - level);
    per_axis(|c| {
        if grid.inv[c] == 0.0 {
            grid.extent[c] * 0.5
        } else if grid.graded == 0 {
            grid.extent[c] * scale
        } else {
            (normalised_side(grid, c, (cell[c] + 1) << shift) - normalised_side(grid, c, cell[c] << shift)) * 0.5
        }
    })
}

/// Half the size of a cell's box, with the allowance for rounding.
pub fn inflated(grid: &Grid, h: Vec3) -> Vec3 {
    let part = two_to(if grid.graded == 0 { -20 } else { -18 });
    per_axis(|c| h[c] + (grid.extent[c] * part + two_to(-41)))
}

/// Centre of a cell of `level` with half size `h`.
pub fn cell_centre(grid: &Grid, level: u32, h: Vec3, cell: [u32; 3]) -> Vec3 {
    per_axis(|c| {
        let at = if grid.graded != 0 && grid.inv[c] != 0.0 {
            normalised_side(grid, c, cell[c] << (MAX_LEVEL - level)) + h[c]
        } else {
            (2 * cell[c] + 1) as f32 * h[c]
        };
        (at * two_to(42)).floor() * two_to(-42)
    })
}

/// Centre of a cell of `level`.
pub fn centre_of(grid: &Grid, level: u32, cell: [u32; 3]) -> Vec3 {
    cell_centre(grid, level, half_cell(grid, level, cell), cell)
}

impl Filter {
    /// The filter of `tet` for cells with half size `h` under `assign`.
    pub fn new(tet: &Tet, grid: &Grid, h: Vec3, assign: Assign) -> Self {
        let mut filter = Self {
            assign,
            faces: [Face::default(); 4],
            edges: false,
            at: [[0.0; 3]; 6],
            along: [[0.0; 3]; 6],
            shadows: [[Shadow::default(); 3]; 6],
        };
        if assign == Assign::Aabb {
            return filter;
        }
        let v = &tet.v;
        let half = inflated(grid, h);
        let size = per_axis(|c| {
            let hi = v[0][c].max(v[1][c]).max(v[2][c].max(v[3][c]));
            hi - v[0][c].min(v[1][c]).min(v[2][c].min(v[3][c]))
        });
        let slack = per_axis(|c| (size[c] + 2.0 * half[c]) * two_to(-18) + two_to(-42));
        let volume = tet.volume();
        // The normal points outward according to the sign of the volume that `Tet::weights` uses.
        let s = if volume < 0.0 { -1.0 } else { 1.0 };
        for (i, [p, q, r]) in FACES.into_iter().enumerate() {
            let (a, b) = (sub(v[q], v[p]), sub(v[r], v[p]));
            let outward = if i % 2 == 0 { s } else { -s };
            let normal = cross(a, b).map(|x| outward * x);
            let limit = dot(abs(normal), half) + dot(cross_bound(a, b), slack);
            filter.faces[i] = Face { normal, at: v[p], limit };
        }
        let volume = volume.abs();
        let room = (size[0] * size[1]) * size[2];
        filter.edges = assign == Assign::Exact && volume > room * two_to(-12);
        if !filter.edges {
            return filter;
        }
        let spread = (room * reciprocal(volume)) * two_to(-16);
        for (e, [p, q, m, n]) in EDGES.into_iter().enumerate() {
            let along = sub(v[q], v[p]);
            filter.at[e] = v[p];
            filter.along[e] = along;
            let (um, un) = (sub(v[m], v[p]), sub(v[n], v[p]));
            for axis in 0..3 {
                let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
                let (tm, tn) = (um[i] * along[j] - um[j] * along[i], un[i] * along[j] - un[j] * along[i]);
                let (lo, hi) = (tm.min(tn).min(0.0), tm.max(tn).max(0.0));
                let (ai, aj) = (along[i].abs(), along[j].abs());
                let grow = ((aj * half[i] + ai * half[j]) + (aj * slack[i] + ai * slack[j])) + spread * (hi - lo);
                filter.shadows[e][axis] = Shadow { lo: lo - grow, hi: hi + grow };
            }
        }
        filter
    }

    /// Whether the tetrahedron's entry in the candidate with this centre (a cell in its quantized bounding box) is kept.
    pub fn touches(&self, centre: Vec3) -> bool {
        if self.assign == Assign::Aabb {
            return true;
        }
        for face in &self.faces {
            if dot(face.normal, sub(centre, face.at)) > face.limit {
                return false;
            }
        }
        if self.edges {
            for e in 0..6 {
                let u = sub(centre, self.at[e]);
                let along = self.along[e];
                for axis in 0..3 {
                    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
                    let t = u[i] * along[j] - u[j] * along[i];
                    let shadow = self.shadows[e][axis];
                    if t < shadow.lo || t > shadow.hi {
                        return false;
                    }
                }
            }
        }
        true
    }
}
