//! Tests of every query, recorded and owning, as a C program calls it: the results are the same bytes as from Rust.

use super::pictures::pictures;
use super::*;
use crate::capi::query::*;
use crate::gpu::Buffer;
use crate::layout::{NearState, OverlapStatus, RenderStatus, SliceStatus, ViewUniforms, wide};
use crate::mesh::{Bounds, Field};
use crate::options::TOLERANCE;
use crate::query::{LocateOptions, Nearest, SILENT, locate, locate_all, nearest, overlap, overlap_pairs, render, slice};
use crate::render::{PicturePlan, Prepared, ProjectedView, ValidTets};
use crate::slicing::{Band, Extrapolate};
use bytemuck::Pod;
use glam::DMat4;

const NOTHING: OlbvhBuffer = OlbvhBuffer { buffer: 0, offset: 0, size: 0, address: 0 };
const LO: [f32; 3] = [-1.0; 3];
const HI: [f32; 3] = [6.0, 5.0, 4.0];

pub fn settings() -> OlbvhPictureSettings {
    let (colors, opacity) = (c"viridis_r".as_ptr(), c"0:0,0.4:0,0.5:0.4,0.6:0,1:0".as_ptr());
    OlbvhPictureSettings { width: 37, height: 30, colors, opacity, range: [-1.5, 5.0], ..olbvh_default_picture_settings() }
}

fn voxels() -> OlbvhVoxels {
    let axis = |c: usize, x: f32| [0, 1, 2].map(|k| if k == c { x } else { 0.0 });
    let half = [axis(0, 0.2), axis(1, 0.2), axis(2, 0.4)];
    OlbvhVoxels {
        origin: LO,
        next_voxel: axis(0, 0.4),
        next_row: axis(1, 0.4),
        next_layer: axis(2, 0.8),
        half,
        width: 17,
        height: 13,
        layers: 6,
    }
}

fn meshes() -> [Mesh; 2] {
    let mut other = kuhn_jittered([3; 3], 0.3, 9).unwrap();
    other.points.iter_mut().for_each(|p| *p = p.map(|x| x + 1.3));
    [kuhn_jittered([5, 4, 3], 0.3, 1).unwrap(), other]
}

fn values(mesh: &Mesh) -> Vec<f32> {
    mesh.points.iter().map(|p| p[0] - 0.5 * p[2]).collect()
}

/// Results of the Rust interface.
struct Expected {
    colors: Vec<[f32; 4]>,
    answers: Vec<u32>,
    sliced: Vec<u32>,
    hits: [Vec<u32>; 2],
    pairs: Vec<[u32; 2]>,
    owners: Vec<Vec<u32>>,
    located: Vec<f32>,
    nearest: Nearest,
}

/// Answers, bits of the values, and the number of bands of a stack.
fn sliced(tree: &Tree, field: Option<(&[f32], On)>, voxels: &OlbvhVoxels) -> (Vec<u32>, Vec<u32>, u32) {
    let (mut answers, mut values, mut bands) = (Vec::new(), Vec::new(), 0);
    let mut sink = |band: Band| {
        let answer = |(&owner, &kind): (&u32, &u8)| if kind == crate::slicing::TOUCHED { owner | 1 << 31 } else { owner };
        answers.extend(band.owners.iter().zip(&band.kinds).map(answer));
        values.extend(band.values.iter().map(|v| v.to_bits()));
        bands += 1;
        Ok(())
    };
    slice(tree, field, &voxels.read(), Extrapolate::Linear, SILENT, &mut sink).unwrap();
    (answers, values, bands)
}

fn expected(gpu: &Gpu, meshes: &[Mesh; 2], plan: &PicturePlan, normals: Option<&[[f32; 3]]>) -> Expected {
    let values = values(&meshes[0]);
    let field = Some((&values[..], On::Points));
    let [mesh, other] = meshes.each_ref().map(|m| DeviceMesh::upload(gpu, m, BadCells::Skip).unwrap());
    let options = BuildOptions { lists: Lists::All, ..BuildOptions::default() };
    let [tree, other_tree] = [&mesh, &other].map(|m| Tree::build(gpu, m, &options).unwrap());
    let (answers, sliced, _) = sliced(&tree, field, &voxels());
    let [sets, pairs] = [overlap, overlap_pairs].map(|find| find(&tree, &other_tree, SILENT).unwrap().overlap);
    let bits = |found: &[u32], mesh: &Mesh| {
        let mut words = vec![0; mesh.tets.len().div_ceil(32)];
        found.iter().for_each(|i| words[*i as usize / 32] |= 1 << (i % 32));
        words
    };
    let points = &meshes[0].points;
    Expected {
        colors: render(&tree, plan, (&values, On::Points), normals, SILENT).unwrap().colors,
        answers,
        sliced,
        hits: [bits(&sets.a, &meshes[0]), bits(&sets.b, &meshes[1])],
        pairs: pairs.pairs.unwrap(),
        owners: locate_all(&tree, points, TOLERANCE, SILENT).unwrap().owners,
        nearest: nearest(&tree, points, 1.0, SILENT).unwrap(),
        located: locate(&tree, points, field, &LocateOptions::default(), SILENT).unwrap().values,
    }
}

/// A scene in the host's memory, and its buffers.
pub struct Stage {
    pub scene: *mut OlbvhScene,
    positions: Buffer,
    _held: [Buffer; 3],
}

/// A scene whose tree has lists by bounding box, with which every pair is found once.
fn stage(gpu: *const OlbvhGpu, mesh: &Mesh) -> Stage {
    place(gpu, mesh, 6, OlbvhBuildOptions { lists: 0, assign: 0, ..olbvh_default_build_options() })
}

/// The plan of a scene for a mesh.
pub fn plan(mesh: &Mesh, level: u32, build: OlbvhBuildOptions) -> OlbvhPlan {
    OlbvhPlan { points: mesh.points.len() as u32, stride: 3, tets: mesh.tets.len() as u32, level, longest_leaf: 0, build }
}

pub fn place(gpu: *const OlbvhGpu, mesh: &Mesh, level: u32, build: OlbvhBuildOptions) -> Stage {
    let device = &call!(handle(gpu, "gpu")).unwrap().0;
    let plan = plan(mesh, level, build);
    let sizes: OlbvhPlanSizes = made(|out| call!(olbvh_plan_measure(gpu, &raw const plan, out)));
    let (positions, cells) = (device.upload("olbvh.test.positions", &mesh.points), device.upload("olbvh.test.cells", &mesh.tets));
    let (positions, cells) = (positions.unwrap(), cells.unwrap());
    let [memory, scratch] = [sizes.memory, sizes.scratch].map(|bytes| device.buffer("olbvh.test.memory", bytes).unwrap());
    let [p, c, m, s] = [&positions, &cells, &memory, &scratch].map(|b| OlbvhBuffer::from(b.all()));
    let scene = made(|out| call!(olbvh_scene_place(gpu, &raw const plan, p, c, m, s, out)));
    Stage { scene, positions, _held: [cells, memory, scratch] }
}

pub fn read<T: Pod>(gpu: &Gpu, part: OlbvhBuffer, count: usize) -> Vec<T> {
    let mut all = vec![T::zeroed(); count];
    let bytes = bytemuck::cast_slice_mut(&mut all);
    gpu.download_ref(
        BufferRef { buffer: vk::Buffer::from_raw(part.buffer), offset: part.offset, size: bytes.len() as u64, address: 0 },
        bytes,
    )
    .unwrap();
    all
}

/// The view of a renderer that looks along z, with depths the other way round.
fn projected(settings: &OlbvhPictureSettings) {
    let to_clip = DMat4::from_cols_array(&[0.1, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, -0.01, 0.0, 0.0, 0.0, 0.9, 1.0]);
    let columns = to_clip.to_cols_array();
    let make = |reversed, out| call!(olbvh_view_make_projected(settings, LO.as_ptr(), HI.as_ptr(), columns.as_ptr(), reversed, out));
    let views: [OlbvhView; 2] = [0, 1].map(|reversed| made(|out| make(reversed, out)));
    for (view, reversed) in views.iter().zip([false, true]) {
        let (view, bounds) = (&view.frame, Bounds { lo: LO, hi: HI });
        let plan =
            PicturePlan::with_projected(&call!(settings.read()).unwrap(), &ProjectedView { to_clip, reversed }, &bounds, [0.0; 3], None)
                .unwrap();
        assert_eq!(bytemuck::cast_slice::<u32, u8>(&view[..size_of::<ViewUniforms>() / 4]), bytemuck::bytes_of(&plan.view()));
    }
    assert!(views[0].frame != views[1].frame);
    let mut none = std::mem::MaybeUninit::uninit();
    let flat = [0.0; 16];
    let made = call!(olbvh_view_make_projected(settings, LO.as_ptr(), HI.as_ptr(), flat.as_ptr(), 0, none.as_mut_ptr()));
    assert!(made == OlbvhStatus::Invalid && message().contains("without an inverse"), "{}", message());
    for lo in [[LO[0], HI[1] + 1.0, LO[2]], [f32::NAN, LO[1], LO[2]]] {
        let made = call!(olbvh_view_make(settings, lo.as_ptr(), HI.as_ptr(), none.as_mut_ptr()));
        assert!(made == OlbvhStatus::Invalid && message().contains("a box from"), "{}", message());
    }
}

/// Records all queries in one command buffer, after a rehearsal, twice.
pub fn recorded(gpu: *mut OlbvhGpu) {
    let device = &call!(handle(gpu, "gpu")).unwrap().0;
    let meshes = meshes();
    let settings = settings();
    projected(&settings);
    let view: OlbvhView = made(|out| call!(olbvh_view_make(&raw const settings, LO.as_ptr(), HI.as_ptr(), out)));
    assert!((1..100).contains(&view.drawn_count));
    let plan = PicturePlan::new(&call!(settings.read()).unwrap(), &Bounds { lo: LO, hi: HI }, [0.0; 3], None).unwrap();
    let normals = vec![[0.6, 0.0, 0.7f32]; meshes[0].points.len()];
    let expected = expected(device, &meshes, &plan, Some(&normals));

    let [a, b] = meshes.each_ref().map(|mesh| stage(gpu, mesh));
    let count = meshes[0].points.len() as u32;
    // SAFETY: a view consists of 32-bit words without padding.
    let words = unsafe { std::slice::from_raw_parts((&raw const view).cast::<u32>(), size_of_val(&view) / 4) };
    let view = device.upload("olbvh.test.view", words).unwrap();
    let (values, normals) = (device.upload("olbvh.test.field", &values(&meshes[0])), device.upload("olbvh.test.normals", &normals));
    let (values, normals) = (values.unwrap(), normals.unwrap());
    let depth = device.upload("olbvh.test.depth", &[1e9f32; 37 * 30]).unwrap(); // behind everything
    let depths = device.upload("olbvh.test.depths", &[-1f32; 37 * 30]).unwrap();
    let field = OlbvhField { values: values.all().into(), on_cells: 0 };
    let buffer = |bytes: u64| device.buffer("olbvh.test.memory", bytes).unwrap();
    let ranges = buffer(made(|out| call!(olbvh_range_bytes(a.scene, out))));
    let [once, four, eight] = [1, 4, 8].map(|count| OlbvhRounds { count, resume: 0 });

    let mut picture = OlbvhPicture {
        width: 37,
        height: 30,
        iso: 0,
        drawn_count: 100,
        view: view.all().into(),
        field,
        normals: normals.all().into(),
        ranges: ranges.all().into(),
        depth: depth.all().into(),
        memory: NOTHING,
        rounds: once,
    };
    let parts = |picture: &OlbvhPicture| -> OlbvhPictureParts { made(|out| call!(olbvh_picture_parts(a.scene, picture, out))) };
    let picture_memory = buffer(parts(&picture).bytes);
    picture.memory = picture_memory.all().part(0, 1024).into();
    let mut none = std::mem::MaybeUninit::uninit();
    assert_eq!(call!(olbvh_picture_parts(a.scene, &raw const picture, none.as_mut_ptr())), OlbvhStatus::Invalid);
    picture.memory = picture_memory.all().into();
    let picture_parts = parts(&picture);

    let (voxels, linear) = (voxels(), 1);
    let mut slicing = OlbvhSlicing { voxels, layer: 0, first: 0, rows: 13 * 6, linear, field, memory: NOTHING, rounds: once };
    let parts = |slicing: &OlbvhSlicing| -> OlbvhSlicingParts { made(|out| call!(olbvh_slicing_parts(slicing, out))) };
    let slice_memory = buffer(parts(&slicing).bytes);
    slicing.memory = slice_memory.all().into();
    let slicing_parts = parts(&slicing);

    let answers = buffer(16 * u64::from(count));
    let owners = buffer(4 * u64::from(count));
    let mut location = OlbvhLocation {
        points: a.positions.all().into(),
        stride: 3,
        count,
        tolerance: -1.0,
        path: 2,
        hints: NOTHING,
        memory: NOTHING,
        owners: owners.all().into(),
        barycentrics: answers.all().into(),
    };
    let parts: OlbvhLocationParts = made(|out| call!(olbvh_location_parts(a.scene, &raw const location, out)));
    let order = buffer(parts.bytes);
    location.memory = order.all().into();
    let interpolated = buffer(4 * u64::from(count));
    let parts = |memory| -> OlbvhOwnerParts { made(|out| call!(olbvh_owner_parts(a.scene, &raw const location, memory, out))) };
    let owner_memory = buffer(parts(NOTHING).bytes);
    let owner_parts = parts(owner_memory.all().into());
    let lists = buffer(4 * expected.owners.iter().map(|l| l.len() as u64).sum::<u64>());

    let parts = |memory| -> OlbvhOverlapParts { made(|out| call!(olbvh_overlap_parts(a.scene, b.scene, memory, out))) };
    let overlap_memory = buffer(parts(NOTHING).bytes);
    let overlap_parts = parts(overlap_memory.all().into());
    let parts = |memory| -> OlbvhPairParts { made(|out| call!(olbvh_pair_parts(a.scene, memory, out))) };
    let pair_memory = buffer(parts(NOTHING).bytes);
    let pair_parts = parts(pair_memory.all().into());
    let found = buffer(8 * expected.pairs.len() as u64);
    let parts = |memory| -> OlbvhNearestParts { made(|out| call!(olbvh_nearest_parts(count, memory, out))) };
    let near_memory = buffer(parts(NOTHING).bytes);
    let near_parts = parts(near_memory.all().into());

    let recording: *mut OlbvhRecording = made(|out| call!(olbvh_recording_new(gpu, out)));
    let record = |commands: u64| {
        ok(call!(olbvh_recording_begin(recording, commands, 0, 0)));
        ok(call!(olbvh_cmd_build(recording, a.scene)));
        ok(call!(olbvh_cmd_build(recording, b.scene)));
        ok(call!(olbvh_cmd_ranges(recording, a.scene, &raw const field, ranges.all().into())));
        ok(call!(olbvh_cmd_render(recording, a.scene, &raw const picture)));
        ok(call!(olbvh_cmd_barrier(recording)));
        ok(call!(olbvh_cmd_depths(recording, a.scene, &raw const picture, depths.all().into())));
        ok(call!(olbvh_cmd_slice(recording, a.scene, &raw const slicing)));
        ok(call!(olbvh_cmd_locate(recording, a.scene, &raw const location)));
        ok(call!(olbvh_cmd_barrier(recording)));
        ok(call!(olbvh_cmd_interpolate(recording, a.scene, &raw const location, &raw const field, 1, interpolated.all().into())));
        // Hints are not used, whatever they are.
        let odd = OlbvhLocation { hints: OlbvhBuffer { size: 1, ..NOTHING }, ..location };
        ok(call!(olbvh_cmd_owners(recording, a.scene, &raw const odd, owner_memory.all().into(), lists.all().into())));
        ok(call!(olbvh_cmd_overlap(recording, a.scene, b.scene, overlap_memory.all().into(), four)));
        ok(call!(olbvh_cmd_count_pairs(recording, a.scene, b.scene, pair_memory.all().into(), eight)));
        ok(call!(olbvh_cmd_list_pairs(recording, a.scene, b.scene, pair_memory.all().into(), found.all().into(), eight)));
        ok(call!(olbvh_cmd_nearest(recording, a.scene, &raw const odd, 1.0, near_memory.all().into(), four)));
        ok(call!(olbvh_recording_end(recording)));
    };
    record(0);
    let before = CALLS.get();
    for _ in 0..2 {
        let frame = |r: &mut Recorder<'_>| {
            ARMED.set(true);
            record(r.commands().as_raw());
            ARMED.set(false);
            Ok(())
        };
        device.submit("olbvh.test.queries", frame).unwrap();
    }
    assert_eq!(CALLS.get(), before, "calls made while recording");

    assert!(read::<[f32; 4]>(device, picture_parts.colors, 37 * 30) == expected.colors);
    let opaque = expected.colors.iter().map(|color| color[3] >= plan.termination);
    assert!(read::<f32>(device, depths.all().into(), 37 * 30).into_iter().map(|depth| depth > 0.0).eq(opaque));
    let drawn = read::<RenderStatus>(device, picture_parts.status, 1)[0];
    let [samples, found_samples, skipped] = [drawn.samples, drawn.found, drawn.skipped].map(wide);
    assert!(drawn.unfinished == 0 && samples >= found_samples && found_samples > 500 && skipped > 100, "{drawn:?}");
    assert_eq!(read::<u32>(device, slicing_parts.answers, 17 * 13 * 6), expected.answers);
    assert_eq!(read::<u32>(device, slicing_parts.values, 17 * 13 * 6), expected.sliced);
    let voxels = read::<SliceStatus>(device, slicing_parts.status, 1)[0];
    assert_eq!([voxels.locating, voxels.touching, voxels.refused], [0; 3], "voxels are left");
    assert!(voxels.inside > 100 && voxels.touched > 100 && voxels.empty > 100, "{voxels:?}");
    assert!(read::<f32>(device, interpolated.all().into(), count as usize) == expected.located);
    let firsts: Vec<u32> = expected.owners.iter().map(|list| list[0]).collect();
    assert_eq!((read(device, location.owners, firsts.len()), read(device, owner_parts.owners, firsts.len())), (firsts.clone(), firsts));
    let all = expected.owners.concat();
    assert_eq!((read::<u32>(device, owner_parts.total, 1)[0] as usize, read(device, lists.all().into(), all.len())), (all.len(), all));
    let states: Vec<NearState> = read(device, near_parts.states, count as usize);
    let near = &expected.nearest;
    assert!(states.iter().map(|state| (state.owner, state.square)).eq(near.owners.iter().copied().zip(near.squares.iter().copied())));
    assert!(read::<[f32; 4]>(device, near_parts.barycentrics, count as usize) == near.barycentrics && near.squares.contains(&0.0));
    assert_eq!(read::<u32>(device, near_parts.unfinished, 1), [0]);
    let hits = [0, 1].map(|i| read::<u32>(device, overlap_parts.hits[i], expected.hits[i].len()));
    assert!(hits == expected.hits && hits.iter().all(|words| words.iter().any(|&w| w != 0)));
    for part in overlap_parts.status {
        assert_eq!(read::<OverlapStatus>(device, part, 1)[0].unfinished, 0);
    }
    let status = read::<OverlapStatus>(device, pair_parts.status, 1)[0];
    assert_eq!((status.unfinished, status.unfilled, wide(status.pairs)), (0, 0, expected.pairs.len() as u64));
    let mut pairs: Vec<[u32; 2]> = read(device, found.all().into(), expected.pairs.len());
    pairs.sort_unstable();
    assert!(pairs.len() > 100 && pairs == expected.pairs);

    // Buffers that are too small are refused during recording.
    ok(call!(olbvh_recording_begin(recording, 0, 0, 0)));
    let refused = |status: OlbvhStatus, what: &str| assert!(status == OlbvhStatus::Invalid && message().contains(what), "{}", message());
    let less = |part: OlbvhBuffer, bytes: u64| OlbvhBuffer { size: part.size - bytes, ..part };
    let short = OlbvhField { values: less(field.values, 1), ..field };
    let slice = |slicing: OlbvhSlicing| call!(olbvh_cmd_slice(recording, a.scene, &raw const slicing));
    refused(slice(OlbvhSlicing { memory: less(slicing.memory, 256), ..slicing }), "memory");
    refused(slice(OlbvhSlicing { field: short, ..slicing }), "a field");
    let locate = |location: OlbvhLocation| call!(olbvh_cmd_locate(recording, a.scene, &raw const location));
    refused(locate(OlbvhLocation { points: less(location.points, 1), ..location }), "points");
    refused(locate(OlbvhLocation { owners: less(location.owners, 1), ..location }), "owners");
    refused(locate(OlbvhLocation { barycentrics: less(location.barycentrics, 1), ..location }), "barycentrics");
    refused(locate(OlbvhLocation { path: 0, hints: less(location.owners, 1), ..location }), "hints");
    let interpolate = |field: &OlbvhField, values| call!(olbvh_cmd_interpolate(recording, a.scene, &raw const location, field, 1, values));
    refused(interpolate(&short, interpolated.all().into()), "a field");
    refused(interpolate(&field, less(interpolated.all().into(), 1)), "values");
    refused(call!(olbvh_cmd_ranges(recording, a.scene, &raw const field, less(ranges.all().into(), 1))), "ranges");
    refused(call!(olbvh_cmd_ranges(recording, a.scene, &raw const short, ranges.all().into())), "a field");
    let draw = |picture: OlbvhPicture| call!(olbvh_cmd_render(recording, a.scene, &raw const picture));
    refused(draw(OlbvhPicture { view: less(picture.view, 8), ..picture }), "a view");
    refused(draw(OlbvhPicture { field: short, ..picture }), "a field");
    refused(draw(OlbvhPicture { normals: less(picture.normals, 1), ..picture }), "normals");
    refused(draw(OlbvhPicture { ranges: less(picture.ranges, 1), ..picture }), "ranges");
    refused(draw(OlbvhPicture { depth: less(picture.depth, 1), ..picture }), "a depth buffer");
    call!(olbvh_recording_free(recording));
    call!(olbvh_scene_free(a.scene));
    call!(olbvh_scene_free(b.scene));
}

/// A stack that is sliced in several bands.
fn large_stack(tree: *mut OlbvhTree, values: &[f32]) {
    let stack =
        OlbvhVoxels { next_voxel: [0.007, 0.0, 0.0], next_row: [0.0, 0.004, 0.0], width: 1000, height: 1400, layers: 2, ..voxels() };
    let held = call!(handle(tree, "tree")).unwrap();
    let expected = sliced(&held.tree, Some((values, On::Points)), &stack);
    let (mut answers, mut found) = (vec![0u32; 2_800_000], vec![0f32; 2_800_000]);
    ok(call!(olbvh_slice(tree, &raw const stack, values.as_ptr(), 0, 1, answers.as_mut_ptr(), found.as_mut_ptr())));
    assert!(expected.2 > 2 && expected.0 == answers, "{} bands", expected.2);
    assert!(found.iter().map(|v| v.to_bits()).eq(expected.1), "values");
}

/// Compares the owning calls with the Rust interface. With a reordered mesh the results are mapped back to the caller's
/// numbers and differ only in the owners of shared faces, edges and vertices.
pub fn owned(gpu: *mut OlbvhGpu) {
    let device = &call!(handle(gpu, "gpu")).unwrap().0;
    let [mesh, other] = meshes();
    let settings = OlbvhPictureSettings { shading: 0, ..settings() };
    let prepare = |tree: &OlbvhTree, settings: &OlbvhPictureSettings| {
        let bounds = Bounds::from(tree.tree.grid());
        let (neighbours, field) =
            (tree.mesh.device.neighbours().unwrap(), Field { name: String::new(), on: On::Points, values: values(&mesh) });
        let valid = ValidTets { bounds, neighbours: &neighbours, is_valid: &|_| true };
        Prepared::new(&call!(settings.read()).unwrap(), &mesh, &valid, &field).unwrap()
    };
    let tree_of = |mesh: &Mesh, reorder: u32| -> *mut OlbvhTree {
        // At twice the size, and then moved to where it belongs.
        let double: Vec<[f32; 3]> = mesh.points.iter().map(|p| p.map(|x| 2.0 * x)).collect();
        let (points, tets) = (double.as_ptr().cast(), mesh.tets.as_ptr().cast());
        let first: *mut OlbvhMesh =
            made(|out| call!(olbvh_mesh_upload(gpu, points, mesh.points.len(), tets, mesh.tets.len(), reorder, out)));
        let held: *mut OlbvhMesh = made(|out| call!(olbvh_mesh_moved(first, mesh.points.as_ptr().cast(), out)));
        call!(olbvh_mesh_free(first));
        let tree = made(|out| call!(olbvh_tree_build(held, null(), out)));
        for level in [1, 4] {
            let options = OlbvhBuildOptions { level, ..olbvh_default_build_options() };
            let other: *mut OlbvhTree = made(|out| call!(olbvh_tree_build(held, &raw const options, out)));
            let info: OlbvhTreeInfo = made(|out| call!(olbvh_tree_info(other, out)));
            assert_eq!(info.level, level);
            call!(olbvh_tree_free(other));
        }
        call!(olbvh_mesh_free(held));
        tree
    };
    let middle = |t: &[u32; 4]| [0, 1, 2].map(|c| t.iter().map(|&v| mesh.points[v as usize][c] / 4.0).sum::<f32>());
    let middles: Vec<[f32; 3]> = mesh.tets.iter().map(middle).collect();
    let other_tree = tree_of(&other, 1);
    let voxels = voxels();
    let mut first = None;
    for reorder in [0, 1] {
        let tree = tree_of(&mesh, reorder);
        let expected = first.get_or_insert_with(|| {
            let Prepared { plan, .. } = prepare(call!(handle(tree, "tree")).unwrap(), &settings);
            expected(device, &[mesh.clone(), other.clone()], &plan, None)
        });
        let mut owners = vec![0; middles.len()];
        ok(call!(olbvh_locate(tree, middles.as_ptr().cast(), middles.len(), -1.0, owners.as_mut_ptr(), null_mut())));
        assert!((0..).zip(&owners).all(|(tet, &owner)| tet == owner));
        sampled(tree, &mesh, &middles);
        let (count, wanted) = (mesh.points.len(), &expected.nearest);
        let (mut owners, mut places, mut distances) = (vec![0; count], vec![[0f32; 4]; count], vec![0f32; count]);
        let [to_places, to_distances] = [places.as_mut_ptr().cast(), distances.as_mut_ptr()];
        ok(call!(olbvh_nearest(tree, mesh.points.as_ptr().cast(), count, 1.0, owners.as_mut_ptr(), to_places, to_distances)));
        // In another order, equally near places are found in other tetrahedra.
        assert!(owners == wanted.owners && places == wanted.barycentrics || reorder == 1);
        assert!(distances.iter().zip(wanted.distances()).all(|(a, b)| (a - b).abs() < 1e-5 || a.is_nan() && b.is_nan()));
        let values = values(&mesh);
        let mut colors = vec![[0f32; 4]; 37 * 30];
        ok(call!(olbvh_render(tree, &raw const settings, values.as_ptr(), 0, colors.as_mut_ptr().cast())));
        let (mut answers, mut sliced) = (vec![0u32; 17 * 13 * 6], vec![0f32; 17 * 13 * 6]);
        ok(call!(olbvh_slice(tree, &raw const voxels, values.as_ptr(), 0, 1, answers.as_mut_ptr(), sliced.as_mut_ptr())));
        let mut hits = expected.hits.clone().map(|words| vec![u32::MAX; words.len()]);
        let [of_mesh, of_other] = &mut hits;
        ok(call!(olbvh_overlap(tree, other_tree, of_mesh.as_mut_ptr(), of_other.as_mut_ptr())));
        assert!(hits == expected.hits, "reorder {reorder}");
        let kinds = |answers: &[u32]| answers.iter().map(|&a| if a == u32::MAX { 2 } else { a >> 31 }).collect::<Vec<_>>();
        assert_eq!(kinds(&answers), kinds(&expected.answers), "reorder {reorder}");
        let same = answers.iter().zip(&expected.answers).filter(|(a, b)| a == b).count();
        assert!(same == answers.len() || reorder == 1 && same > answers.len() * 9 / 10, "{same} of {}", answers.len());
        assert!(colors == expected.colors || reorder == 1, "colours");
        assert!(sliced.iter().map(|v| v.to_bits()).eq(expected.sliced.iter().copied()) || reorder == 1, "values");
        let near = |a: &f32, b: u32| (a - f32::from_bits(b)).abs() < 1e-3 || a.is_nan();
        assert!(sliced.iter().zip(&expected.sliced).filter(|(a, b)| near(a, **b)).count() > answers.len() * 9 / 10);
        if reorder == 0 {
            large_stack(tree, &values);
            let fresh = tree_of(&mesh, 0);
            pictures(fresh, &values, &|settings| prepare(call!(handle(fresh, "tree")).unwrap(), settings));
            call!(olbvh_tree_free(fresh));
        }
        call!(olbvh_tree_free(tree));
    }
    let mut none = OlbvhPictureSettings { iso_count: 9, ..settings };
    assert_eq!(call!(olbvh_render(other_tree, &raw const none, null(), 0, null_mut())), OlbvhStatus::Invalid);
    assert!(message().contains("9 iso-surfaces"), "{}", message());
    none = OlbvhPictureSettings { camera: c"nowhere".as_ptr(), ..settings };
    assert_eq!(call!(olbvh_render(other_tree, &raw const none, null(), 0, null_mut())), OlbvhStatus::Invalid);
    assert!(message().contains("nowhere"), "{}", message());
    call!(olbvh_tree_free(other_tree));
}

/// Samples three components at the middles of all tetrahedra, and outside: numbers of the tetrahedra, and the coordinates.
fn sampled(tree: *mut OlbvhTree, mesh: &Mesh, middles: &[[f32; 3]]) {
    let mut points = middles.to_vec();
    points.push([1e6; 3]);
    let numbers: Vec<[f32; 2]> = (0..mesh.tets.len()).map(|t| [t as f32, -(t as f32)]).collect();
    let sample = |values: *const f32, components, on_cells, results: *mut f32| {
        call!(olbvh_sample(tree, points.as_ptr().cast(), points.len(), -1.0, values, components, on_cells, results))
    };
    let mut of_cells = vec![[0f32; 2]; points.len()];
    ok(sample(numbers.as_ptr().cast(), 2, 1, of_cells.as_mut_ptr().cast()));
    assert_eq!(of_cells[..middles.len()], numbers[..]);
    let mut places = vec![[0f32; 3]; points.len()];
    ok(sample(mesh.points.as_ptr().cast(), 3, 0, places.as_mut_ptr().cast()));
    assert!(places.iter().zip(middles).all(|(a, b)| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4)));
    assert!(of_cells[middles.len()].iter().chain(&places[middles.len()]).all(|v| v.is_nan()));
    for (components, what) in [(3, "values"), (0, "components")] {
        assert_eq!(sample(null(), components, 0, places.as_mut_ptr().cast()), OlbvhStatus::Invalid);
        assert!(message().contains(what), "{}", message());
    }
}
