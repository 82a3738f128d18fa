//! Orientation, containment and barycentric coordinates of a tetrahedron in normalised coordinates (SPEC 2.1, 3.1).
//! Twin of `glsl/shared/tet.glsl`: the same operations in the same order.
//!
//! The vertices of a tetrahedron are taken in ascending global index, so that two neighbours get bit-identical results
//! for their common face.

use crate::grid::{canonical, per_axis, reciprocal, two_to};

/// A point in normalised coordinates.
pub type Vec3 = [f32; 3];

pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn dot(a: Vec3, b: Vec3) -> f32 {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
}

/// The vertices of the face opposite to vertex i, in ascending global index.
pub(super) const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];
/// The two vertices of each edge, and the two that are not on it.
pub(super) const EDGES: [[usize; 4]; 6] = [[0, 1, 2, 3], [0, 2, 1, 3], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 0, 2], [2, 3, 0, 1]];

pub(super) fn abs(a: Vec3) -> Vec3 {
    a.map(f32::abs)
}

/// Sums of the absolute products in `cross(a, b)`.
pub(super) fn cross_bound(a: Vec3, b: Vec3) -> Vec3 {
    let [a, b] = [abs(a), abs(b)];
    [a[1] * b[2] + a[2] * b[1], a[2] * b[0] + a[0] * b[2], a[0] * b[1] + a[1] * b[0]]
}

/// Six times the signed volume of (a, b, c, p). It is computed relative to p, so that it is exactly 0 where p is one of
/// the others.
pub fn orient(a: Vec3, b: Vec3, c: Vec3, p: Vec3) -> f32 {
    -dot(cross(sub(a, p), sub(b, p)), sub(c, p))
}

/// A tetrahedron with its vertices in ascending global index.
#[derive(Clone, Copy, Debug)]
pub struct Tet {
    /// Vertices in ascending global index.
    pub v: [Vec3; 4],
    /// `rank[i]` is the place in `v` of the caller's i-th vertex.
    pub rank: [usize; 4],
}

/// Where a point lies relative to a tetrahedron.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    /// For each vertex, in ascending index, six times the signed volume between the point and the opposite face;
    /// positive inside.
    pub w: [f32; 4],
    /// Sum of the weights.
    pub sum: f32,
    /// Whether the point lies in the closed bounding box.
    pub in_box: bool,
    /// Whether the closed tetrahedron contains the point: no weight is negative, the point lies in the bounding box,
    /// and the tetrahedron is not flat.
    pub inside: bool,
    /// 2^-16 of the volume of the bounding box. If a weight is within this margin of 0, then because of rounding the
    /// point may lie on either side of the face.
    pub margin: f32,
    /// Whether the point is inside by more than the margin, so that rounding cannot put it into a neighbour as well. In
    /// a mesh whose tetrahedra do not overlap, this tetrahedron is then the owner.
    pub clear: bool,
}

/// The bounding box of a tetrahedron, and its margin.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub(super) lo: Vec3,
    pub(super) hi: Vec3,
    /// The margin of [`Weights::margin`].
    margin: f32,
}

impl Bounds {
    /// The bounding box and margin of four vertices.
    pub fn new([a, b, c, d]: [Vec3; 4]) -> Self {
        let lo = per_axis(|k| a[k].min(b[k]).min(c[k].min(d[k])));
        let hi = per_axis(|k| a[k].max(b[k]).max(c[k].max(d[k])));
        let size = sub(hi, lo);
        Self { lo, hi, margin: ((size[0] * size[1]) * size[2]) * two_to(-16) }
    }

    fn hold(&self, p: Vec3) -> bool {
        (0..3).all(|k| self.lo[k] <= p[k] && p[k] <= self.hi[k])
    }
}

/// What a step of a walk needs to know of a point. It is cheaper to compute than [`Weights`], but because of rounding
/// neighbours may disagree about their common face.
#[derive(Clone, Copy, Debug)]
pub struct Sides {
    /// Weights as in [`Weights::w`], in the order of the vertices given.
    pub w: [f32; 4],
    /// Sum of the weights, never negative.
    pub sum: f32,
    /// As [`Weights::clear`]; here too rounding errors are far below the margin.
    pub clear: bool,
    /// Whether the point is outside of no face by more than the margin.
    pub near: bool,
}

/// The smallest of four weights.
pub fn least_of(w: [f32; 4]) -> f32 {
    w[0].min(w[1]).min(w[2].min(w[3]))
}

/// The weights of p in a tetrahedron, computed relative to p.
pub fn sides_of(v: [Vec3; 4], bounds: &Bounds, p: Vec3) -> Sides {
    let [a, b, c, d] = v.map(|v| sub(v, p));
    let (ab, cd) = (cross(a, b), cross(c, d));
    let w = [dot(cd, b), -dot(cd, a), dot(ab, d), -dot(ab, c)];
    let sum = (w[0] + w[1]) + (w[2] + w[3]);
    let w = if sum < 0.0 { w.map(|w| -w) } else { w };
    let margin = bounds.margin;
    Sides { w, sum: sum.abs(), clear: bounds.hold(p) && w.iter().all(|&w| w > margin), near: w.iter().all(|&w| w >= -margin) }
}

impl Sides {
    /// Barycentric coordinates in the order of the vertices.
    pub fn barycentric(&self) -> [f32; 4] {
        let k = if self.sum <= 0.0 { 0.0 } else { reciprocal(self.sum) };
        self.w.map(|w| w * k)
    }
}

impl Tet {
    /// Barycentric coordinates of `p` in the caller's order of vertices. Every search reports them for an owner,
    /// however it was found. A zero has no sign, which Vulkan does not promise to keep.
    pub fn barycentric(&self, p: Vec3) -> [f32; 4] {
        let b = sides_of(self.v, &Bounds::new(self.v), p).barycentric();
        self.rank.map(|r| canonical(b[r]))
    }

    /// The tetrahedron `ids` (four different vertices) of a mesh with these normalised points.
    pub fn new(ids: [u32; 4], normalised: &[Vec3]) -> Self {
        let rank = ids.map(|id| ids.iter().filter(|&&other| other < id).count());
        let mut v = [[0.0; 3]; 4];
        for (i, r) in rank.into_iter().enumerate() {
            v[r] = normalised[ids[i] as usize];
        }
        Self { v, rank }
    }

    /// Six times the signed volume with the vertices in ascending index; exactly 0 means that the tetrahedron is flat.
    pub fn volume(&self) -> f32 {
        orient(self.v[0], self.v[1], self.v[2], self.v[3])
    }

    /// The weights of `p`; a weight is negative if `p` lies outside of that face.
    pub fn weights(&self, p: Vec3) -> Weights {
        let [a, b, c, d] = self.v;
        let s = if self.volume() < 0.0 { -1.0 } else { 1.0 };
        // The sign of a face's orientation alternates with the opposite vertex.
        let w = [-s * orient(b, c, d, p), s * orient(a, c, d, p), -s * orient(a, b, d, p), s * orient(a, b, c, p)];
        let bounds = Bounds::new(self.v);
        let (in_box, margin) = (bounds.hold(p), bounds.margin);
        let inside = in_box && self.volume() != 0.0 && w.iter().all(|&w| w >= 0.0);
        Weights { w, sum: (w[0] + w[1]) + (w[2] + w[3]), in_box, inside, margin, clear: inside && w.iter().all(|&w| w > margin) }
    }
}

impl Weights {
    /// Whether the point is outside of no face by more than the margin.
    pub fn near(&self) -> bool {
        self.w.iter().all(|&w| w >= -self.margin)
    }

    /// Whether the point is within the margin of exactly one face, and inside of all others by more than the margin.
    pub fn near_one_face(&self) -> bool {
        self.near() && self.w.iter().filter(|&&w| w <= self.margin).count() == 1
    }

    /// Smallest barycentric coordinate; `f32::MIN` for a flat tetrahedron. It is 0 where rounding may have put the point
    /// outside: 2^-18 of the box is the most that it can change a weight by (at most 54 half units in the last place, of
    /// products of three sides of the box). In thin tetrahedra, this exceeds the usual tolerance.
    pub fn smallest(&self) -> f32 {
        if self.in_box && least_of(self.w) >= -(self.margin * 0.25) {
            return 0.0;
        }
        if self.sum <= 0.0 {
            return f32::MIN;
        }
        least_of(self.w) * reciprocal(self.sum)
    }

    /// Barycentric coordinates in the caller's order of vertices.
    pub fn barycentric(&self, rank: [usize; 4]) -> [f32; 4] {
        let r = if self.sum <= 0.0 { 0.0 } else { reciprocal(self.sum) };
        rank.map(|k| self.w[k] * r)
    }
}
