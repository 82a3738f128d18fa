//! Pictures of the device, compared with those of the reference where something ends: a field, a clip, a strip.

use olbvh::blocks::{RenderRequest, render};
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{Field, Mesh, On, kuhn_jittered};
use olbvh::options::BuildOptions;
use olbvh::query::{self, SILENT};
use olbvh::reference::boundary::topology;
use olbvh::reference::build::build;
use olbvh::reference::volume::{self, Drawing};
use olbvh::render::{RenderSettings, TransferFunction};

fn of_points(mesh: &Mesh, value: impl Fn(usize, f32) -> f32) -> Field {
    Field { name: "x".into(), on: On::Points, values: mesh.points.iter().enumerate().map(|(i, p)| value(i, p[0])).collect() }
}

/// Draws a field both ways, and returns the number of pixels in which something is seen.
fn compare(gpu: &Gpu, mesh: &Mesh, field: &Field, settings: &RenderSettings) -> usize {
    let (topology, options) = (topology(mesh).unwrap(), BuildOptions::default());
    let host = build(mesh, &topology, &options).unwrap();
    let scene = Drawing::new(mesh, &topology, &host, field, settings).unwrap();
    let expected = volume::render(&scene, SILENT).unwrap();
    let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(gpu, &device, &options).unwrap();
    let drawn = query::render(&tree, scene.plan(), (&field.values, field.on), None, SILENT).unwrap();
    let other = drawn.colors.iter().zip(&expected.colors).filter(|(a, b)| a != b).count();
    assert_eq!(other, 0, "pixels of {:?}", settings.camera);
    drawn.colors.iter().filter(|color| color[3] > 0.1).count()
}

#[test]
fn cells_without_a_value_are_not_seen() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([4; 3], 0.2, 5).unwrap();
    let transfer = TransferFunction::default().with_opacity(vec![(0.0, 0.3), (1.0, 0.5)]).unwrap();
    let settings = RenderSettings { size: [64, 48], shading: false, transfer, range: Some([0.0, 4.0]), ..RenderSettings::default() };
    for hole in [f32::NAN, f32::INFINITY] {
        let field = of_points(&mesh, |i, x| if i % 5 == 0 { hole } else { x });
        assert!(compare(&gpu, &mesh, &field, &settings) > 100);
    }
}

/// A surface between the last sample before a clip and the clip is seen, from either side.
#[test]
fn surfaces_beside_a_clip() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([4; 3], 0.2, 5).unwrap();
    let field = of_points(&mesh, |_, x| x);
    let mut seen = 0;
    for camera in
        ["left", "right", "azimuth=170,elevation=10", "azimuth=350,elevation=10", "azimuth=80,elevation=10", "azimuth=260,elevation=10"]
    {
        for clip in ["x=50%", "-x=50%"] {
            let settings = RenderSettings {
                size: [64, 48],
                shading: false,
                camera: camera.parse().unwrap(),
                clips: vec![clip.parse().unwrap()],
                iso: vec![1.95, 2.05],
                step: Some(0.23),
                ..RenderSettings::default()
            };
            seen += usize::from(compare(&gpu, &mesh, &field, &settings) > 100);
        }
    }
    assert!(seen >= 8, "{seen} pictures with something in them");
}

/// Blocks draw their parts of a picture strip by strip if memory is short.
#[test]
fn blocks_draw_in_strips() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = &kuhn_jittered([14, 13, 12], 0.15, 5).unwrap();
    let transfer = TransferFunction::default().with_opacity(vec![(0.0, 0.1), (1.0, 0.3)]).unwrap();
    let settings = RenderSettings { size: [120, 200], transfer, ..RenderSettings::default() };
    let asked = RenderRequest { mesh, options: BuildOptions::default(), field: &mesh.fields[0], settings: &settings };
    let (whole, one) = render(&gpu.with_memory(64 << 20), &asked, SILENT).unwrap();
    let (found, some) = render(&gpu.with_memory(520 << 10), &asked, SILENT).unwrap();
    assert!(one.trees == 1 && some.trees > 2, "{} trees", some.trees);
    let [whole, found] = [whole, found].map(|picture| picture.rendered.colors);
    assert_eq!(whole.iter().zip(&found).filter(|(a, b)| a != b).count(), 0);
}
