use super::*;

const BOX: Bounds = Bounds { lo: [-1.0, 2.0, 0.0], hi: [9.0, 4.0, 1.5] };

/// Position of a point in the picture, −1…1 on both axes.
fn project(camera: &Camera, p: DVec3, aspect: f64) -> [f64; 2] {
    let d = p - camera.eye;
    let scale = match camera.projection {
        Projection::Perspective(degrees) => 1.0 / ((degrees.to_radians() * 0.5).tan() * d.dot(camera.forward)),
        Projection::Orthographic(height) => 2.0 / height,
    };
    [d.dot(camera.right) * scale / aspect, d.dot(camera.up) * scale]
}

#[test]
fn every_view_holds_the_whole_box_and_fills_the_picture() {
    for text in ["iso", "front", "top", "-x", "azimuth=200,elevation=-35", "iso,ortho", "bottom,ortho", "fov=80", "up=1,0,0"] {
        for aspect in [0.4, 1.0, 2.5] {
            let camera = text.parse::<CameraSpec>().unwrap().resolve(&BOX, [0.0; 3], aspect).unwrap();
            let places = BOX.corners().map(|p| project(&camera, p, aspect));
            let most = places.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
            assert!((FILL - 1e-6..=FILL + 1e-6).contains(&most), "{text} {aspect}: {most}");
        }
    }
}

/// An eye fixes the direction and the centre of an orthographic picture; its height is that of the mesh seen from there.
#[test]
fn parallel_views_from_an_eye_hold_the_whole_mesh() {
    let rod = [DVec3::new(10.0, -10.0, 3.0), DVec3::new(-10.0, 10.0, -3.0)];
    let bounds = Bounds { lo: [-10.0, -10.0, -3.0], hi: [10.0, 10.0, 3.0] };
    for eye in ["eye=100,100,0,ortho", "eye=-3,2,50,target=1,2,3,ortho", "eye=0,0,9,up=1,0,0,ortho"] {
        for aspect in [0.4, 1.0, 2.5] {
            let camera = eye.parse::<CameraSpec>().unwrap().resolve_around(&bounds, &rod, [0.0; 3], aspect).unwrap();
            let most = rod.iter().flat_map(|&p| project(&camera, p, aspect)).fold(0.0, |m: f64, v| m.max(v.abs()));
            assert!((most - FILL).abs() < 1e-9, "{eye} {aspect}: {most}");
        }
    }
}

/// A camera's text gives it again, also far from 0, with its back to the mesh, and relative to an origin.
#[test]
fn a_camera_has_a_text() {
    let far = Bounds { lo: [-1e6, 2e6, 0.0], hi: [-1e6 + 9.0, 2e6 + 4.0, 1.5] };
    for bounds in [BOX, far] {
        for text in ["iso", "bottom,ortho,zoom=3", "azimuth=200,elevation=-35,fov=80", "up=1,0,0", "eye=5,1,1,target=9,-9,3,zoom=2"] {
            let camera = text.parse::<CameraSpec>().unwrap().resolve(&bounds, [5e5, -7.25, 0.0], 1.3).unwrap();
            let told = camera.text(&bounds, [5e5, -7.25, 0.0]);
            let again = told.parse::<CameraSpec>().unwrap().resolve(&bounds, [5e5, -7.25, 0.0], 0.7).unwrap();
            assert_eq!(again.projection, camera.projection, "{told}");
            assert!((again.eye - camera.eye).length() < 1e-9, "{told}: {} {}", again.eye, camera.eye);
            let pairs = [(again.forward, camera.forward), (again.right, camera.right), (again.up, camera.up)];
            assert!(pairs.iter().all(|(a, b)| (*a - *b).length() < 1e-9), "{told}: {pairs:?}");
        }
    }
}

/// A mesh with y up is seen as the mesh with z up that it is otherwise equal to, from every side.
#[test]
fn views_turn_with_up() {
    let turned = |p: DVec3| DVec3::new(p.x, p.z, -p.y);
    let near = |a: DVec3, b: DVec3, what: &str| assert!((a - b).length() < 1e-12 * (1.0 + a.length()), "{what}: {a} {b}");
    let bounds = Bounds { lo: [-1.0, 0.0, -4.0], hi: [9.0, 1.5, -2.0] };
    for text in
        ["iso", "front", "back,ortho", "left", "right", "top", "bottom", "top,azimuth=30", "azimuth=200,elevation=-35", "left,elevation=20"]
    {
        let of = |text: &str, bounds: &Bounds| text.parse::<CameraSpec>().unwrap().resolve(bounds, [0.0; 3], 1.3).unwrap();
        for (text, up) in [(format!("{text},up=0,1,0"), "after"), (format!("up=0,2,0,{text}"), "before")] {
            let what = format!("{text} {up}");
            let (z_up, y_up) =
                (of(text.replace("up=0,1,0", "up=0,0,1").replace("up=0,2,0", "up=0,0,1").as_str(), &BOX), of(&text, &bounds));
            let pairs = [(z_up.eye, y_up.eye), (z_up.forward, y_up.forward), (z_up.right, y_up.right), (z_up.up, y_up.up)];
            for (z, y) in pairs {
                near(turned(z), y, &what);
            }
        }
        assert_eq!(of(text, &BOX), of(&format!("{text},up=0,0,1"), &BOX), "{text}: z is up");
    }
    // Axes of the coordinates stay where they are.
    let along = |text: &str| text.parse::<CameraSpec>().unwrap().resolve(&BOX, [0.0; 3], 1.0).unwrap().forward;
    near(along("-y,up=1,0,0"), DVec3::Y, "-y");
    near(along("+z,up=0,1,0"), DVec3::NEG_Z, "+z");
    for up in [DVec3::X, DVec3::NEG_Z, DVec3::new(0.6, 0.0, -0.8)] {
        let axes = upright(up);
        near(axes.x_axis.cross(axes.y_axis), up, "right-handed");
        near(axes.z_axis, up, "up");
        assert!((axes.determinant() - 1.0).abs() < 1e-12, "{axes}");
    }
}

/// Straight above and below, the azimuth turns the picture as it does just beside them.
#[test]
fn azimuth_counts_above_and_below() {
    let camera = |text: &str| text.parse::<CameraSpec>().unwrap().resolve(&BOX, [0.0; 3], 1.0).unwrap();
    for azimuth in [0, 45, 200] {
        for (pole, beside) in [("top", "elevation=89.9999"), ("bottom", "elevation=-89.9999"), ("elevation=90", "elevation=89.9999")] {
            let [pole, beside] = [pole, beside].map(|text| camera(&format!("{text},azimuth={azimuth}")));
            assert!((pole.up - beside.up).length() < 1e-4 && (pole.right - beside.right).length() < 1e-4, "{azimuth}: {pole:?} {beside:?}");
        }
    }
    assert_eq!([camera("top").up, camera("bottom").up], [DVec3::Y; 2]);
    let low = camera("top,elevation=30").forward;
    assert!(low.y > 0.8 && low.x.abs() < 1e-12, "from the front: {low}");
}

/// What is looked at lies in the middle of the picture, whatever the projection.
#[test]
fn a_target_lies_in_the_middle() {
    let target = DVec3::new(0.5, 0.25, 1.0);
    for view in ["iso", "azimuth=20,elevation=70", "front,zoom=3", "iso,ortho"] {
        let camera = format!("{view},target=0.5,0.25,1").parse::<CameraSpec>().unwrap().resolve(&BOX, [0.0; 3], 1.5).unwrap();
        let way = target - camera.eye;
        assert!(
            way.dot(camera.right).abs() < 1e-12 && way.dot(camera.up).abs() < 1e-12 && way.dot(camera.forward) > 0.0,
            "{view}: {camera:?}"
        );
    }
}

#[test]
fn origin_of_the_source_is_subtracted() {
    let spec: CameraSpec = "eye=1e7,0,0,target=1e7,1,0".parse().unwrap();
    let camera = spec.resolve(&BOX, [1e7, 0.0, 0.0], 1.0).unwrap();
    assert_eq!(camera.eye, DVec3::ZERO);
    assert_eq!(camera.forward, DVec3::Y);
    assert_eq!(camera.right, DVec3::X);
    assert_eq!(camera.up, DVec3::Z);
}

#[test]
fn rays_pass_through_their_pixels() {
    for text in ["iso", "front,ortho", "eye=3,3,0.5,target=4,3,0.5,fov=90"] {
        let camera = text.parse::<CameraSpec>().unwrap().resolve(&BOX, [0.0; 3], 1.5).unwrap();
        let size = [30, 20];
        let rays = camera.rays(size, &BOX);
        for (x, y) in [(0, 0), (29, 0), (7, 13), (15, 19)] {
            let (o, d) = rays.ray(x, y);
            let at = DVec3::from_array(o.map(f64::from)) + DVec3::from_array(d.map(f64::from)) * 2.0;
            let [s, t] = project(&camera, at, 1.5);
            let expected = [(f64::from(x) + 0.5) / 15.0 - 1.0, 1.0 - (f64::from(y) + 0.5) / 10.0];
            assert!((s - expected[0]).abs() < 1e-5 && (t - expected[1]).abs() < 1e-5, "{text} {x} {y}: {s} {t} {expected:?}");
            let length: f32 = d.iter().map(|v| v * v).sum();
            assert!((length - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn rays_start_before_the_box() {
    let camera = CameraSpec::default().resolve(&BOX, [0.0; 3], 1.0).unwrap();
    let rays = camera.rays([8, 8], &BOX);
    for p in BOX.corners() {
        let [o, d] = {
            let (o, d) = rays.ray(3, 4);
            [o, d].map(|v| DVec3::from_array(v.map(f64::from)))
        };
        assert!((p - o).dot(camera.forward) > -1e-4, "{p} {o} {d}");
    }
}

#[test]
fn bad_texts_are_refused_with_the_part_and_the_help() {
    for (text, part) in [
        ("sideways", "sideways"),
        ("eye=1,2", "eye=1,2"),
        ("top,eye=1,nan,2", "eye=1,nan,2"),
        ("zoom=0", "zoom=0"),
        ("up=0,0,0", "up=0,0,0"),
        ("fov=200", "fov=200"),
        ("colour=3", "colour=3"),
        ("zoom=1,2,top", "zoom=1,2"),
    ] {
        let message = text.parse::<CameraSpec>().unwrap_err().to_string();
        assert!(message.contains(&format!("`{part}`")) && message.contains("azimuth"), "{message}");
    }
    for (text, part) in [
        ("fov=20,ortho", "fov and ortho"),
        ("iso,top", "`top` is a second view"),
        ("top,zoom=1,zoom=2", "`zoom=2` is a second zoom"),
        ("az=3,azimuth=3", "second azimuth"),
        ("ortho=2,ortho", "second ortho"),
        ("iso,eye=1,2,3", "eye and view"),
        ("eye=1,2,3,azimuth=3", "eye and azimuth"),
        ("elevation=3,eye=1,2,3", "eye and elevation"),
        ("top,azimuth=3,elevation=4", "two of the three"),
    ] {
        let message = text.parse::<CameraSpec>().unwrap_err().to_string();
        assert!(message.contains(part), "{text}: {message}");
    }
    for text in ["front,elevation=20,zoom=2", "eye=1,2,3,target=0,0,0,up=0,1,0,fov=40,zoom=2", "azimuth=1,elevation=2,ortho=3"] {
        text.parse::<CameraSpec>().unwrap();
    }
    let same: CameraSpec = "eye=1,1,1,target=1,1,1".parse().unwrap();
    assert!(same.resolve(&BOX, [0.0; 3], 1.0).is_err());
}

#[test]
fn degenerate_boxes_have_a_camera() {
    for bounds in
        [Bounds { lo: [1.0; 3], hi: [1.0; 3] }, Bounds { lo: [0.0; 3], hi: [1e-30, 0.0, 0.0] }, Bounds { lo: [-1e37; 3], hi: [1e37; 3] }]
    {
        for text in ["iso", "top", "ortho"] {
            let camera = text.parse::<CameraSpec>().unwrap().resolve(&bounds, [0.0; 3], 1.0).unwrap();
            let (o, d) = camera.rays([4, 4], &bounds).ray(2, 2);
            assert!(o.iter().chain(&d).all(|v| v.is_finite()), "{bounds:?} {text} {o:?} {d:?}");
        }
    }
}
