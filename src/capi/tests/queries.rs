//! Tests of every recorded query, as a C program calls it: the results are the same bytes as from Rust.

use super::*;
use crate::capi::query::*;
use crate::gpu::Buffer;
use crate::layout::{NearState, OverlapStatus, RenderStatus, SliceStatus, ViewUniforms, wide};
use crate::mesh::Bounds;
use crate::options::TOLERANCE;
use crate::query::{LocateOptions, Nearest, SILENT, locate, locate_all, nearest, overlap, overlap_pairs, render, slice};
use crate::render::{PicturePlan, ProjectedView};
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

pub fn voxels() -> OlbvhVoxels {
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

pub fn meshes() -> [Mesh; 2] {
    let mut other = kuhn_jittered([3; 3], 0.3, 9).unwrap();
    other.points.iter_mut().for_each(|p| *p = p.map(|x| x + 1.3));
    [kuhn_jittered([5, 4, 3], 0.3, 1).unwrap(), other]
}

pub fn values(mesh: &Mesh) -> Vec<f32> {
    mesh.points.iter().map(|p| p[0] - 0.5 * p[2]).collect()
}

/// Results of the Rust interface.
pub struct Expected {
    pub colors: Vec<[f32; 4]>,
    pub answers: Vec<u32>,
    pub sliced: Vec<u32>,
    pub hits: [Vec<u32>; 2],
    pub pairs: Vec<[u32; 2]>,
    pub owners: Vec<Vec<u32>>,
    pub located: Vec<f32>,
    pub nearest: Nearest,
}

/// Answers, bits of the values, and the number of bands of a stack.
pub fn sliced(tree: &Tree, field: Option<(&[f32], On)>, voxels: &OlbvhVoxels) -> (Vec<u32>, Vec<u32>, u32) {
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

pub fn expected(gpu: &Gpu, meshes: &[Mesh; 2], plan: &PicturePlan, normals: Option<&[[f32; 3]]>) -> Expected {
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
