//! Pictures of the CPU reference: they do not depend on the tree, equal those of brute force, and equal a stored one.

#![allow(clippy::unwrap_used)]

use glam::DVec3;
use olbvh::grid::CellRange;
use olbvh::mesh::{Bounds, Field, Mesh, On, cases, kuhn, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions};
use olbvh::query::SILENT;
use olbvh::reference::boundary::{Topology, topology};
use olbvh::reference::build::build;
use olbvh::reference::volume::{Drawing, Picture, brute_force, render};
use olbvh::render::{Background, Clip, ClipPlace, RenderSettings, RenderStats, TransferFunction};

/// A jittered grid with the analytic field, moved away from the origin.
fn grid(cells: [u32; 3]) -> Mesh {
    let mut mesh = kuhn_jittered(cells, 0.3, 5).unwrap();
    mesh.points.iter_mut().for_each(|p| *p = [p[0] * 0.7 - 3.0, p[1] + 11.0, p[2] * 1.3]);
    mesh
}

fn settings(camera: &str) -> RenderSettings {
    let opacity = TransferFunction::parse_opacity("0:0.05,0.4:0.2,1:0.9").unwrap();
    let transfer = TransferFunction::named("viridis").unwrap().with_opacity(opacity).unwrap();
    RenderSettings { size: [36, 30], camera: camera.parse().unwrap(), transfer, ..RenderSettings::default() }
}

/// A picture with a ray per pixel, and what it cost.
struct Drawn {
    pixels: Vec<u8>,
    stats: RenderStats,
}

impl Drawn {
    fn of(scene: &Drawing<'_>) -> Self {
        let Picture { colors, stats, .. } = render(scene, SILENT).unwrap();
        Self { pixels: scene.plan().pixels(&colors, 1), stats }
    }
}

fn draw(mesh: &Mesh, topology: &Topology, options: &BuildOptions, settings: &RenderSettings) -> Drawn {
    let tree = build(mesh, topology, options).unwrap();
    Drawn::of(&Drawing::new(mesh, topology, &tree, &mesh.fields[0], settings).unwrap())
}

/// The largest difference between two pictures.
fn distance(a: &[u8], b: &[u8]) -> u8 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}

/// Each sample belongs to one of two halves of the octree cells, on whatever axis these are cut.
#[test]
fn parts_share_the_samples() {
    let mesh = grid([7, 6, 5]);
    let topology = topology(&mesh).unwrap();
    let tree = build(&mesh, &topology, &BuildOptions::default()).unwrap();
    let mut crossed = 0;
    for camera in ["iso", "azimuth=200,elevation=-35,ortho", "eye=-0.5,14,4,target=0,15,4,fov=100"] {
        let settings = RenderSettings { size: [24, 20], termination: 1.0, ..settings(camera) };
        let samples = |part| {
            let scene = Drawing::new(&mesh, &topology, &tree, &mesh.fields[0], &settings).unwrap();
            render(&scene.within(part), SILENT).unwrap().stats.found_samples
        };
        let all = samples(CellRange::WHOLE);
        for axis in 0..3 {
            let (mut low, mut high) = (CellRange::WHOLE, CellRange::WHOLE);
            (low.hi[axis], high.lo[axis]) = (511, 512);
            let [low, high] = [low, high].map(samples);
            assert_eq!(low + high, all, "{camera}");
            crossed += u32::from(low > 100 && high > 100);
        }
    }
    assert!(crossed >= 6, "{crossed}");
}

#[test]
fn the_picture_does_not_depend_on_the_tree() {
    let mesh = grid([9, 7, 6]);
    let topology = topology(&mesh).unwrap();
    for camera in ["iso", "top,ortho", "eye=-0.5,14,4,target=0,15,4,fov=100"] {
        let settings = settings(camera);
        let first = draw(&mesh, &topology, &BuildOptions::default(), &settings);
        assert!(
            first.stats.found_samples > 5_000 && first.stats.samples >= first.stats.found_samples,
            "{camera}: {} {}",
            first.stats.samples,
            first.stats.found_samples
        );
        for assign in Assign::EVERY {
            for alpha in [0.0, 1.0, 2.0] {
                let other = draw(&mesh, &topology, &BuildOptions { alpha, assign, ..BuildOptions::default() }, &settings);
                let d = distance(&first.pixels, &other.pixels);
                assert!(d <= 1, "{camera}, alpha {alpha}, {assign}: pixels differ by {d}");
                assert_eq!(first.stats.found_samples, other.stats.found_samples, "{camera}, alpha {alpha}, {assign}");
            }
        }
    }
}

/// Asserts that the picture and the oracle differ by more than 2/255 in at most a thousandth of the pixels.
fn assert_as_brute_force(what: &str, mesh: &Mesh, settings: &RenderSettings) {
    let topology = topology(mesh).unwrap();
    let tree = build(mesh, &topology, &BuildOptions::default()).unwrap();
    let scene = Drawing::new(mesh, &topology, &tree, &mesh.fields[0], settings).unwrap();
    let expected = brute_force(&scene, settings, &Bounds::from(&tree.grid));
    let picture = Drawn::of(&scene);
    let off = picture.pixels.chunks(4).zip(expected.chunks(4)).filter(|(a, b)| distance(a, b) > 2).count();
    assert!(off * 1000 <= expected.len() / 4, "{what}: {off} of {} pixels differ", expected.len() / 4);
    assert!(picture.stats.found_samples > 1000, "{what}: an empty picture proves nothing");
}

#[test]
fn pictures_agree_with_brute_force() {
    let mesh = grid([4, 3, 3]);
    for camera in ["iso", "front,ortho", "azimuth=210,elevation=-40,zoom=2", "eye=-2,13,2,target=0,12,2,fov=80"] {
        assert_as_brute_force(camera, &mesh, &settings(camera));
    }
    let plain = RenderSettings { shading: false, background: Background::Transparent, opacity_scale: 3.0, ..settings("iso") };
    assert_as_brute_force("without shading", &mesh, &plain);
    for clips in ["view", "x=60% -x=90% 1,2,3=60%"] {
        let clips = clips.split_whitespace().map(|clip| clip.parse().unwrap()).collect();
        assert_as_brute_force("clipped", &mesh, &RenderSettings { clips, ..settings("iso") });
    }
    assert_as_brute_force("coarse step", &mesh, &RenderSettings { step: Some(0.21), termination: 0.7, ..settings("iso") });
}

/// A depth buffer hides what a clip along the view leaves out, in the volume and of iso-surfaces.
#[test]
fn a_depth_ends_rays_as_a_clip_does() {
    let mesh = grid([6, 5, 4]);
    let topology = topology(&mesh).unwrap();
    let tree = build(&mesh, &topology, &BuildOptions::default()).unwrap();
    let eye = DVec3::new(-9.0, 30.0, 21.0);
    let forward = (DVec3::new(-1.0, 13.0, 3.0) - eye).normalize();
    for camera in ["eye=-9,30,21,target=-1,13,3,fov=30", "eye=-9,30,21,target=-1,13,3,ortho"] {
        for iso in [vec![], vec![0.2, 0.7]] {
            let settings = RenderSettings { iso, ..settings(camera) };
            let scene = |settings: &RenderSettings| Drawing::new(&mesh, &topology, &tree, &mesh.fields[0], settings).unwrap();
            let whole = scene(&settings);
            let depth = 25.0;
            let cut = Clip { direction: Some(forward), place: ClipPlace::At(forward.dot(eye) + depth) };
            let cut = Drawn::of(&scene(&RenderSettings { clips: vec![cut], ..settings.clone() }));
            let depths = vec![depth as f32; 36 * 30];
            let hidden = Drawn::of(&scene(&settings).before(&depths));
            let whole = Drawn::of(&whole);
            // A sample that lies on the plane may count either way.
            let differ = cut.pixels.chunks(4).zip(hidden.pixels.chunks(4)).filter(|(a, b)| distance(a, b) > 1).count();
            assert!(differ <= 2 && cut.stats.found_samples.abs_diff(hidden.stats.found_samples) <= 2, "{camera}: {differ} pixels");
            assert!(
                hidden.stats.found_samples * 5 < whole.stats.found_samples * 4 && hidden.stats.found_samples > 2000,
                "{:?}",
                hidden.stats
            );
            // What is not a number, or infinite, hides nothing.
            let far = [f32::NAN, f32::INFINITY, 1e30, -0.0, -3.0];
            let depths: Vec<f32> = (0..36 * 30).map(|i| far[usize::from(i >= 540) * 3 + i % if i < 540 { 3 } else { 2 }]).collect();
            let half = Drawn::of(&scene(&settings).before(&depths));
            let (shown, blank) = (half.pixels.split_at(540 * 4), whole.pixels.split_at(540 * 4));
            assert!(shown.0 == blank.0, "nothing is hidden");
            let nothing = Drawn::of(&scene(&RenderSettings { clips: vec!["view=0%".parse().unwrap()], ..settings.clone() }));
            assert!(shown.1 == nothing.pixels.split_at(540 * 4).1, "everything is hidden");
        }
    }
}

#[test]
fn skipped_samples_have_nothing_to_add() {
    let narrow = TransferFunction::parse_opacity("0:0,0.5:0,0.52:0.9,0.54:0,1:0").unwrap();
    let peak = |camera: &str| RenderSettings {
        transfer: TransferFunction::named("viridis").unwrap().with_opacity(narrow.clone()).unwrap(),
        ..settings(camera)
    };
    for camera in ["iso", "front,ortho", "eye=-0.5,14,4,target=0,15,4,fov=100"] {
        let mut mesh = grid([14, 12, 10]);
        let topology = topology(&mesh).unwrap();
        for on in [On::Points, On::Cells] {
            if on == On::Cells {
                mesh.fields[0] = Field { name: "id".into(), on, values: (0..mesh.tets.len()).map(|i| ((i / 1200) % 9) as f32).collect() };
                mesh.fields[0].values[40] = f32::NAN;
            }
            let settings = RenderSettings { range: (on == On::Cells).then_some([0.0, 7.7]), ..peak(camera) };
            let tree = build(&mesh, &topology, &BuildOptions::default()).unwrap();
            let scene = Drawing::new(&mesh, &topology, &tree, &mesh.fields[0], &settings).unwrap();
            let picture = Drawn::of(&scene);
            let every = Drawn::of(&scene.without_skipping());
            assert_eq!(picture.pixels, every.pixels, "{camera} {on:?}");
            assert!(picture.stats.skipped_samples > 0 && every.stats.skipped_samples == 0, "{camera} {on:?}");
            assert!(picture.stats.samples < every.stats.samples, "{camera} {on:?}: {} of {}", picture.stats.samples, every.stats.samples);
            assert!(picture.pixels.iter().any(|&p| p != 255), "{camera} {on:?}: an empty picture proves nothing");
        }
    }
}

#[test]
fn fields_of_cells_and_holes_in_fields_agree_with_brute_force() {
    let mut mesh = grid([3, 3, 2]);
    let n = mesh.tets.len();
    mesh.fields = vec![Field { name: "id".into(), on: On::Cells, values: (0..n).map(|i| (i % 7) as f32).collect() }];
    assert_as_brute_force("cells", &mesh, &settings("iso"));
    for (i, v) in mesh.fields[0].values.iter_mut().enumerate() {
        *v = if i % 3 == 0 { f32::NAN } else { *v };
    }
    assert_as_brute_force("cells with NaN", &mesh, &settings("iso"));
}

/// The iso-surfaces of a field that is linear in space are planes. A pixel shows the plane that its ray meets first
/// within the mesh, in the single colour that a plane has in parallel light; or, where one is seen through the other,
/// both. This holds for every tree.
#[test]
fn surfaces_of_a_linear_field_are_planes() {
    let mut mesh = kuhn([9, 8, 10]).unwrap();
    let (lo, hi) = ([-3.0f32, 11.0, 0.5], [1.5f32, 15.0, 6.5]);
    mesh.points.iter_mut().for_each(|p| *p = [0, 1, 2].map(|c| lo[c] + p[c] * (hi[c] - lo[c]) / [9.0, 8.0, 10.0][c]));
    let gradient = [0.6f32, -0.3, 1.0];
    let value = |p: [f32; 3]| (0..3).map(|c| gradient[c] * p[c]).sum::<f32>();
    mesh.fields = vec![Field { name: "linear".into(), on: On::Points, values: mesh.points.iter().map(|&p| value(p)).collect() }];
    let topology = topology(&mesh).unwrap();
    let isos = [-2.0, 0.5];
    for (opacity, shading, clips) in [(None, true, ""), (Some(0.5), false, ""), (Some(0.5), false, "view=80% 0.3,-1,0.2=85%")] {
        let mut transfer = TransferFunction::named("viridis").unwrap();
        if let Some(opacity) = opacity {
            transfer = transfer.with_opacity(vec![(0.0, opacity), (1.0, opacity)]).unwrap();
        }
        let settings = RenderSettings {
            transfer,
            iso: vec![isos[1], isos[0], isos[1]],
            clips: clips.split_whitespace().map(|clip| clip.parse().unwrap()).collect(),
            shading,
            outline: 0.0,
            step: Some(0.05),
            background: Background::Transparent,
            ..settings("iso,ortho")
        };
        let tree = build(&mesh, &topology, &BuildOptions::default()).unwrap();
        let scene = Drawing::new(&mesh, &topology, &tree, &mesh.fields[0], &settings).unwrap();
        let picture = Drawn::of(&scene);
        assert!(picture.stats.skipped_samples > 1000, "{}", picture.stats.skipped_samples);
        for options in [
            BuildOptions { alpha: 1.0, assign: Assign::Exact, ..BuildOptions::default() },
            BuildOptions { alpha: 4.0, ..BuildOptions::default() },
        ] {
            assert_eq!(draw(&mesh, &topology, &options, &settings).pixels, picture.pixels, "{options:?}");
        }
        let plan = scene.plan();
        let mut seen = std::collections::BTreeMap::<String, (Vec<u8>, u32)>::new();
        for (i, pixel) in picture.pixels.chunks(4).enumerate() {
            let (origin, direction) = plan.rays.ray(i as u32 % plan.size[0], i as u32 / plan.size[0]);
            let rise: f32 = (0..3).map(|c| gradient[c] * direction[c]).sum();
            // The planes that the ray meets, by distance. Pixels with one right on the surface of the mesh are left out,
            // but none beside it: a surface reaches that of the mesh.
            let mut hits: Vec<(f32, f32)> = isos.iter().map(|&iso| ((iso - value(origin)) / rise, iso)).collect();
            hits.sort_by(|a, b| a.0.total_cmp(&b.0));
            let depth = |t: f32| {
                let at = [0, 1, 2].map(|c| origin[c] + t * direction[c]);
                let beside = plan.clips.iter().map(|n| n[3] - (0..3).map(|c| n[c] * at[c]).sum::<f32>());
                (0..3).map(|c| (at[c] - lo[c]).min(hi[c] - at[c])).chain(beside).fold(f32::MAX, f32::min)
            };
            // A wedge between clips may be thinner than a step, without any sample.
            let is_sampled = || (0..300).any(|k| depth((k as f32 + 0.5) * plan.step) > 0.0);
            if hits.iter().any(|&(t, _)| depth(t).abs() < 1e-4) || !clips.is_empty() && !is_sampled() {
                continue;
            }
            let what = format!(
                "{:?}",
                hits.iter().filter(|&&(t, _)| depth(t) > 0.0).map(|h| h.1).take(if opacity.is_none() { 1 } else { 2 }).collect::<Vec<_>>()
            );
            let (first, n) = seen.entry(what.clone()).or_insert((pixel.to_vec(), 0));
            assert!(distance(first, pixel) <= 1, "{what} {opacity:?}: {first:?} {pixel:?}");
            *n += 1;
            let covered = if what == "[]" { 0.0 } else { 1.0 - (1.0 - opacity.unwrap_or(1.0)).powi(what.matches(',').count() as i32 + 1) };
            assert!((f32::from(pixel[3]) - 255.0 * covered).abs() <= 1.0, "{what} {opacity:?}: {pixel:?}");
        }
        assert!(seen.len() >= 3 && seen.values().all(|(_, n)| *n > 20), "{seen:?}");
        let colors: std::collections::BTreeSet<_> = seen.values().map(|(pixel, _)| pixel).collect();
        assert_eq!(colors.len(), seen.len(), "{seen:?}");
    }
    mesh.fields[0] = Field { name: "id".into(), on: On::Cells, values: vec![0.5; mesh.tets.len()] };
    let tree = build(&mesh, &topology, &BuildOptions::default()).unwrap();
    let settings = RenderSettings { iso: vec![0.5], ..RenderSettings::default() };
    let error = Drawing::new(&mesh, &topology, &tree, &mesh.fields[0], &settings).err().unwrap().to_string();
    assert!(error.contains("a field of cells"), "{error}");
}

#[test]
fn every_odd_mesh_has_a_picture() {
    for case in cases::cases().unwrap() {
        let mut mesh = case.mesh;
        let values = mesh.points.iter().map(|p| p[0]).collect();
        mesh.fields = vec![Field { name: "x".into(), on: On::Points, values }];
        let topology = topology(&mesh).unwrap();
        for camera in ["iso", "+z,ortho"] {
            let settings = RenderSettings { size: [16, 12], camera: camera.parse().unwrap(), ..RenderSettings::default() };
            let picture = draw(&mesh, &topology, &BuildOptions::default(), &settings);
            assert_eq!(picture.pixels.len(), 16 * 12 * 4, "{}", case.name);
            if topology.valid_cells() == topology.counts.flat {
                assert!(picture.pixels.iter().all(|&p| p == 255), "{}: nothing to see", case.name);
            }
        }
    }
}

/// With y up, a mesh looks as it does with its axes exchanged and z up.
#[test]
fn meshes_with_y_up_look_alike() {
    let small = grid([5, 5, 4]);
    let mut turned = small.clone();
    turned.points.iter_mut().for_each(|p| *p = [p[0], p[2], -p[1]]);
    let picture = |mesh: &Mesh, camera: &str| draw(mesh, &topology(mesh).unwrap(), &BuildOptions::default(), &settings(camera)).pixels;
    for camera in ["iso", "front", "right,ortho", "top,azimuth=20", "azimuth=200,elevation=-35"] {
        let [expected, got] = [picture(&small, camera), picture(&turned, &format!("{camera},up=0,1,0"))];
        let off = got.chunks(4).zip(expected.chunks(4)).filter(|(a, b)| distance(a, b) > 2).count();
        assert!(off <= 2 && got.iter().any(|&p| p != 255), "{camera}: {off} pixels differ");
    }
}

#[test]
fn size_and_place_of_the_mesh_do_not_matter() {
    let topology_of = |mesh: &Mesh| topology(mesh).unwrap();
    let small = grid([5, 5, 4]);
    let settings = settings("iso");
    let expected = draw(&small, &topology_of(&small), &BuildOptions::default(), &settings);
    for scale in [2f32.powi(90), 2f32.powi(-90)] {
        let mut mesh = small.clone();
        mesh.points.iter_mut().for_each(|p| *p = p.map(|v| v * scale));
        let picture = draw(&mesh, &topology_of(&mesh), &BuildOptions::default(), &settings);
        let off = picture.pixels.chunks(4).zip(expected.pixels.chunks(4)).filter(|(a, b)| distance(a, b) > 2).count();
        assert!(off <= 2, "{scale:e}: {off} pixels differ");
    }
}

#[test]
fn the_picture_is_the_one_kept() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/jet.png");
    let mesh = kuhn_jittered([12, 12, 12], 0.2, 1).unwrap();
    let settings = RenderSettings { size: [96, 96], ..RenderSettings::default() };
    let picture = draw(&mesh, &topology(&mesh).unwrap(), &BuildOptions::default(), &settings);
    if std::env::var_os("OLBVH_BLESS").is_some() {
        let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), 96, 96);
        encoder.set_color(png::ColorType::Rgba);
        encoder.write_header().unwrap().write_image_data(&picture.pixels).unwrap();
    }
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut golden = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut golden).unwrap();
    let d = distance(&picture.pixels, &golden);
    assert!(d <= 1, "differs from tests/golden/jet.png by {d}; if that is meant, look at the new one made with OLBVH_BLESS=1");
}
