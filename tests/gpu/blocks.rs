//! Meshes that do not fit into the memory allowed are processed in blocks: the answers are those of the whole mesh, and
//! the limit of memory is kept.

use olbvh::Error;
use olbvh::blocks::{LocateRequest, OverlapRequest, RenderRequest, SliceRequest, locate, locate_all, nearest, overlap, render, slice};
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Gpu, GpuOptions};
use olbvh::mesh::{Field, Mesh, On, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, Fineness, Lists};
use olbvh::query::{self, LocateMethod, LocateOptions, SILENT};
use olbvh::reference::boundary::topology;
use olbvh::reference::build::build;
use olbvh::reference::volume;
use olbvh::render::{RenderSettings, TransferFunction};
use olbvh::slicing::{Band, Extrapolate, Plane, SliceSettings, Tally};
use std::cell::RefCell;

/// Vertices, midpoints of edges, centres of faces and tetrahedra, and points just outside and far outside.
fn points(mesh: &Mesh, every: usize) -> Vec<[f32; 3]> {
    let mean = |ids: &[u32]| [0, 1, 2].map(|c| ids.iter().map(|&v| mesh.points[v as usize][c]).sum::<f32>() / ids.len() as f32);
    let valid = |ids: &&[u32; 4]| ids.iter().all(|&v| (v as usize) < mesh.points.len());
    let of = |ids: &[u32; 4]| [mean(&ids[..1]), mean(&ids[1..3]), mean(&ids[..3]), mean(ids)];
    let mut points: Vec<_> = mesh.tets.iter().filter(valid).step_by(every).flat_map(of).collect();
    let out = |p: &[f32; 3], by: f32| p.map(|x| x * (1.0 + by) - by);
    let outside: Vec<_> = points.iter().step_by(7).flat_map(|p| [out(p, 2e-6), out(p, 0.1), out(p, 9.0)]).collect();
    points.extend(outside);
    points.push([f32::NAN; 3]);
    points
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}

fn check(gpu: &Gpu, mesh: &Mesh, options: &BuildOptions, memory: u64, how: LocateOptions) {
    let points = points(mesh, 3);
    let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(gpu, &device, options).unwrap();
    let asked = LocateRequest { mesh, options: *options, points: &points };
    let whole = query::locate(&tree, &points, None, &how, SILENT).unwrap();
    let (found, took) = locate(&gpu.with_memory(memory), &asked, &how, SILENT).unwrap();
    let first = (0..points.len()).find(|&i| found.owners[i] != whole.owners[i]);
    let first = first.map(|i| (points[i], found.owners[i], whole.owners[i]));
    assert_eq!(first, None, "{options:?}");
    assert_eq!(bits(found.barycentrics.as_flattened()), bits(whole.barycentrics.as_flattened()));
    assert!(took.peak <= memory && took.peak > memory / 4, "{} of {memory} bytes", took.peak);
    assert!(took.bad_cells == [device.status().bad, 0] && took.bad_cells[0] > 0, "{:?}", took.bad_cells);
    assert!(took.trees > 4, "{} trees", took.trees);
    println!("{} tetrahedra, {memory} bytes: {} trees, peak {}", mesh.tets.len(), took.trees, took.peak);
    let whole = query::locate_all(&tree, &points, how.tolerance, SILENT).unwrap();
    assert_eq!(locate_all(&gpu.with_memory(memory), &asked, how.tolerance, SILENT).unwrap().0.owners, whole.owners);
    for within in [0.7, f32::INFINITY] {
        let whole = query::nearest(&tree, &points, within, SILENT).unwrap();
        let told = RefCell::new(Vec::new());
        let report = |done, all| {
            told.borrow_mut().push((done, all));
            Ok(())
        };
        let (found, took) = nearest(&gpu.with_memory(memory), &asked, within, &report).unwrap();
        // Every block is asked about every point, so the first block is no more than a part of the work.
        assert!(told.borrow()[0].0 < points.len() as u64 / 2, "{told:?}");
        rises(&told, points.len() as u64);
        assert!(found.owners == whole.owners && found.barycentrics == whole.barycentrics && took.trees > 4);
        assert_eq!(bits(&found.distances()), bits(&whole.distances()));
        assert!(whole.owners.iter().filter(|&&owner| owner != u32::MAX).count() > 500);
    }
}

/// A grid with fields on points and cells, and with bad cells.
fn grid() -> Mesh {
    let mut mesh = kuhn_jittered([14, 13, 12], 0.15, 5).unwrap();
    for k in (0..mesh.tets.len()).step_by(997) {
        mesh.tets[k][k % 4] = u32::MAX - k as u32 % 2;
    }
    let values = (0..mesh.tets.len()).map(|i| i as f32).collect();
    mesh.fields.push(Field { name: "number".into(), on: On::Cells, values });
    mesh
}

/// A single test, so that pipelines are compiled only once.
#[test]
fn answers_are_those_of_the_whole() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = grid();
    located(&gpu, &mesh);
    refused(&gpu, &mesh);
    remedied(&gpu);
    flat(&gpu);
    overlapped(&gpu, &mesh);
    apart(&gpu, &mesh);
    sliced(&gpu, &mesh);
    far(&gpu, &mesh);
    passed_over(&gpu);
    drawn(&gpu, &mesh);
    hidden(&gpu, &mesh);
    crate::silent(&gpu);
}

fn located(gpu: &Gpu, mesh: &Mesh) {
    for (alpha, assign, lists, tolerance, method) in
        [(0.0, Assign::Aabb, Lists::Boundary, 1e-5, LocateMethod::Sorted), (1.0, Assign::Aabb, Lists::All, 0.01, LocateMethod::Runs)]
    {
        let options = BuildOptions { alpha, assign, lists, ..BuildOptions::default() };
        check(gpu, mesh, &options, 768 << 10, LocateOptions { tolerance, method });
    }
}

/// A mesh that fits is not cut, and a limit that is too small is refused with the sizes.
fn refused(gpu: &Gpu, mesh: &Mesh) {
    let options = BuildOptions::default();
    let points = points(mesh, 100);
    let asked = LocateRequest { mesh, options, points: &points };
    let (_, took) = locate(&gpu.with_memory(64 << 20), &asked, &LocateOptions::default(), SILENT).unwrap();
    assert_eq!((took.trees, took.bad_cells), (1, [mesh.tets.len().div_ceil(997) as u32, 0]));
    let refused = locate(&gpu.with_memory(1 << 14), &asked, &LocateOptions::default(), SILENT).unwrap_err();
    assert!(matches!(&refused, Error::TooLarge(why) if why.contains("16384 bytes")), "{refused}");
    // Blocks as small as these are not cut, so they are asked for few points at a time.
    let small = kuhn_jittered([3; 3], 0.1, 1).unwrap();
    let points: Vec<[f32; 3]> = (0..20_000).map(|i| [i as f32 * 1.5e-4, 1.5, 1.5]).collect();
    let asked = LocateRequest { mesh: &small, options, points: &points };
    let (found, took) = locate(&gpu.with_memory(200 << 10), &asked, &LocateOptions::default(), SILENT).unwrap();
    assert!(took.trees == 1 && !found.owners.contains(&u32::MAX), "{} trees", took.trees);
}

/// Of a mesh with tetrahedra of very different sizes, the memory that a refusal names is enough for every query.
fn remedied(gpu: &Gpu) {
    type Query<'a> = &'a dyn Fn(&Gpu) -> olbvh::Result<u32>;
    let graded = olbvh::mesh::graded(18).unwrap();
    let (mesh, options, field) = (&graded, BuildOptions { fineness: Fineness::Points, ..BuildOptions::default() }, &graded.fields[0]);
    let points = points(mesh, 10);
    let settings = RenderSettings { size: [300, 20], ..RenderSettings::default() };
    let voxels = &SliceSettings { size: [500, 0], ..SliceSettings::default() }.voxels([0.0; 3], [1.0; 3], [0.0; 3]).unwrap();
    let queries: [Query<'_>; 4] = [
        &|gpu| Ok(locate(gpu, &LocateRequest { mesh, options, points: &points }, &LocateOptions::default(), SILENT)?.1.trees),
        &|gpu| Ok(render(gpu, &RenderRequest { mesh, options, field, settings: &settings }, SILENT)?.1.trees),
        &|gpu| {
            let asked = SliceRequest { mesh, options, field: Some(field), voxels, extrapolate: Extrapolate::Nearest };
            Ok(slice(gpu, &asked, SILENT, &mut |_| Ok(()))?.1.trees)
        },
        &|gpu| Ok(overlap(gpu, &OverlapRequest { meshes: [mesh, mesh], options, pairs: false }, SILENT)?.1.trees),
    ];
    for (i, query) in queries.into_iter().enumerate() {
        for memory in [20_000, 100_000, 300_000] {
            let Err(refused) = query(&gpu.with_memory(memory)) else { continue };
            let said = refused.to_string();
            let enough: u64 = said.split("allow ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
            let trees = query(&gpu.with_memory(enough)).unwrap_or_else(|e| panic!("query {i} with {memory} bytes: {said}, but then: {e}"));
            println!("query {i} with {memory} bytes: {enough} are enough for {trees} trees");
            assert!(enough < 5 << 20 && trees > 1, "{said}");
        }
    }
}

/// A plate is one cell of the level of α, which cannot be cut. With a finer level, it can.
fn flat(gpu: &Gpu) {
    let mesh = kuhn_jittered([50, 50, 1], 0.2, 3).unwrap();
    let points: Vec<_> =
        mesh.tets.iter().map(|ids| [0, 1, 2].map(|c| ids.iter().map(|&v| 0.25 * mesh.points[v as usize][c]).sum())).collect();
    let ask = |fineness| {
        let options = BuildOptions { fineness, ..BuildOptions::default() };
        locate(&gpu.with_memory(768 << 10), &LocateRequest { mesh: &mesh, options, points: &points }, &LocateOptions::default(), SILENT)
    };
    assert!(matches!(ask(Fineness::Alpha), Err(Error::TooLarge(_))));
    let (found, took) = ask(Fineness::Points).unwrap();
    assert!(took.trees > 2 && found.owners.iter().copied().eq(0..mesh.tets.len() as u32), "{} trees", took.trees);
}

fn overlapped(gpu: &Gpu, a: &Mesh) {
    let mut b = kuhn_jittered([9, 16, 9], 0.15, 8).unwrap();
    b.points.iter_mut().for_each(|p| *p = [0.8 * p[0] + 0.3 * p[1] + 3.3, p[1] - 2.2, p[2] + 0.1 * p[0] + 9.1]);
    b.tets[40][2] = b.tets[40][1];
    for (pairs, lists) in [(false, Lists::Boundary), (true, Lists::All)] {
        let options = BuildOptions { lists, ..BuildOptions::default() };
        let devices = [a, &b].map(|mesh| DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap());
        let trees = devices.each_ref().map(|device| Tree::build(gpu, device, &options).unwrap());
        let [x, y] = [&trees[0], &trees[1]];
        let told = RefCell::new(Vec::new());
        let report = |done, all| {
            told.borrow_mut().push((done, all));
            Ok(())
        };
        let find = if pairs { query::overlap_pairs } else { query::overlap };
        let whole = find(x, y, &report).unwrap().overlap;
        let searched = u64::from(whole.effort[0].searched) + u64::from(whole.effort[1].searched);
        rises(&told, if pairs { 2 * a.tets.len() as u64 } else { searched });
        let memory = 3 << 19;
        let (found, took) = overlap(&gpu.with_memory(memory), &OverlapRequest { meshes: [a, &b], options, pairs }, &report).unwrap();
        rises(&told, 1_000_000);
        println!("overlap: {} trees, peak {}, {} and {}", took.trees, took.peak, whole.a.len(), whole.b.len());
        assert!(whole.a.len() > 1000 && took.trees > 4 && took.peak <= memory);
        assert_eq!(found.overlap.a, whole.a);
        assert_eq!(found.overlap.b, whole.b);
        assert_eq!(found.overlap.pairs, whole.pairs);
        let bad = devices.each_ref().map(|device| device.status().bad);
        let (_, uncut) = overlap(&gpu.with_memory(64 << 20), &OverlapRequest { meshes: [a, &b], options, pairs }, SILENT).unwrap();
        assert!(bad[0] > 0 && bad[1] == 1 && took.bad_cells == bad && (uncut.trees, uncut.bad_cells) == (2, bad), "{bad:?}");
    }
}

/// Progress never falls, and ends with all of `all`. Forgets it.
fn rises(told: &RefCell<Vec<(u64, u64)>>, all: u64) {
    let told = told.take();
    assert!(told.is_sorted() && told.iter().all(|t| t.1 == all) && told.last() == Some(&(all, all)), "{told:?}, not up to {all}");
}

/// Of meshes far from each other, no blocks are compared: there are lists of pairs nevertheless, which are empty.
fn apart(gpu: &Gpu, a: &Mesh) {
    let mut b = kuhn_jittered([9, 16, 9], 0.15, 8).unwrap();
    b.points.iter_mut().for_each(|p| p[0] += 100.0);
    let options = BuildOptions { lists: Lists::All, ..BuildOptions::default() };
    for (pairs, wanted) in [(false, None), (true, Some(vec![]))] {
        let told = RefCell::new(Vec::new());
        let report = |done, all| {
            told.borrow_mut().push((done, all));
            Ok(())
        };
        // Too little memory for the whole meshes to be tried.
        let (found, took) = overlap(&gpu.with_memory(1 << 19), &OverlapRequest { meshes: [a, &b], options, pairs }, &report).unwrap();
        rises(&told, 1_000_000);
        assert_eq!((took.trees, found.overlap.pairs), (0, wanted));
        assert!(found.overlap.a.is_empty() && found.overlap.b.is_empty());
    }
}

/// Voxels smaller and larger than tetrahedra, with centres on and off their faces, in upright and oblique planes,
/// inside and at the surface.
fn sliced(gpu: &Gpu, mesh: &Mesh) {
    let (wave, number) = (&mesh.fields[0], &mesh.fields[1]);
    let stack = |plane, layers, size| SliceSettings { plane, layers, size, ..SliceSettings::default() };
    let oblique = SliceSettings { at: Some(1.0), thickness: Some(1.3), ..stack(Plane::Normal([1.0, -2.0, 0.7]), 3, [41, 33]) };
    let options = BuildOptions::default();
    let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(gpu, &device, &options).unwrap();
    for (field, extrapolate, settings) in [
        (wave, Extrapolate::Nearest, SliceSettings { at: Some(6.0), ..stack(Plane::Axis(2), 1, [57, 51]) }),
        (number, Extrapolate::Nearest, stack(Plane::Axis(0), 9, [13, 8])),
        (wave, Extrapolate::Linear, oblique),
    ] {
        let corner = |v: [f32; 4]| [v[0] - 0.7, v[1] - 0.7, v[2]];
        let voxels = &settings.voxels(corner(device.grid().lo), corner(device.grid().hi), mesh.origin).unwrap();
        let values = Some((&field.values[..], field.on));
        let mut whole = Tally::default();
        let mut all = [Vec::new(), Vec::new()];
        let gather = |all: &mut Vec<(u8, u32, u32)>, band: Band| {
            let values = band.values.iter().map(|v| v.to_bits());
            all.extend(band.kinds.iter().zip(&band.owners).zip(values).map(|((&kind, &owner), value)| (kind, owner, value)));
        };
        let mut sink = |band: Band| {
            whole.add(&band.kinds);
            gather(&mut all[0], band);
            Ok(())
        };
        query::slice(&tree, values, voxels, extrapolate, SILENT, &mut sink).unwrap();
        let memory = 640 << 10;
        let asked = SliceRequest { mesh, options, field: Some(field), voxels, extrapolate };
        let mut sink = |band: Band| {
            gather(&mut all[1], band);
            Ok(())
        };
        let (found, took) = slice(&gpu.with_memory(memory), &asked, SILENT, &mut sink).unwrap();
        println!("{settings:?}: {whole:?}, {} trees, peak {}", took.trees, took.peak);
        let first = (0..all[0].len()).find(|&i| all[0].get(i) != all[1].get(i));
        assert_eq!(first.map(|i| (i, all[0][i], all[1].get(i).copied())), None, "{settings:?}");
        assert!(whole.inside > 100 && whole.touched > 50 && found.tally == whole, "{whole:?}");
        assert!(took.trees > 2 && took.peak <= memory, "{} trees, {} bytes", took.trees, took.peak);
        assert_eq!(took.bad_cells, [device.status().bad, 0]);
    }
}

/// The centres of a stack that begins far away are rounded by more than the height of its voxels: to the lower end of
/// the mesh, and to planes within it.
fn far(gpu: &Gpu, mesh: &Mesh) {
    let options = BuildOptions::default();
    for at in [-9_999_996.0, -9_999_992.0] {
        let stack = SliceSettings { at: Some(at), layers: 11, spacing: Some(999_999.562_5), ..SliceSettings::default() };
        let voxels =
            &SliceSettings { size: [32, 32], thickness: Some(0.001), ..stack }.voxels([0.0; 3], [14.0, 13.0, 12.0], mesh.origin).unwrap();
        let asked = SliceRequest { mesh, options, field: None, voxels, extrapolate: Extrapolate::Nearest };
        let of = |memory: u64| {
            let mut owners = Vec::new();
            let mut sink = |band: Band| {
                owners.extend(band.owners);
                Ok(())
            };
            let (sliced, took) = slice(&gpu.with_memory(memory), &asked, SILENT, &mut sink).unwrap();
            (sliced.tally, took.trees, owners)
        };
        let (whole, one, owners) = of(64 << 20);
        let (found, some, in_blocks) = of(640 << 10);
        assert!(one == 1 && whole.inside > 500 && some > 1, "{whole:?}, {one} and {some} trees");
        assert!(whole == found && owners == in_blocks, "{whole:?}, in blocks {found:?}");
    }
}

/// Thousands of tetrahedra in one place cannot be cut and do not fit; only slices that meet them are refused.
fn passed_over(gpu: &Gpu) {
    let mut mesh = kuhn_jittered([14, 13, 12], 0.15, 5).unwrap();
    let top = (0..mesh.tets.len()).find(|&t| mesh.tets[t].iter().all(|&v| mesh.points[v as usize][2] > 10.5)).unwrap();
    mesh.tets.extend(vec![mesh.tets[top]; 20_000]);
    let ask = |at| {
        let settings = SliceSettings { at: Some(at), thickness: Some(0.5), size: [20, 20], ..SliceSettings::default() };
        let voxels = &settings.voxels([0.0; 3], [14.0, 13.0, 12.0], mesh.origin).unwrap();
        let asked = SliceRequest { mesh: &mesh, options: BuildOptions::default(), field: None, voxels, extrapolate: Extrapolate::Nearest };
        slice(&gpu.with_memory(1 << 20), &asked, SILENT, &mut |_| Ok(()))
    };
    let (below, took) = ask(2.0).unwrap();
    assert!(took.trees > 1 && below.tally.inside > 300, "{below:?}, {took:?}");
    assert!(matches!(ask(11.5), Err(Error::TooLarge(_))));
}

/// Parallel and diverging rays from several sides and from within, values that are not shown, surfaces, and clips.
fn drawn(gpu: &Gpu, mesh: &Mesh) {
    let wave = &mesh.fields[0];
    let faint = TransferFunction::default().with_opacity(vec![(0.0, 0.1), (1.0, 0.3)]).unwrap();
    let some = TransferFunction::default().with_opacity(vec![(0.0, 0.0), (0.6, 0.0), (0.7, 0.4), (0.8, 0.0)]).unwrap();
    let middle = wave.range().map(|[lo, hi]| f32::midpoint(lo, hi)).unwrap();
    let surfaces = [0.6 * middle, middle, 1.3 * middle];
    for (camera, clips, transfer, iso) in [
        ("iso", "", &faint, &[][..]),
        ("azimuth=200,elevation=-35,ortho", "", &faint, &[]),
        ("azimuth=200,elevation=-35,ortho", "view=80% x=85%", &faint, &[]),
        ("front", "", &some, &[]),
        ("eye=6.5,6.1,5.2,target=1,2,12,fov=100", "", &faint, &[]),
        ("azimuth=70,elevation=40", "", &faint, &surfaces),
        ("azimuth=70,elevation=40", "view=70%", &faint, &surfaces),
    ] {
        let settings = RenderSettings {
            size: [41, 33],
            camera: camera.parse().unwrap(),
            clips: clips.split_whitespace().map(|clip| clip.parse().unwrap()).collect(),
            transfer: transfer.clone(),
            iso: iso.to_vec(),
            ..RenderSettings::default()
        };
        let options = BuildOptions::default();
        let asked = RenderRequest { mesh, options, field: wave, settings: &settings };
        let (whole, took) = render(&gpu.with_memory(64 << 20), &asked, SILENT).unwrap();
        let bad = took.bad_cells;
        assert!(took.trees == 1 && bad[0] > 0);
        let memory = 384 << 10;
        let (found, took) = render(&gpu.with_memory(memory), &asked, SILENT).unwrap();
        println!("{camera}: {} samples, {} trees, peak {}", found.rendered.stats.found_samples, took.trees, took.peak);
        let first = (0..whole.rendered.colors.len()).find(|&i| bits(&whole.rendered.colors[i]) != bits(&found.rendered.colors[i]));
        assert_eq!(first.map(|i| (i % 41, i / 41, whole.rendered.colors[i], found.rendered.colors[i])), None, "{camera}");
        assert!(whole.rendered.colors.iter().filter(|c| c[3] > 0.1).count() > 150, "{camera}");
        assert!(took.trees > 4 && took.peak <= memory && took.bad_cells == bad, "{} trees, {} bytes", took.trees, took.peak);
    }
}

/// Of a field that grows along x, only values near the far end are shown, or only the near end is left by a clip: no tree
/// is built over the rest.
fn hidden(gpu: &Gpu, mesh: &Mesh) {
    let values: Vec<f32> = mesh.points.iter().map(|p| p[0]).collect();
    let field = Field { name: "x".into(), on: On::Points, values };
    let trees = |clips: &[&str], opacity: Vec<(f32, f32)>, memory: u64| {
        let transfer = TransferFunction::default().with_opacity(opacity).unwrap();
        let clips = clips.iter().map(|clip| clip.parse().unwrap()).collect();
        let settings = RenderSettings { size: [41, 33], transfer, clips, ..RenderSettings::default() };
        let asked = RenderRequest { mesh, options: BuildOptions::default(), field: &field, settings: &settings };
        let (picture, took) = render(&gpu.with_memory(memory), &asked, SILENT).unwrap();
        (picture.rendered.colors.iter().map(|c| bits(c)).collect::<Vec<_>>(), took.trees)
    };
    let everything = vec![(0.0, 0.3), (1.0, 0.5)];
    let (_, all) = trees(&[], everything.clone(), 448 << 10);
    for (clips, opacity) in [(&[][..], vec![(0.0, 0.0), (0.8, 0.0), (1.0, 0.5)]), (&["x=20%"], everything)] {
        let (whole, one) = trees(clips, opacity.clone(), 64 << 20);
        let (found, some) = trees(clips, opacity, 448 << 10);
        println!("{one}, {some} and {all} trees");
        assert!(whole == found && whole.iter().any(|c| f32::from_bits(c[3]) > 0.1));
        assert!(one == 1 && some > 1 && some + 1 < all, "{one}, {some} and {all} trees");
    }
}

/// A picture of more rays than are drawn at once: its strips are those of the reference's picture, and progress is
/// reported.
#[test]
fn large_pictures_are_drawn_in_strips() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([4, 4, 4], 0.2, 5).unwrap();
    let field = Field { name: "x".into(), on: On::Points, values: mesh.points.iter().map(|p| p[0]).collect() };
    let settings = RenderSettings { size: [4096, 270], step: Some(0.2), shading: false, ..RenderSettings::default() };
    let (topology, options) = (topology(&mesh).unwrap(), BuildOptions::default());
    let host = build(&mesh, &topology, &options).unwrap();
    let scene = volume::Drawing::new(&mesh, &topology, &host, &field, &settings).unwrap();
    let expected = volume::render(&scene, SILENT).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &options).unwrap();
    let told = RefCell::new(Vec::new());
    let report = |done, all| {
        told.borrow_mut().push((done, all));
        Ok(())
    };
    let drawn = query::render(&tree, scene.plan(), (&field.values, field.on), None, &report).unwrap();
    let [samples, expected_samples] = [drawn.stats, expected.stats].map(|stats| [stats.samples, stats.found_samples]);
    assert_eq!(samples, expected_samples);
    let pixels = |colors: &[[f32; 4]]| scene.plan().pixels(colors, 1);
    assert!(drawn.stats.found_samples > 100_000 && pixels(&drawn.colors) == pixels(&expected.colors));
    let (told, all) = (told.into_inner(), 4096 * 270);
    assert!(told.iter().any(|&(done, _)| done == 4096 * 256) && told.last() == Some(&(all, all)), "{told:?}");
}

/// A cylinder of sectors round an axis, and a box beside it. So many sectors meet on the axis that its vertices are crowded,
/// and the tetrahedra there count as boundary. A block at the rim has a few sectors only.
fn swept(sectors: u32, layers: u32) -> Mesh {
    let height = 0.004;
    let (mut axis, mut ring) = (Vec::new(), Vec::new());
    for layer in 0..=layers {
        axis.push([0.0, 0.0, layer as f32 * height]);
        for sector in 0..sectors {
            let angle = std::f64::consts::TAU * f64::from(sector) / f64::from(sectors) + 0.01;
            let radius = 1.0 + 0.02 * f64::from(layer % 2);
            ring.push([(radius * angle.cos()) as f32, (radius * angle.sin()) as f32, layer as f32 * height]);
        }
    }
    let (mut inner, mut outer) = (Vec::new(), Vec::new());
    for (layer, sector) in (0..layers).flat_map(|layer| (0..sectors).map(move |sector| (layer, sector))) {
        let next = (sector + 1) % sectors;
        let at = |layer: u32, sector: u32| layers + 1 + layer * sectors + sector;
        let [p0, q0, p1, q1] = [at(layer, sector), at(layer, next), at(layer + 1, sector), at(layer + 1, next)];
        outer.extend(if sector < next { [[layer, p0, q0, q1], [layer, p0, p1, q1]] } else { [[layer, p0, q0, p1], [layer, q0, q1, p1]] });
        inner.push([layer, layer + 1, p1, q1]);
    }
    let grid = kuhn_jittered([11; 3], 0.0, 1).unwrap();
    let first = (axis.len() + ring.len()) as u32;
    let place = |p: &[f32; 3]| [0.6 + 2.4 * p[0] / 11.0, 1.1 + 0.5 * p[1] / 11.0, layers as f32 * height * p[2] / 11.0];
    let points = axis.into_iter().chain(ring).chain(grid.points.iter().map(place)).collect();
    let beside = grid.tets.iter().map(|tet| tet.map(|v| v + first));
    Mesh::new(points, inner.into_iter().chain(outer).chain(beside).collect())
}

#[test]
fn crowded_vertices_are_known_to_every_block() {
    let gpu = &Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = &swept(24, 100);
    let options = BuildOptions { level: Some(4), ..BuildOptions::default() };
    let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap();
    assert!(device.status().crowded > 90, "{:?}", device.status());
    let tree = Tree::build(gpu, &device, &options).unwrap();
    let settings = SliceSettings { at: Some(0.204), size: [1000, 0], thickness: Some(0.0005), ..SliceSettings::default() };
    let [lo, hi] = [device.grid().lo, device.grid().hi].map(|v| [v[0], v[1], v[2]]);
    let voxels = &settings.voxels(lo, hi, mesh.origin).unwrap();
    let mut owners = [Vec::new(), Vec::new()];
    let mut sink = |band: Band| {
        owners[0].extend(band.owners);
        Ok(())
    };
    query::slice(&tree, None, voxels, Extrapolate::Nearest, SILENT, &mut sink).unwrap();
    let asked = SliceRequest { mesh, options, field: None, voxels, extrapolate: Extrapolate::Nearest };
    let mut sink = |band: Band| {
        owners[1].extend(band.owners);
        Ok(())
    };
    let (found, took) = slice(&gpu.with_memory(440_000), &asked, SILENT, &mut sink).unwrap();
    let other = (0..owners[0].len()).filter(|&i| owners[0][i] != owners[1][i]).count();
    assert!(took.trees > 2 && found.tally.inside > 10_000 && other == 0, "{} trees: {other} other owners", took.trees);
}
