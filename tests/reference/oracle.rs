//! Separations in double precision by brute force, against which slices and overlaps are judged.

/// A point.
pub type P = [f64; 3];

pub fn sub(a: P, b: P) -> P {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn dot(a: P, b: P) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: P, b: P) -> P {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn normals(v: &[P; 4]) -> Vec<P> {
    [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]].iter().map(|&[p, q, r]| cross(sub(v[q], v[p]), sub(v[r], v[p]))).collect()
}

fn edges(v: &[P; 4]) -> Vec<P> {
    (0..4).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| sub(v[i], v[j])).collect()
}

/// The largest gap between two sets of points along any of the axes; if it is negative, they overlap by that much along
/// every axis. Axes of almost no length are ignored.
fn gap(axes: impl Iterator<Item = P>, a: &[P], b: &[P], size: f64) -> f64 {
    let mut largest = f64::NEG_INFINITY;
    for axis in axes {
        let length = dot(axis, axis).sqrt();
        if length <= 1e-9 * size * size {
            continue;
        }
        let range =
            |s: &[P]| s.iter().map(|&p| dot(axis, sub(p, a[0])) / length).fold((f64::MAX, f64::MIN), |r, x| (r.0.min(x), r.1.max(x)));
        let (ra, rb) = (range(a), range(b));
        largest = largest.max(rb.0 - ra.1).max(ra.0 - rb.1);
    }
    largest
}

/// The gap between a tetrahedron and the box `centre ± half`.
pub fn box_gap(v: &[P; 4], centre: P, half: &[P; 3]) -> f64 {
    let corner = |i: usize| [0, 1, 2].map(|c| (0..3).fold(centre[c], |x, a| if i >> a & 1 == 0 { x - half[a][c] } else { x + half[a][c] }));
    let corners: Vec<P> = (0..8).map(corner).collect();
    // The coordinate axes alone separate most pairs.
    let quick = gap([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter(), v, &corners, 0.0);
    if quick > 0.0 {
        return quick;
    }
    let unit = half.map(|h| h.map(|x| x / dot(h, h).sqrt()));
    let along = edges(v);
    let axes = unit.into_iter().chain(normals(v)).chain(along.into_iter().flat_map(|e| unit.map(|u| cross(e, u))));
    gap(axes, v, &corners, 0.0)
}

/// The gap between two tetrahedra.
pub fn tet_gap(a: &[P; 4], b: &[P; 4], size: f64) -> f64 {
    let (ea, eb) = (edges(a), edges(b));
    let products = ea.iter().flat_map(|&x| eb.iter().map(move |&y| cross(x, y)));
    gap(normals(a).into_iter().chain(normals(b)).chain(products), a, b, size)
}

/// The distance of a point from the surface of a tetrahedron.
pub fn distance(v: &[P; 4], p: P) -> f64 {
    let v = v.map(|x| sub(x, p));
    let segment = |a: P, b: P| {
        let d = sub(b, a);
        let t = if dot(d, d) > 0.0 { (-dot(a, d) / dot(d, d)).clamp(0.0, 1.0) } else { 0.0 };
        let x = [0, 1, 2].map(|c| a[c] + t * d[c]);
        dot(x, x).sqrt()
    };
    let triangle = |a: P, b: P, c: P| {
        let n = cross(sub(b, a), sub(c, a));
        let edge = segment(a, b).min(segment(b, c)).min(segment(c, a));
        let within = [(a, b), (b, c), (c, a)].iter().all(|&(x, y)| dot(cross(sub(y, x), n), x) >= 0.0);
        if within && dot(n, n) > 0.0 { edge.min(dot(n, a).abs() / dot(n, n).sqrt()) } else { edge }
    };
    triangle(v[1], v[2], v[3]).min(triangle(v[0], v[2], v[3])).min(triangle(v[0], v[1], v[3])).min(triangle(v[0], v[1], v[2]))
}
