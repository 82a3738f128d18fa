use super::*;
use crate::render::TransferFunction;

const BOX: Bounds = Bounds { lo: [0.0; 3], hi: [3.0, 4.0, 12.0] };

#[test]
fn opacity_is_independent_of_the_step() {
    let through = |step: f64| {
        let settings = RenderSettings { step: Some(step), ..RenderSettings::default() };
        let plan = PicturePlan::new(&settings, &BOX, [0.0; 3], Some([0.0, 1.0])).unwrap();
        // Transparency of one unit (1/100 of 13) at the top of the range.
        (1.0 - plan.lookup(1.0)[3]).powf(0.13 / plan.step)
    };
    let expected = 1.0 - TransferFunction::default().at(1.0)[3];
    for step in [0.13, 0.01, 0.001] {
        assert!((through(step) - expected).abs() < 1e-3, "{step}: {} {expected}", through(step));
    }
}

#[test]
fn lookups_follow_the_function_and_clamp() {
    let settings = RenderSettings { step: Some(0.13), ..RenderSettings::default() };
    let plan = PicturePlan::new(&settings, &BOX, [0.0; 3], Some([100.0, 300.0])).unwrap();
    for (value, place) in [(100.0, 0.0), (150.0, 0.25), (213.0, 0.565), (300.0, 1.0), (99.0, 0.0), (f32::MAX, 1.0), (f32::MIN, 0.0)] {
        let (got, expected) = (plan.lookup(value), settings.transfer.at(place));
        assert!((0..4).all(|c| (got[c] - expected[c]).abs() < 2e-3), "{value}: {got:?} {expected:?}");
    }
}

#[test]
fn constant_and_odd_ranges_have_lookups() {
    for range in [None, Some([5.0, 5.0]), Some([0.0, 0.0]), Some([f32::MIN, f32::MAX]), Some([1e-40, 2e-40])] {
        let plan = PicturePlan::new(&RenderSettings::default(), &BOX, [0.0; 3], range).unwrap();
        for v in [0.0, 5.0, f32::MAX, f32::MIN] {
            assert!(plan.lookup(v).iter().all(|c| (0.0..=1.0).contains(c)), "{range:?} {v} {:?}", plan.lookup(v));
        }
    }
    let plan = PicturePlan::new(&RenderSettings::default(), &BOX, [0.0; 3], Some([5.0, 5.0])).unwrap();
    assert_eq!(((5.0 - plan.value_lo) * plan.value_scale * 10.0).round(), 5.0);
}

#[test]
fn sample_numbers_are_held_down() {
    let camera = |eye: [f64; 3], target: [f64; 3]| {
        Camera::look_at(DVec3::from_array(eye), DVec3::from_array(target), DVec3::Z, Projection::Perspective(179.0)).unwrap()
    };
    let plan = |camera: &Camera, step: f64| {
        let settings = RenderSettings { size: [16_384, 1], step: Some(step), ..RenderSettings::default() };
        PicturePlan::with_camera(&settings, camera, &BOX, [0.0; 3], None)
    };
    // One camera is far beside the box, which appears at the edge of a very wide picture; the other is equally far
    // in front of it.
    let (beside, before) = (camera([1e7, 0.0, 6.0], [1e7, 1.0, 6.0]), camera([1e7, 2.0, 6.0], [0.0, 2.0, 6.0]));
    assert!(plan(&beside, 0.1).unwrap_err().to_string().contains("step of 8.9"));
    assert!(plan(&beside, 0.9).is_ok() && plan(&before, 0.1).is_ok());
}

#[test]
fn steps_out_of_proportion_are_refused() {
    for (step, why) in [
        (1e-5, "1e-5 is too small for a mesh of diagonal 1.3e1; take at least 1.983642578125e-4"),
        (14.0, "1.4e1 is longer than the diagonal of the mesh; take 1.3e1 at most"),
        (1e39, "1e39 is longer than the diagonal"),
    ] {
        let settings = RenderSettings { step: Some(step), ..RenderSettings::default() };
        let message = PicturePlan::new(&settings, &BOX, [0.0; 3], None).unwrap_err().to_string();
        assert!(message.contains(why), "{message}");
    }
}

#[test]
fn rays_that_are_no_numbers_are_refused() {
    let plan = |camera: &str| {
        let settings = RenderSettings { camera: camera.parse().unwrap(), ..RenderSettings::default() };
        PicturePlan::new(&settings, &BOX, [0.0; 3], None).map_err(|error| error.to_string())
    };
    for (camera, why) in [
        ("ortho=1e39", "a picture 1e39 high, with rays beyond"),
        ("ortho=3,zoom=1e-40", "with rays beyond"),
        ("eye=1e39,0,0,ortho", "an eye at a distance of 1.0e39"),
        ("eye=1e39,0,0", "an eye at a distance of 1.0e39"),
    ] {
        assert!(plan(camera).is_err_and(|message| message.contains(why)), "{camera}: {:?}", plan(camera).map(|plan| plan.rays));
    }
    for camera in ["ortho=1e20", "eye=1e10,0,0,ortho", "eye=1e10,0,0,fov=1e-7", "zoom=1e20", "zoom=1e-300", "fov=179"] {
        assert!(plan(camera).is_ok(), "{camera}: {:?}", plan(camera));
    }
}

/// Places that are values stay where they are when a range is given, whatever part of them it covers.
#[cfg(feature = "formats")]
#[test]
fn values_as_places_do_not_move_with_the_range() {
    let file = |range: &str| {
        let text = format!(
            r##"{{"colors": [[0, "#000"], [500, "#fff"]], "opacity": [[0, 0], [50, 0], [50, 0.4], [500, 0.4]], "positions": "values"{range}}}"##
        );
        TransferFunction::from_json(&text).unwrap()
    };
    let fraction = |v: f32| v / 500.0;
    for (transfer, range) in [
        (file(""), None),
        (file(""), Some([20.0, 95.0])),
        (file(", \"range\": [20, 95]"), None),
        (file(", \"range\": [20, 95]"), Some([-500.0, 1500.0])),
    ] {
        let unit = BOX.diagonal() * OPACITY_UNIT;
        let settings = RenderSettings { transfer: transfer.clone(), range, step: Some(unit), ..RenderSettings::default() };
        let plan = PicturePlan::new(&settings, &BOX, [0.0; 3], Some([7.0, 8.0])).unwrap();
        for value in [21.0, 30.0, 47.0, 53.0, 94.0] {
            let ([r, _, _, a], opacity) = (plan.lookup(value), if value < 50.0 { 0.0 } else { 0.4 });
            assert!((r - fraction(value)).abs() < 1e-3 && (a - opacity).abs() < 1e-3, "{range:?}: {value} {r} {a}");
        }
        // Opacities that are given beside the file have places from 0 to 1.
        let transfer = transfer.with_opacity(vec![(0.0, 0.0), (1.0, 0.5)]).unwrap();
        let plan = PicturePlan::new(&RenderSettings { transfer, ..settings }, &BOX, [0.0; 3], None).unwrap();
        let [lo, hi] = [0.0, 1.0].map(|place| plan.value_lo + place / plan.value_scale);
        assert!(plan.lookup(lo)[3] < 1e-3 && (plan.lookup(hi)[3] - 0.5).abs() < 1e-3, "{range:?}");
        assert!((plan.lookup(30.0)[0] - fraction(30.0)).abs() < 1e-3, "{range:?}");
    }
}

#[test]
fn pixels_are_means_of_rays() {
    let settings = RenderSettings { size: [5, 4], background: Background::Transparent, ..RenderSettings::default() };
    let plan = PicturePlan::new(&settings, &BOX, [0.0; 3], None).unwrap();
    let colors: Vec<_> = (0..20).map(|ray| [f32::from(ray == 6), 0.0, 0.0, f32::from(ray == 6 || ray == 7)]).collect();
    let alone = plan.pixels(&colors, 1);
    assert_eq!((alone.len(), &alone[24..32]), (80, &[255, 0, 0, 255, 0, 0, 0, 255][..]));
    // Rays 6 and 7 belong to different pixels; the fifth column of rays is left out.
    let opaque = 64; // a quarter of 255
    let expected = [[255, 0, 0, opaque], [0, 0, 0, opaque], [0; 4], [0; 4]].concat();
    assert_eq!(plan.pixels(&colors, 2), expected);
    assert_eq!(plan.pixels(&colors[..12], 2), expected[..8], "rows that are not there");
    assert_eq!((plan.pixels(&colors, 0), plan.pixels(&colors, 6), plan.pixels(&colors, u32::MAX)), (alone, Vec::new(), Vec::new()));
}
