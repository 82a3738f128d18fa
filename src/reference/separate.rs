//! Separating-axis tests of tetrahedra and boxes, and the point of a tetrahedron nearest to the origin. Twin of
//! `glsl/shared/separate.glsl`: the same operations in the same order. All values are in normalised coordinates:
//! differences are below 2^43 and multiples of 2^-42, so no product of three of them overflows or becomes denormal.
//!
//! **Box and tetrahedron**, [`box_touches`]: the centre of the box is the origin, and h are its half axes. There are 25
//! axes: three axes of the box, four face normals of the tetrahedron, and 18 crosses of edges with axes of the box.
//! Axis L separates the two if the interval of the products `L·v` of the vertices lies outside ±(Σ|L·h| +
//! `bound·slack`), where `bound` sums the absolute products that L consists of. The slack of [`touch_slack`], 2^-20 of
//! the lengths in it, is at least twice the sum of all rounding errors. So a tetrahedron that touches the box is never
//! called separate, and one that is called touching is at most about 2^-19 of the size of box and tetrahedron away.
//!
//! **Two tetrahedra**, [`tets_touch`]: two with an equal vertex touch; of others, 8 face normals and 36 crosses of
//! edges are tried as axes, with no allowance, and touching counts as intersection. An axis is seldom exactly
//! perpendicular to what it is a product of, and that of edges that are nearly parallel can have any direction, so every
//! vertex counts on every axis. The answer for (a, b) equals that for (b, a) bit for bit, because every difference and
//! cross product changes only its sign.

use super::tet::{EDGES, FACES, Vec3, abs, cross, cross_bound, dot, sub};
use crate::grid::{canonical, per_axis, reciprocal, two_to};

/// The smallest and the largest of four values.
fn range4(x: [f32; 4]) -> (f32, f32) {
    (x[0].min(x[1]).min(x[2].min(x[3])), x[0].max(x[1]).max(x[2].max(x[3])))
}

/// The closed bounding box of four points.
pub fn bounds(v: &[Vec3; 4]) -> (Vec3, Vec3) {
    let range = per_axis(|c| range4(v.map(|p| p[c])));
    (range.map(|r| r.0), range.map(|r| r.1))
}

/// The allowance of [`box_touches`] for vertices `v` (relative to the centre of the box) and half axes `h`. On each
/// axis it is 2^-20 of the sum of the largest absolute coordinate of a vertex and the half extent of the box, plus
/// 2^-42.
pub fn touch_slack(v: &[Vec3; 4], h: &[Vec3; 3]) -> Vec3 {
    let (lo, hi) = bounds(v);
    per_axis(|c| {
        let far = hi[c].abs().max(lo[c].abs());
        let extent = (h[0][c].abs() + h[1][c].abs()) + h[2][c].abs();
        (far + extent) * two_to(-20) + two_to(-42)
    })
}

/// Whether the closed tetrahedron `v` and the closed box with centre 0 and half axes `h` touch, with the allowance
/// `slack`.
pub fn box_touches(v: &[Vec3; 4], h: &[Vec3; 3], slack: Vec3) -> bool {
    let apart = |axis: Vec3, bound: Vec3| {
        let (lo, hi) = range4(v.map(|p| dot(axis, p)));
        let radius = (dot(axis, h[0]).abs() + dot(axis, h[1]).abs()) + dot(axis, h[2]).abs();
        let limit = radius + dot(bound, slack);
        lo > limit || hi < -limit
    };
    if h.iter().any(|&a| apart(a, abs(a))) {
        return false;
    }
    let product_apart = |a: Vec3, b: Vec3| apart(cross(a, b), cross_bound(a, b));
    if FACES.iter().any(|&[p, q, r]| product_apart(sub(v[q], v[p]), sub(v[r], v[p]))) {
        return false;
    }
    !EDGES.iter().any(|&[p, q, ..]| {
        let along = sub(v[q], v[p]);
        h.iter().any(|&a| product_apart(along, a))
    })
}

/// Whether a face normal of `a` separates it from `b`.
fn face_separates(a: &[Vec3; 4], b: &[Vec3; 4]) -> bool {
    (0..4).any(|i| {
        let [p, q, r] = FACES[i];
        let (along_q, along_r) = (sub(a[q], a[p]), sub(a[r], a[p]));
        let normal = cross(along_q, along_r);
        let (own_lo, own_hi) = range4([0.0, dot(normal, sub(a[i], a[p])), dot(normal, along_q), dot(normal, along_r)]);
        let (lo, hi) = range4(b.map(|x| dot(normal, sub(x, a[p]))));
        lo > own_hi || hi < own_lo
    })
}

/// Whether two closed tetrahedra touch.
pub fn tets_touch(a: &[Vec3; 4], b: &[Vec3; 4]) -> bool {
    if a.iter().any(|p| b.contains(p)) {
        return true;
    }
    if face_separates(a, b) || face_separates(b, a) {
        return false;
    }
    for [p, q, m, n] in EDGES {
        let along_a = sub(a[q], a[p]);
        let (am, an) = (sub(a[m], a[p]), sub(a[n], a[p]));
        for [r, s, k, l] in EDGES {
            let along_b = sub(b[s], b[r]);
            let axis = cross(along_a, along_b);
            let (a_lo, a_hi) = range4([0.0, dot(axis, along_a), dot(axis, am), dot(axis, an)]);
            let (b_lo, b_hi) = range4([0.0, dot(axis, along_b), dot(axis, sub(b[k], b[r])), dot(axis, sub(b[l], b[r]))]);
            let offset = dot(axis, sub(b[r], a[p]));
            if offset > a_hi - b_lo || offset < a_lo - b_hi {
                return false;
            }
        }
    }
    true
}

/// The point of a tetrahedron that is nearest to 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    /// Squared distance, scaled by 2^-42, never below that of the tetrahedron's bounding box.
    pub square: f32,
    /// Barycentric coordinates of the point, in the order of the vertices.
    pub weights: [f32; 4],
}

/// Squared distance from 0 to the bounding box of `v`, scaled by 2^-42.
pub fn box_square(v: &[Vec3; 4]) -> f32 {
    let (lo, hi) = bounds(v);
    let d = per_axis(|c| (lo[c].max(-hi[c]).max(0.0)) * two_to(-21));
    dot(d, d)
}

/// The weights of the point of the triangle `a b c` nearest to 0. The regions of a triangle are those of Ericson,
/// Real-Time Collision Detection, 5.1.5; quotients are computed by [`reciprocal`], and products of products without
/// denormals.
fn closest_in_triangle(a: Vec3, b: Vec3, c: Vec3) -> [f32; 3] {
    let (ab, ac) = (sub(b, a), sub(c, a));
    let (d1, d2) = (-dot(ab, a), -dot(ac, a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (-dot(ab, b), -dot(ac, b));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let (d5, d6) = (-dot(ab, c), -dot(ac, c));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let part = |x: f32, whole: f32| if whole <= 0.0 { 0.0 } else { canonical(x * reciprocal(whole)).clamp(0.0, 1.0) };
    let area = |x: f32, y: f32, z: f32, w: f32| canonical(x * y) - canonical(z * w);
    let vc = canonical(area(d1, d4, d3, d2));
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = part(d1, d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    let vb = canonical(area(d5, d2, d1, d6));
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = part(d2, d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    let va = canonical(area(d3, d6, d5, d4));
    let (d43, d56) = (d4 - d3, d5 - d6);
    if va <= 0.0 && d43 >= 0.0 && d56 >= 0.0 {
        let t = part(d43, d43 + d56);
        return [0.0, 1.0 - t, t];
    }
    let sum = (va + vb) + vc;
    let (v, w) = (part(vb, sum), part(vc, sum));
    [(1.0 - v) - w, v, w]
}

/// The point of the surface of the tetrahedron `v` nearest to 0. If several faces are equally near, the one opposite to
/// the first vertex counts.
pub fn closest(v: &[Vec3; 4]) -> Closest {
    closest_on(v, [true; 4])
}

/// As [`closest`], but only of some faces, each given by the vertex opposite to it.
pub fn closest_on(v: &[Vec3; 4], faces: [bool; 4]) -> Closest {
    let s = v.map(|p| p.map(|x| x * two_to(-21)));
    let mut best = Closest { square: f32::MAX, weights: [0.0; 4] };
    for ([p, q, r], _) in FACES.into_iter().zip(faces).filter(|(_, counts)| *counts) {
        let w = closest_in_triangle(s[p], s[q], s[r]);
        let at = per_axis(|c| (w[0] * s[p][c] + w[1] * s[q][c]) + w[2] * s[r][c]);
        let square = canonical(canonical(canonical(at[0] * at[0]) + canonical(at[1] * at[1])) + canonical(at[2] * at[2]));
        if square < best.square {
            best = Closest { square, weights: [0.0; 4] };
            [best.weights[p], best.weights[q], best.weights[r]] = w;
        }
    }
    best.square = best.square.max(box_square(v));
    best
}
