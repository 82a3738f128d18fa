//! Pictures in the scenes of renderers: seen through a matrix, and behind what a depth buffer shows.

use crate::submit::submit;
use glam::DVec3;
use glam::dcamera::rh::proj::vulkan::{orthographic, perspective, perspective_infinite_reverse};
use glam::dcamera::rh::view::look_at_mat4;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Arena, Gpu, GpuOptions};
use olbvh::mesh::{Field, On, kuhn_jittered};
use olbvh::options::BuildOptions;
use olbvh::query::{RenderInput, RenderMemory, Rounds, SILENT, Scene, cmd_depths, cmd_render};
use olbvh::reference::boundary::topology;
use olbvh::reference::build::build;
use olbvh::reference::volume::{Drawing, render};
use olbvh::render::{PicturePlan, ProjectedView, RenderSettings, ValidTets};

const SIZE: [u32; 2] = [44, 30];

/// Views of a box of 6×5×4 that a renderer might have, all but the last with Vulkan's depths.
fn views() -> [ProjectedView; 3] {
    let eye = look_at_mat4(DVec3::new(-5.0, -7.0, 8.0), DVec3::new(3.0, 2.5, 2.0), DVec3::Z);
    let aspect = 44.0 / 30.0;
    [
        ProjectedView { to_clip: perspective(0.7, aspect, 0.1, 50.0) * eye, reversed: false },
        ProjectedView { to_clip: perspective_infinite_reverse(0.7, aspect, 0.1) * eye, reversed: true },
        ProjectedView { to_clip: orthographic(-6.0, 6.0, -4.5, 4.5, 0.5, 40.0) * eye, reversed: false },
    ]
}

/// What a depth buffer has where the renderer has drawn the plane x + y = 5 in some columns, nothing in others, and what
/// is not a number in some.
fn depths(view: &ProjectedView) -> Vec<f32> {
    let inverse = view.to_clip.inverse();
    let at = |i: u32| {
        let (x, y) = (i % SIZE[0], i / SIZE[0]);
        let ndc = |x: u32, n: u32| (f64::from(x) + 0.5) / f64::from(n) * 2.0 - 1.0;
        let place = |z: f64| {
            let p = inverse * DVec3::new(ndc(x, SIZE[0]), ndc(y, SIZE[1]), z).extend(1.0);
            p.truncate() / p.w
        };
        let [a, b] = [0.3, 0.6].map(place);
        let [from, to] = [a, b].map(|p| p.x + p.y);
        let clip = view.to_clip * (a + (b - a) * ((5.0 - from) / (to - from))).extend(1.0);
        match x % 8 {
            0..6 => (clip.z / clip.w) as f32,
            6 => f32::from(u8::from(!view.reversed)),
            _ => f32::NAN,
        }
    };
    (0..SIZE[0] * SIZE[1]).map(at).collect()
}

#[test]
fn what_lies_behind_is_not_drawn() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([6, 5, 4], 0.3, 5).unwrap();
    let (field, topology) = (&mesh.fields[0], topology(&mesh).unwrap());
    let arrays = build(&mesh, &topology, &BuildOptions::default()).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
    let on_device = Scene::of(&tree);
    let is_valid = |tet| topology.is_valid(tet);
    let valid = ValidTets { bounds: (&arrays.grid).into(), neighbours: &topology.neighbours, is_valid: &is_valid };
    let values = gpu.upload("olbvh.test.field", &field.values).unwrap();
    let [lo, hi] = field.range().unwrap();
    for view in views() {
        let depths = depths(&view);
        let depth = gpu.upload("olbvh.test.depth", &depths).unwrap();
        for iso in [vec![], vec![lo + 0.2 * (hi - lo), lo + 0.5 * (hi - lo)]] {
            let settings = RenderSettings { size: SIZE, iso, opacity_scale: 0.1, ..RenderSettings::default() };
            let plan = PicturePlan::with_projected(&settings, &view, &(&arrays.grid).into(), mesh.origin, field.range()).unwrap();
            let scene = || Drawing::new(&mesh, &topology, &arrays, field, &settings).unwrap().seen_in(plan.clone()).without_skipping();
            let view = gpu.upload("olbvh.test.view", &[plan.view()]).unwrap();
            let table = gpu.upload("olbvh.test.table", &plan.table).unwrap();
            let normals = gpu.upload("olbvh.test.normals", &settings.normals(&mesh, &valid, field)).unwrap();
            let carve = |a: &mut Arena| RenderMemory::carve(a, SIZE, None);
            let buffer = gpu.upload("olbvh.test.picture", &vec![0u8; Arena::measure(carve).unwrap() as usize]).unwrap();
            let memory = carve(&mut Arena::new(buffer.all())).unwrap();
            let whole = RenderInput::of(&plan, view.all(), table.all(), (values.all(), On::Points));
            let input = RenderInput { normals: Some(normals.all()), depth: Some(depth.all()), ..whole };
            submit(&gpu, "olbvh.test.picture", |r| cmd_render(r, &on_device, &input, &memory, Rounds::begin(8))).unwrap();
            let hidden: Vec<[f32; 4]> = gpu.download(&buffer, memory.colors.part(0, 16 * u64::from(SIZE[0] * SIZE[1]))).unwrap();
            let bits = |colors: &[[f32; 4]]| colors.iter().map(|color| color.map(f32::to_bits)).collect::<Vec<_>>();
            let expected = render(&scene().before(&depths), SILENT).unwrap();
            assert!(bits(&hidden) == bits(&expected.colors));
            // The same depths, with those of what is opaque in the picture.
            let after = gpu.upload("olbvh.test.depths", &depths).unwrap();
            submit(&gpu, "olbvh.test.depths", |r| cmd_depths(r, &input, &memory, after.all())).unwrap();
            let after: Vec<f32> = gpu.download(&after, after.all()).unwrap();
            let both = depths.iter().zip(&expected.depths).map(|(&before, own)| own.unwrap_or(before).to_bits());
            assert!(after.iter().map(|d| d.to_bits()).eq(both));
            let opaque = expected.depths.iter().flatten().count();
            assert!(opaque == hidden.iter().filter(|color| color[3] >= plan.termination).count() && (opaque > 50) == input.iso, "{opaque}");
            let whole = render(&scene(), SILENT).unwrap().colors;
            let differs = |i: &usize| whole[*i] != hidden[*i];
            let columns = |behind: bool| (0..whole.len()).filter(move |i| (i % 44 % 8 < 6) == behind);
            let (behind, before) = (columns(true).filter(differs).count(), columns(false).filter(differs).count());
            let shown = whole.iter().filter(|color| color[3] > 0.0).count();
            assert!(behind * 4 > shown && shown > 100 && before == 0, "{behind} and {before} of {shown} pixels differ");
        }
    }
}

/// The depths at which rays become opaque: at the plane of an iso-surface, and within a dense volume.
#[test]
fn depths_are_those_of_what_is_opaque() {
    let mesh = kuhn_jittered([6, 5, 4], 0.3, 5).unwrap();
    let topology = topology(&mesh).unwrap();
    let arrays = build(&mesh, &topology, &BuildOptions::default()).unwrap();
    let field = Field { name: "x".into(), on: On::Points, values: mesh.points.iter().map(|p| p[0]).collect() };
    for view in views() {
        let inverse = view.to_clip.inverse();
        for (iso, opacity_scale) in [(vec![2.5], 1.0), (vec![], 1e6)] {
            let settings = RenderSettings { size: SIZE, iso: iso.clone(), opacity_scale, ..RenderSettings::default() };
            let plan = PicturePlan::with_projected(&settings, &view, &(&arrays.grid).into(), mesh.origin, field.range()).unwrap();
            let drawing = Drawing::new(&mesh, &topology, &arrays, &field, &settings).unwrap().seen_in(plan.clone()).without_skipping();
            let picture = render(&drawing, SILENT).unwrap();
            let places = picture.depths.iter().zip(0..).filter_map(|(depth, i)| {
                let [x, y] = [i % SIZE[0], i / SIZE[0]].map(|v| f64::from(v) + 0.5);
                let ndc = DVec3::new(x / f64::from(SIZE[0]) * 2.0 - 1.0, y / f64::from(SIZE[1]) * 2.0 - 1.0, f64::from((*depth)?));
                let p = inverse * ndc.extend(1.0);
                Some(p.truncate() / p.w)
            });
            let places: Vec<DVec3> = places.collect();
            assert!(places.len() > 100);
            // The dense volume is opaque a few samples behind its surface at most.
            let far = |p: &DVec3| {
                if iso.is_empty() {
                    (p.min(DVec3::new(6.0, 5.0, 4.0) - p)).min_element().abs() - 2.5 * f64::from(plan.step)
                } else {
                    (p.x - 2.5).abs()
                }
            };
            let worst = places.iter().map(far).fold(0.0, f64::max);
            assert!(worst < 1e-3, "{worst}");
        }
    }
}
