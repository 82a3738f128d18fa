use super::*;
use crate::render::{Camera, MAX_SAMPLES, Projection};
use glam::dcamera::rh::proj::vulkan::{orthographic, perspective, perspective_infinite, perspective_infinite_reverse};
use glam::dcamera::rh::view::look_at_mat4;

const BOX: Bounds = Bounds { lo: [-1.0, 2.0, 0.0], hi: [9.0, 4.0, 1.5] };
const SIZE: [u32; 2] = [64, 48];
const ASPECT: f64 = 64.0 / 48.0;

/// Matrices as renderers have them: with the far plane near, far and at infinity, either way round; parallel; off the
/// centre; and with a model matrix that turns and scales.
fn views() -> Vec<(&'static str, ProjectedView)> {
    let seen_from = |eye: DVec3| look_at_mat4(eye, DVec3::new(4.0, 3.0, 0.7), DVec3::Z);
    let outside = seen_from(DVec3::new(-7.0, -9.0, 6.0));
    let lens = perspective(0.9, ASPECT, 0.1, 100.0);
    let flipped = DMat4::from_translation(DVec3::Z) * DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0));
    let shift = DMat4::from_translation(DVec3::new(0.3, -0.2, 0.0));
    let model = DMat4::from_rotation_x(0.3) * DMat4::from_scale(DVec3::splat(2.0));
    let view = |to_clip: DMat4, reversed: bool| ProjectedView { to_clip, reversed };
    vec![
        ("perspective", view(lens * outside, false)),
        ("reversed", view(flipped * lens * outside, true)),
        ("infinite", view(perspective_infinite(0.9, ASPECT, 0.1) * outside, false)),
        ("infinite, reversed", view(perspective_infinite_reverse(0.9, ASPECT, 0.1) * outside, true)),
        ("parallel", view(orthographic(-8.0, 8.0, -6.0, 6.0, 0.5, 60.0) * outside, false)),
        ("parallel, reversed", view(flipped * orthographic(-8.0, 8.0, -6.0, 6.0, 0.5, 60.0) * outside, true)),
        ("from within", view(lens * seen_from(DVec3::new(1.0, 2.5, 1.0)), false)),
        ("off the centre", view(shift * lens * outside, false)),
        ("a model that is turned", view(lens * seen_from(DVec3::new(-20.0, -25.0, 20.0)) * model, false)),
        ("in single precision", view((lens.as_mat4() * outside.as_mat4()).as_dmat4(), false)),
        (
            "near and far in single precision",
            view((perspective(0.9, ASPECT, 0.01, 1000.0).as_mat4() * outside.as_mat4()).as_dmat4(), false),
        ),
        (
            "reversed in single precision",
            view((perspective_infinite_reverse(0.9, ASPECT, 0.01).as_mat4() * outside.as_mat4()).as_dmat4(), true),
        ),
        ("mirrored", view(DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)) * lens * outside, false)),
    ]
}

#[test]
fn rays_pass_what_the_matrix_shows() {
    for (name, projected) in views() {
        let view = projected.view(SIZE, &BOX).unwrap();
        let (mut seen, mut longest) = (0, 0.0f64);
        for i in 0..4000u32 {
            // A point of the box in the middle of a pixel.
            let part = |c: u32| f64::from(i.wrapping_mul(2_654_435_761).wrapping_add(c * 977) >> (7 * c) & 127) / 127.0;
            let p = BOX.corners()[0] + (BOX.corners()[7] - BOX.corners()[0]) * DVec3::new(part(0), part(1), part(2));
            let clip = projected.to_clip * p.extend(1.0);
            let ndc = clip.truncate() / clip.w;
            if clip.w <= 0.0 || ndc.abs().max_element() > 1.0 || ndc.z < 0.0 {
                continue;
            }
            let pixel = |x: f64, n: u32| ((0.5 * x + 0.5) * f64::from(n)).floor().min(f64::from(n - 1));
            let [x, y] = [pixel(ndc.x, SIZE[0]), pixel(ndc.y, SIZE[1])];
            let centre = DVec3::new((x + 0.5) / 64.0 * 2.0 - 1.0, (y + 0.5) / 48.0 * 2.0 - 1.0, ndc.z);
            let there = projected.to_clip.inverse() * centre.extend(1.0);
            let there = there.truncate() / there.w;
            let (origin, direction) = view.rays.ray(x as u32, y as u32);
            let [origin, direction] = [origin, direction].map(|v| DVec3::from_array(v.map(f64::from)));
            let depth = ndc.z as f32;
            let steps = f64::from(view.rays.steps_to(x as u32, y as u32, depth, 10.0)) / 10.0;
            // A depth in single precision leaves a place open by this much, and a matrix by several times that.
            let next = projected.to_clip.inverse() * centre.truncate().extend(f64::from(depth.next_up())).extend(1.0);
            let roundings = if name.contains("single precision") { 8.0 } else { 2.0 };
            let unsure = 1e-4 + roundings * (next.truncate() / next.w).distance(there);
            assert!(steps >= 0.0 && (origin + direction * steps).distance(there) < unsure, "{name}: {p} in {x}, {y}: {steps}");
            (seen, longest) = (seen + 1, longest.max(steps));
        }
        assert!(seen > 200, "{name}: {seen} seen");
        assert!(longest <= view.reach * 1.001 && longest > 0.3 * view.reach, "{name}: {longest} of {}", view.reach);
        let far = if projected.reversed { 0.0 } else { 1.0 };
        if name.starts_with("infinite") {
            assert_eq!(view.rays.steps_to(3, 4, far, 10.0), MAX_SAMPLES as f32);
        } else {
            assert!(f64::from(view.rays.steps_to(3, 4, far, 10.0)) > 10.0 * longest, "{name}");
        }
    }
}

/// The view of a camera and that of its matrix are the same.
#[test]
fn cameras_are_matrices_too() {
    let (eye, target) = (DVec3::new(-7.0, -9.0, 6.0), DVec3::new(4.0, 3.0, 0.7));
    for (projection, lens) in [
        (Projection::Perspective(50.0), perspective(50f64.to_radians(), ASPECT, 0.1, 100.0)),
        (Projection::Orthographic(12.0), orthographic(-8.0, 8.0, -6.0, 6.0, 0.5, 60.0)),
    ] {
        let camera = Camera::look_at(eye, target, DVec3::Z, projection).unwrap();
        let to_clip = lens * look_at_mat4(eye, target, DVec3::Z);
        let [of_camera, of_matrix] = [camera.view(SIZE, &BOX), ProjectedView { to_clip, reversed: false }.view(SIZE, &BOX).unwrap()];
        for (a, b) in [(of_camera.right, of_matrix.right), (of_camera.up, of_matrix.up), (of_camera.forward, of_matrix.forward)] {
            assert!(a.distance(b) < 1e-9, "{a} {b}");
        }
        for (x, y) in [(0, 0), (63, 0), (20, 47)] {
            let (a, b) = (of_camera.rays.ray(x, y), of_matrix.rays.ray(x, y));
            assert!((0..3).all(|c| (a.0[c] - b.0[c]).abs() < 1e-5 && (a.1[c] - b.1[c]).abs() < 1e-6), "{a:?} {b:?}");
        }
    }
}

#[test]
fn matrices_that_show_nothing_are_refused() {
    let oblique = DMat4::from_cols_array(&[1.0, 0.0, 0.4, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.1, 0.0]);
    for (to_clip, why) in
        [(DMat4::ZERO, "without an inverse"), (DMat4::NAN, "without an inverse"), (oblique, "not parallel to the picture")]
    {
        let Err(error) = (ProjectedView { to_clip, reversed: false }).view(SIZE, &BOX) else { panic!("{why}") };
        assert!(error.to_string().contains(why), "{error}");
    }
}

/// A scene that is 2^80 times as large, or as small, is seen by the same rays.
#[test]
fn scenes_of_any_size_are_seen_alike() {
    for (name, projected) in views() {
        let as_it_is = projected.view(SIZE, &BOX).unwrap().rays;
        for exponent in [-80, 80] {
            let (scale, to_unit) = (2f32.powi(exponent), DMat4::from_scale(DVec3::splat(2f64.powi(-exponent))));
            let scaled = ProjectedView { to_clip: projected.to_clip * to_unit, ..projected };
            let bounds = Bounds { lo: BOX.lo.map(|v| v * scale), hi: BOX.hi.map(|v| v * scale) };
            let rays = scaled.view(SIZE, &bounds).unwrap().rays;
            for (x, y) in [(0, 0), (63, 0), (20, 47)] {
                let ([_, a], [_, b]) = (as_it_is.ray(x, y).into(), rays.ray(x, y).into());
                assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-6), "{name}, 2^{exponent}: {a:?} {b:?}");
                let [a, b] = [as_it_is.steps_to(x, y, 0.5, 10.0), rays.steps_to(x, y, 0.5, 10.0 / scale)];
                assert!((a - b).abs() <= 1e-3 * a.abs(), "{name}, 2^{exponent}: {a} {b}");
            }
        }
    }
}
