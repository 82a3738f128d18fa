//! Slices, pictures and overlaps of a moving mesh, recorded after a build into one command buffer, equal those of the
//! owning calls and of the reference implementation.

use crate::host::Frame;
use crate::host::queries::Queries;
use crate::submit::submit;
use bytemuck::Pod;
use olbvh::baseline::Lbvh;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Arena, BufferRef, Gpu, GpuOptions};
use olbvh::layout::{OverlapStatus, RenderStatus, SliceStatus};
use olbvh::mesh::{Bounds, Field, Mesh, On, kuhn_jittered};
use olbvh::options::{BuildOptions, Lists};
use olbvh::query::{
    PairMemory, RenderInput, RenderMemory, Rounds, SILENT, Scene, SliceInput, SliceMemory, cmd_count_pairs, cmd_list_pairs, cmd_render,
    cmd_slice, overlap, overlap_pairs, render, slice,
};
use olbvh::reference::boundary::topology;
use olbvh::reference::build::build;
use olbvh::reference::locate::Locator;
use olbvh::reference::overlap::{OverlapSide, overlap as reference};
use olbvh::reference::slice::Slicer;
use olbvh::render::{PicturePlan, RenderSettings};
use olbvh::slicing::{Band, Extrapolate, Rows};

/// The number of pairs that the frames have room for.
const ROOM: usize = 1300;

/// Frame `i` of a mesh that turns and grows.
fn moved(mesh: &Mesh, i: u32) -> Mesh {
    let (sin, cos) = (0.4 * i as f32).sin_cos();
    let mut moved = mesh.clone();
    for p in &mut moved.points {
        let [x, y, z] = *p;
        *p = [cos * x - sin * y, sin * x + cos * y, z * (1.0 + 0.1 * i as f32)];
    }
    moved
}

fn read<T: Pod>(gpu: &Gpu, queries: &Queries, part: BufferRef, n: usize) -> Vec<T> {
    gpu.download(&queries.memory, part.part(0, (n * size_of::<T>()) as u64)).unwrap()
}

fn bits(words: &[u32]) -> Vec<u32> {
    (0..32 * words.len() as u32).filter(|i| words[(i / 32) as usize] >> (i % 32) & 1 != 0).collect()
}

fn compare_slice(gpu: &Gpu, queries: &Queries, slicer: &Slicer<'_>, values: &[f32], tree: &Tree) -> SliceStatus {
    let n = (queries.rows.count * 37) as usize;
    let (answers, found): (Vec<u32>, Vec<f32>) =
        (read(gpu, queries, queries.slice.answers, n), read(gpu, queries, queries.slice.values, n));
    let expected = slicer.band(queries.rows);
    let answer = |i: usize| match expected.kinds[i] {
        olbvh::slicing::INSIDE => expected.owners[i],
        olbvh::slicing::TOUCHED => expected.owners[i] | 1 << 31,
        _ => u32::MAX,
    };
    assert_eq!(answers, (0..n).map(answer).collect::<Vec<_>>());
    let mut owned = Band::default();
    let mut keep = |band: Band| {
        owned.values.extend(band.values);
        owned.owners.extend(band.owners);
        Ok(())
    };
    slice(tree, Some((values, On::Points)), &queries.voxels, Extrapolate::Nearest, SILENT, &mut keep).unwrap();
    assert_eq!(owned.owners, expected.owners);
    let to_bits = |values: &[f32]| values.iter().map(|x| if x.is_nan() { u32::MAX } else { x.to_bits() }).collect::<Vec<_>>();
    assert_eq!(to_bits(&owned.values), to_bits(&found), "values of the recorded and the owning form");
    let status: SliceStatus = read(gpu, queries, queries.slice.status, 1)[0];
    let kinds = |kind: u8| expected.kinds.iter().map(|&k| u32::from(k == kind)).sum::<u32>();
    assert_eq!((status.locating, status.touching, status.refused), (0, 0, 0));
    assert_eq!([status.empty, status.touched, status.inside], [kinds(0), kinds(1), kinds(2)]);
    status
}

/// Compares the picture with that of the owning call. Returns the number of samples
/// found, and skipped.
fn compare_picture(gpu: &Gpu, queries: &Queries, values: &[f32], tree: &Tree) -> [u64; 2] {
    let (plan, picture) = (&queries.plan, &queries.picture);
    let owned = render(tree, plan, (values, On::Points), Some(&queries.normals), SILENT).unwrap();
    let found: Vec<[f32; 4]> = read(gpu, queries, picture.colors, owned.colors.len());
    assert!(found == owned.colors, "colours of the recorded and the owning form");
    let status: RenderStatus = read(gpu, queries, picture.status, 1)[0];
    let low = [status.samples, status.found, status.skipped].map(|[low, high]| u64::from(low) | u64::from(high) << 32);
    assert_eq!((low, status.unfinished), ([owned.stats.samples, owned.stats.found_samples, owned.stats.skipped_samples], 0));
    [low[1], low[2]]
}

/// Compares all owners of the mesh's points, or as many as there was room for. Returns their number.
fn compare_owners(gpu: &Gpu, queries: &Queries, locator: &Locator<'_>, points: &[[f32; 3]]) -> usize {
    let expected: Vec<Vec<u32>> = points.iter().map(|&p| locator.owners(p)).collect();
    let ends: Vec<u32> = read(gpu, queries, queries.owners.ends, points.len());
    let counted = |sum: &mut usize, owners: &Vec<u32>| {
        *sum += owners.len();
        Some(*sum as u32)
    };
    assert_eq!(ends, expected.iter().scan(0, counted).collect::<Vec<_>>());
    let all = expected.concat();
    assert_eq!(read::<u32>(gpu, queries, queries.owners.total, 1), [all.len() as u32]);
    let n = all.len().min(ROOM);
    assert_eq!(read::<u32>(gpu, queries, queries.owner_lists, n), all[..n]);
    all.len()
}

fn frames(gpu: &Gpu) {
    let mesh = kuhn_jittered([5, 4, 6], 0.2, 3).unwrap();
    let values: Vec<f32> = mesh.points.iter().map(|p| p[0] - 0.5 * p[2]).collect();
    let mut other = kuhn_jittered([4; 3], 0.3, 9).unwrap();
    other.points.iter_mut().for_each(|p| *p = p.map(|x| x - 1.3));
    let frame = Frame::new(gpu, &mesh);
    let queries = Queries::new(gpu, &frame, &values, &other, ROOM as u64);
    let other_topology = topology(&other).unwrap();
    let other_tree = build(&other, &other_topology, queries.other_tree.options()).unwrap();
    let (mut listed, mut touched, mut met, mut cut, mut drawn) = (0, 0, 0, 0, [0; 2]);
    for i in 0..6 {
        let shown = moved(&mesh, i);
        let staging = gpu.upload("olbvh.test.staging", &shown.points).unwrap();
        submit(gpu, "olbvh.test.frame", |r| {
            r.copy(staging.all(), frame.input.positions);
            r.barrier("frame.positions → frame.mesh");
            frame.record(r)?;
            queries.record(r)
        })
        .unwrap();

        let topology = topology(&shown).unwrap();
        let host = build(&shown, &topology, &BuildOptions::default()).unwrap();
        let device = DeviceMesh::upload(gpu, &shown, BadCells::Skip).unwrap();
        let tree = Tree::build(gpu, &device, &BuildOptions::default()).unwrap();
        let field = Field { name: "x".into(), on: On::Points, values: values.clone() };
        let slicer = Slicer::new(&shown, &topology, &host, Some(&field), queries.voxels, Extrapolate::Nearest).unwrap();
        listed += compare_owners(gpu, &queries, &Locator::new(&shown, &topology, &host), &shown.points);
        touched += compare_slice(gpu, &queries, &slicer, &values, &tree).touched;
        let seen = compare_picture(gpu, &queries, &values, &tree);
        drawn = [drawn[0] + seen[0], drawn[1] + seen[1]];

        let (a, b) = (
            OverlapSide { mesh: &shown, topology: &topology, tree: &host },
            OverlapSide { mesh: &other, topology: &other_topology, tree: &other_tree },
        );
        let (sets, pairs) = (reference(a, b, false), reference(a, b, true).pairs.unwrap());
        let hits = |k: usize, n: usize| bits(&read(gpu, &queries, queries.sets.hits[k], n.div_ceil(32)));
        assert_eq!((hits(0, shown.tets.len()), hits(1, other.tets.len())), (sets.a.clone(), sets.b.clone()), "frame {i}");
        assert_eq!(overlap(&tree, &queries.other_tree, SILENT).unwrap().overlap, sets, "frame {i}");
        let statuses = queries.sets.status.map(|part| read::<OverlapStatus>(gpu, &queries, part, 1)[0]);
        assert!(statuses.iter().all(|s| s.unfinished == 0 && s.empty == 0));

        let status: OverlapStatus = read(gpu, &queries, queries.pairs.status, 1)[0];
        assert_eq!((status.unfinished, status.unfilled, status.pairs), (0, 0, [pairs.len() as u32, 0]), "frame {i}");
        let mut found: Vec<[u32; 2]> = read(gpu, &queries, queries.found, pairs.len().min(ROOM));
        found.chunk_by_mut(|x, y| x[0] == y[0]).for_each(<[_]>::sort_unstable);
        let whole = found.len() - found.iter().rev().take_while(|p| p[0] == found[found.len() - 1][0]).count();
        assert_eq!(found[..whole], pairs[..whole], "frame {i}");
        assert!(found.iter().all(|p| pairs.binary_search(p).is_ok()), "frame {i}");
        met += found.len();
        cut += usize::from(pairs.len() > ROOM);
    }
    assert!(listed > 1000 && touched > 1000 && met > 1000 && cut > 0 && cut < 6, "{touched} {met} {cut}");
    assert!(drawn.iter().all(|&samples| samples > 500), "{drawn:?}");
}

both_bindings!(frames, by_address, by_descriptors);

/// Rounds in separate submissions, one at a time, end with the result of the owning calls.
#[test]
fn rounds_go_on_where_they_ended() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let options = BuildOptions { lists: Lists::All, ..BuildOptions::default() };
    let one = kuhn_jittered([1; 3], 0.0, 0).unwrap();
    let copies = if std::env::var("OLBVH_TEST_DRIVER").is_ok_and(|d| d == "swiftshader") { 900 } else { 6000 };
    let mesh = Mesh::new(one.points.clone(), vec![one.tets[0]; copies]);
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(&gpu, &device, &options).unwrap();
    let axis = |c: usize| [0, 1, 2].map(|k| if k == c { 0.4 } else { 0.0 });
    let voxels = olbvh::slicing::VoxelGrid {
        origin: [-0.35, -0.35, 0.3],
        next_voxel: axis(0),
        next_row: axis(1),
        next_layer: axis(2),
        half: [axis(0), axis(1), axis(2)].map(|a| a.map(|x| x / 2.0)),
        size: [5, 5],
        layers: 1,
    };
    let rows = Rows { layer: 0, first: 0, count: 5 };
    let scene = Scene::of(&tree);
    let input = SliceInput { voxels: &voxels, rows, field: None, extrapolate: Extrapolate::Nearest };
    let carve = |a: &mut Arena| SliceMemory::carve(a, [5, 5], 5);
    let (buffer, memory) = Arena::reserve(&gpu, "olbvh.test.slice", carve).unwrap();
    // The same number of voxels, but more side by side.
    let wide = olbvh::slicing::VoxelGrid { size: [25, 1], ..voxels };
    let wide = SliceInput { voxels: &wide, rows: Rows { count: 1, ..rows }, ..input };
    let refused = submit(&gpu, "olbvh.test.wide", |r| cmd_slice(r, &scene, &wide, &memory, Rounds::begin(1)));
    assert!(refused.is_err_and(|e| e.to_string().contains("1 rows of 25 voxels in memory for 25 voxels in 5 runs")));
    // A row that the layer lacks, although the stack goes on.
    let two = olbvh::slicing::VoxelGrid { layers: 2, ..voxels };
    let beyond = SliceInput { voxels: &two, rows: Rows { first: 5, count: 1, ..rows }, ..input };
    let refused = cmd_slice(&mut olbvh::gpu::Recorder::rehearse(&gpu), &scene, &beyond, &memory, Rounds::begin(1));
    assert!(refused.is_err_and(|e| e.to_string().contains("1 rows from row 5 of layer 0 on")));
    let (mut rounds, mut submissions) = (Rounds::begin(1), 0);
    let status = loop {
        submit(&gpu, "olbvh.test.round", |r| cmd_slice(r, &scene, &input, &memory, rounds)).unwrap();
        rounds = Rounds::resume(1);
        submissions += 1;
        let status = gpu.download::<SliceStatus>(&buffer, memory.status).unwrap()[0];
        if status.locating + status.touching == 0 {
            break status;
        }
        assert!(status.locating == 0 || status.inside == 0, "counted before all are located");
        assert_eq!(status.touched, 0, "counted before the end");
        assert_eq!(status.inside + status.empty, if status.locating == 0 { 25 } else { 0 }, "what is not inside may be empty");
    };
    assert!(submissions > 1 || copies < 6000);
    assert_eq!(status.inside + status.touched + status.empty, 25);
    let answers: Vec<u32> = gpu.download(&buffer, memory.answers.part(0, 100)).unwrap();
    // All rounds in one recording give the same.
    submit(&gpu, "olbvh.test.rounds", |r| cmd_slice(r, &scene, &input, &memory, Rounds::begin(40))).unwrap();
    assert_eq!(gpu.download::<SliceStatus>(&buffer, memory.status).unwrap()[0], status);
    assert_eq!(gpu.download::<u32>(&buffer, memory.answers.part(0, 100)).unwrap(), answers);

    let lbvh = Lbvh::build(&gpu, &device).unwrap();
    picture_goes_on(&gpu, &scene, &mesh.points, false);
    let (plan, values, surface) = picture_goes_on(&gpu, &scene, &mesh.points, true);
    let drawn = lbvh.render(&plan, (&values, On::Points), None, SILENT).unwrap();
    assert!(surface == drawn.colors, "a surface by either structure");

    let few = DeviceMesh::upload(&gpu, &one, BadCells::Skip).unwrap();
    let few_tree = Tree::build(&gpu, &few, &options).unwrap();
    let few_scene = Scene::of(&few_tree);
    let expected = overlap_pairs(&few_tree, &tree, SILENT).unwrap();
    let expected = expected.overlap.pairs.unwrap();
    let carve = |a: &mut Arena| Ok((PairMemory::carve(&gpu, a, one.tets.len() as u32)?, a.take(8 * expected.len() as u64)?));
    let (buffer, (memory, found)) = Arena::reserve(&gpu, "olbvh.test.pairs", carve).unwrap();
    let status = || gpu.download::<OverlapStatus>(&buffer, memory.status).unwrap()[0];
    // With too few rounds to count all pairs, nothing is written, and the status says so.
    submit(&gpu, "olbvh.test.rounds", |r| {
        cmd_count_pairs(r, &few_scene, &scene, &memory, Rounds::begin(1))?;
        cmd_list_pairs(r, &few_scene, &scene, &memory, found, Rounds::begin(1))
    })
    .unwrap();
    assert!(status().unfinished > 0 && status().unfilled > 0);
    while status().unfinished > 0 {
        submit(&gpu, "olbvh.test.rounds", |r| cmd_count_pairs(r, &few_scene, &scene, &memory, Rounds::resume(2))).unwrap();
    }
    submit(&gpu, "olbvh.test.rounds", |r| cmd_list_pairs(r, &few_scene, &scene, &memory, found, Rounds::begin(1))).unwrap();
    while status().unfilled > 0 {
        submit(&gpu, "olbvh.test.rounds", |r| cmd_list_pairs(r, &few_scene, &scene, &memory, found, Rounds::resume(2))).unwrap();
    }
    assert_eq!(gpu.download::<[u32; 2]>(&buffer, found.part(0, 8 * expected.len() as u64)).unwrap(), expected);

    // Where there is room for some pairs only, the others are not written behind it.
    let untouched = [0x5555_5555; 2];
    let guarded = gpu.upload("olbvh.test.guarded", &vec![untouched; expected.len()]).unwrap();
    let room = expected.len() / 3;
    let some = guarded.all().part(0, 8 * room as u64);
    let count = |rounds| submit(&gpu, "olbvh.test.rounds", |r| cmd_count_pairs(r, &few_scene, &scene, &memory, rounds)).unwrap();
    let list = |rounds| submit(&gpu, "olbvh.test.rounds", |r| cmd_list_pairs(r, &few_scene, &scene, &memory, some, rounds)).unwrap();
    count(Rounds::begin(2));
    while status().unfinished > 0 {
        count(Rounds::resume(2));
    }
    list(Rounds::begin(2));
    while status().unfilled > 0 {
        list(Rounds::resume(2));
    }
    let written: Vec<[u32; 2]> = gpu.download(&guarded, guarded.all()).unwrap();
    assert_eq!(written[..room], expected[..room]);
    assert!(room > 1 && written[room..].iter().all(|&pair| pair == untouched));
    assert_eq!(status().pairs, [expected.len() as u32, 0], "how many there are is told nevertheless");
}

/// A picture drawn in several recordings equals that of one recording: of a volume, or of a surface across it.
fn picture_goes_on(gpu: &Gpu, scene: &Scene, points: &[[f32; 3]], iso: bool) -> (PicturePlan, Vec<f32>, Vec<[f32; 4]>) {
    let (surfaces, step) = if iso { (vec![0.7], 0.1) } else { (vec![], 0.2) };
    let settings = RenderSettings { size: [4, 3], step: Some(step), iso: surfaces, ..RenderSettings::default() };
    let plan = PicturePlan::new(&settings, &Bounds { lo: [0.0; 3], hi: [1.0; 3] }, [0.0; 3], Some([0.0, 1.0])).unwrap();
    let view = gpu.upload("olbvh.test.view", &[plan.view()]).unwrap();
    let table = gpu.upload("olbvh.test.table", &plan.table).unwrap();
    let values: Vec<f32> = points.iter().map(|p| if iso { p[0] } else { 0.9 }).collect();
    let field = gpu.upload("olbvh.test.field", &values).unwrap();
    let field = (field.all(), On::Points);
    let input = RenderInput::of(&plan, view.all(), table.all(), field);
    let carve = |a: &mut Arena| RenderMemory::carve(a, [4, 3], None);
    let buffer = gpu.upload("olbvh.test.picture", &vec![0x55u8; Arena::measure(carve).unwrap() as usize]).unwrap();
    let memory = carve(&mut Arena::new(buffer.all())).unwrap();
    let draw = |rounds: Rounds| {
        submit(gpu, "olbvh.test.round", |r| cmd_render(r, scene, &input, &memory, rounds)).unwrap();
        let colors: Vec<[f32; 4]> = gpu.download(&buffer, memory.colors.part(0, 12 * 16)).unwrap();
        (colors, RenderStatus { met: 0, ..gpu.download::<RenderStatus>(&buffer, memory.status).unwrap()[0] })
    };
    let (colors, status) = draw(Rounds::begin(0));
    assert_eq!((colors, status), (vec![[0.0; 4]; 12], RenderStatus { unfinished: 12, ..Default::default() }));
    let (mut rounds, mut last) = (0, 12);
    let (colors, status) = loop {
        let drawn = draw(Rounds::resume(1));
        rounds += 1;
        assert!(drawn.1.unfinished <= last);
        last = drawn.1.unfinished;
        if last == 0 {
            break drawn;
        }
    };
    assert!(rounds > 2 || scene.mesh.input.tets < 1000, "{rounds}");
    assert!(status.found[0] > 0 && colors.iter().any(|c| c[3] > 0.0));
    assert!(draw(Rounds::begin(rounds)) == (colors.clone(), status), "all rounds in one recording");
    assert!(draw(Rounds::begin(rounds + 1)) == (colors.clone(), status), "a round more");
    if rounds > 1 {
        assert!(draw(Rounds::begin(rounds - 1)).1.unfinished > 0, "a round less");
    }
    let more = submit(gpu, "olbvh.test.round", |r| cmd_render(r, scene, &RenderInput { size: [4, 4], ..input }, &memory, Rounds::begin(1)));
    assert!(more.unwrap_err().to_string().contains("4×4 pixels"));
    (plan, values, colors)
}

/// The status reports what a recording cannot know beforehand: boxes too large for the mesh, and a mesh without valid
/// tetrahedra.
#[test]
fn what_cannot_be_asked_is_told() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([3; 3], 0.2, 1).unwrap();
    let frame = Frame::new(&gpu, &mesh);
    let mut queries = Queries::new(&gpu, &frame, &vec![0.0; mesh.points.len()], &mesh, 100);
    for (half, refused) in [([0.0; 3], 1), ([100.0, 0.0, 0.0], 2), ([1e36; 3], 2), ([0.1, 0.0, 0.0], 0)] {
        queries.voxels.half[0] = half;
        let checked = queries.voxels.check_over(DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap().grid());
        assert_eq!(checked.is_ok(), refused == 0, "{checked:?}");
        submit(&gpu, "olbvh.test.frame", |r| {
            frame.record(r)?;
            queries.record(r)
        })
        .unwrap();
        let status: SliceStatus = read(&gpu, &queries, queries.slice.status, 1)[0];
        assert_eq!((status.refused, status.locating, status.touching), (refused, 0, 0), "{half:?}");
        assert_eq!(status.empty == 37 * 29 * 9, refused != 0, "{half:?}");
    }
    let nothing = Mesh::new(mesh.points.clone(), vec![[0; 4]; mesh.tets.len()]);
    let queries = Queries::new(&gpu, &frame, &vec![0.0; mesh.points.len()], &nothing, 100);
    submit(&gpu, "olbvh.test.frame", |r| {
        frame.record(r)?;
        queries.record(r)
    })
    .unwrap();
    let status: OverlapStatus = read(&gpu, &queries, queries.pairs.status, 1)[0];
    assert_eq!((status.pairs, status.unfinished, status.unfilled, status.narrow, status.empty), ([0; 2], 0, 0, [0; 2], 1));
    for (status, hits) in queries.sets.status.into_iter().zip(queries.sets.hits) {
        let status: OverlapStatus = read(&gpu, &queries, status, 1)[0];
        assert_eq!((status.by_vertex, status.waiting, status.located, status.empty), (0, 0, 0, 1));
        assert!(bits(&read(&gpu, &queries, hits, mesh.tets.len().div_ceil(32))).is_empty());
    }
}
