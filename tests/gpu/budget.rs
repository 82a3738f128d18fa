//! A budget in bytes: trees keep within it, are as deep as it allows, equal those of the reference implementation, and
//! are refused with figures where not even the root fits.

use crate::submit::submit;
use olbvh::Error;
use olbvh::build::{BadCells, BuildScratch, Capacity, DeviceMesh, ScenePlan, Tree, TreeMemory, cmd_build};
use olbvh::gpu::{Arena, BufferRef, Gpu, GpuOptions};
use olbvh::layout::BuildStatus;
use olbvh::mesh::{Mesh, kuhn, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, Fineness, Lists};
use olbvh::query::{
    LocateMethod, LocateOptions, LocateOutput, OverlapMemory, PointInput, Rounds, SILENT, Scene, cmd_locate, cmd_overlap, locate,
};
use olbvh::reference::boundary::topology;
use olbvh::reference::build::build;
use olbvh::reference::depth::measure;
use olbvh::reference::locate::Locator;
use olbvh::reference::vertices::Vertices;
use olbvh::tree::stored::{split_entries, split_slabs};
use olbvh::tree::{TreeArrays, TreeBytes};

/// A mesh that fills little of its bounds, so that a level has far fewer nodes than cells.
fn diagonal() -> Mesh {
    let mut mesh = kuhn_jittered([24, 2, 2], 0.2, 5).unwrap();
    mesh.points.iter_mut().for_each(|p| *p = [p[0], p[1] + p[0], p[2] + 0.7 * p[0]]);
    mesh
}

/// Flat tetrahedra that are points, which call for a deep tree, and tetrahedra that fill the bounds.
fn uneven() -> Mesh {
    let mut points = vec![[0.5; 3]; 4];
    points.extend([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    let mut tets = vec![[0, 1, 2, 3]; 600];
    tets.extend(vec![[4, 5, 6, 7]; 33]);
    Mesh::new(points, tets)
}

/// Without a given capacity, the usual one applies.
fn usual(gpu: &Gpu) {
    let mesh = uneven();
    let topology = topology(&mesh).unwrap();
    let device = DeviceMesh::upload(gpu, &mesh, BadCells::Skip).unwrap();
    let tree = Tree::build(gpu, &device, &BuildOptions::default()).unwrap();
    assert_eq!((tree.status().wanted_level, tree.status().level), (9, 4), "33·8^5 entries are more than 2^20");
    assert_eq!(tree.download().unwrap(), build(&mesh, &topology, &BuildOptions::default()).unwrap());
    // Levels that are asked for, coarser and finer than the heuristic would choose. Capacities still hold.
    for (level, capacity, built) in [(2, None, 2), (10, None, 4), (10, Some(100_000), 3)] {
        let options = BuildOptions { alpha: 1.5, level: Some(level), capacity, ..BuildOptions::default() };
        let tree = Tree::build(gpu, &device, &options).unwrap();
        assert_eq!(tree.status().level, built);
        assert_eq!(tree.download().unwrap(), build(&mesh, &topology, &options).unwrap());
    }
}

fn check(gpu: &Gpu, name: &str, mesh: &Mesh) {
    let topology = topology(mesh).unwrap();
    let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip).unwrap();
    let sizes = measure(mesh, &topology, &Vertices::new(mesh, &topology.grid));
    let deepest = sizes.level(&BuildOptions::default()).unwrap();
    for (assign, lists, boxes, slabs) in [
        (Assign::Aabb, Lists::All, false, true),
        (Assign::Aabb, Lists::All, true, false),
        (Assign::Exact, Lists::All, true, false),
        (Assign::Planes, Lists::Boundary, false, false),
        (Assign::Planes, Lists::Boundary, false, true),
    ] {
        let unlimited = BuildOptions { assign, lists, boxes, slabs, ..BuildOptions::default() };
        let of = |level: u32| TreeBytes::most(&sizes.entries, level, &unlimited).total();
        let options = |budget: u64| BuildOptions { budget: Some(budget), ..unlimited };
        // A budget that is too small by one byte: both refuse it, with the sizes.
        let (short, what) = (of(0) - 1, format!("{name} {assign} {lists} boxes {boxes} slabs {slabs}"));
        let refused = [Tree::build(gpu, &device, &options(short)).err(), build(mesh, &topology, &options(short)).err()];
        for error in refused {
            let Some(Error::TooLarge(text)) = error else { panic!("{what}: {error:?}") };
            assert!(text.contains(&of(0).to_string()) && text.contains(&short.to_string()), "{what}: {text}");
        }
        let ample = of(deepest) + 1000;
        for budget in (0..=deepest).flat_map(|l| [of(l), of(l) + 3, of(l + 1) - 1]).chain([ample, 1 << 40]) {
            let tree = Tree::build(gpu, &device, &options(budget)).unwrap().download().unwrap();
            assert_eq!(tree, build(mesh, &topology, &options(budget)).unwrap(), "{what}, {budget} bytes");
            tree.validate(mesh, &topology).unwrap_or_else(|e| panic!("{what}, {budget} bytes: {e}"));
            assert!(tree.memory().total() <= budget, "{what}: {} of {budget} bytes", tree.memory().total());
            let level = tree.grid.level;
            assert!(level == deepest || of(level + 1) > budget, "{what}: level {level} in {budget} bytes");
        }
    }
    // Every point is found in a tree of a small budget, with the lowest tetrahedron that contains it.
    let of = |budget: Option<u64>| {
        let tree = Tree::build(gpu, &device, &BuildOptions { budget, ..BuildOptions::default() }).unwrap();
        let found = locate(&tree, &mesh.points, None, &LocateOptions::default(), SILENT).unwrap();
        (tree.status().level, found.owners)
    };
    let ((coarse, found), (fine, expected)) = (of(Some(TreeBytes::most(&sizes.entries, 1, &BuildOptions::default()).total())), of(None));
    assert!(coarse < fine, "{name}");
    assert_eq!(found, expected, "{name}");
    assert!(!found.contains(&u32::MAX), "{name}");
}

fn everything(gpu: &Gpu) {
    check(gpu, "kuhn", &kuhn([6; 3]).unwrap());
    check(gpu, "diagonal", &diagonal());
    usual(gpu);
}

both_bindings!(everything, by_address, by_descriptors);

/// A recorded build into a given number of bytes keeps within them, whatever the mesh.
#[test]
fn memory_of_a_recorded_build() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = diagonal();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let view = device.view();
    let tets = view.input.tets;
    let mut levels = Vec::new();
    for bytes in [64 << 10, 256 << 10, 1 << 20, 8 << 20] {
        let options = BuildOptions { budget: Some(bytes), ..BuildOptions::default() };
        let capacity = Capacity::for_bytes(bytes, 8, &options).unwrap();
        let size = Arena::measure(|a| TreeMemory::carve(a, &capacity, &options)).unwrap();
        assert!(size <= bytes && size > bytes - bytes / 8, "{size} of {bytes}");
        let carve =
            |a: &mut Arena| Ok((TreeMemory::carve(a, &capacity, &options)?, BuildScratch::carve(&gpu, a, tets, &capacity, &options)?));
        let (memory, (tree, scratch)) = Arena::reserve(&gpu, "olbvh.test.tree", carve).unwrap();
        submit(&gpu, "olbvh.test.build", |r| cmd_build(r, &view, &tree, &options, &scratch)).unwrap();
        let status = gpu.download::<BuildStatus>(&memory, tree.status.part(0, size_of::<BuildStatus>() as u64)).unwrap()[0];
        assert!(status.overflow == 0 && status.entries <= capacity.entries && status.nodes <= capacity.nodes);
        levels.push(status.level);
    }
    assert!(levels.is_sorted() && levels[0] < levels[3], "{levels:?}");
    assert!(matches!(Capacity::for_bytes(100, 8, &BuildOptions::default()), Err(Error::TooLarge(_))));
}

/// A recorded build, and what is located in its tree.
struct Built {
    tree: TreeMemory,
    owners: BufferRef,
}

fn one<T: bytemuck::AnyBitPattern>(content: &[u32], part: BufferRef) -> T {
    bytemuck::pod_read_unaligned(bytemuck::cast_slice(&content[part.offset() as usize / 4..][..size_of::<T>() / 4]))
}

/// The part of a tree that was built.
fn arrays(content: &[u32], tree: &TreeMemory, status: &BuildStatus) -> TreeArrays {
    let words = |part: BufferRef, n: u32| content[part.offset() as usize / 4..][..n as usize].to_vec();
    let (nodes, internal) = (status.nodes, status.internal);
    let grid = one(content, tree.grid);
    let (p, quarters) = split_entries(words(tree.p, status.entries), &grid);
    let (po, slabs) =
        split_slabs(words(tree.po, if tree.slabs { 2 * status.leaves + 1 } else { status.leaves + 1 }), status.leaves as usize);
    TreeArrays {
        assign: tree.assign,
        lists: tree.lists,
        grid,
        p,
        quarters,
        po,
        slabs,
        co: words(tree.co, internal + 1),
        no: status.levels[..=status.level as usize].to_vec(),
        flags: words(tree.flags, nodes.div_ceil(32)),
        masks: words(tree.masks, nodes.div_ceil(4)),
        boxes: None,
    }
}

/// Every capacity, from one entry per tetrahedron, which the root may need, to more than the deepest level takes, gives
/// the deepest tree that fits: by its candidates or, where there is memory for those of every level, by its entries.
/// The tree keeps within its memory, and every point is found in it. A capacity of one candidate less is refused before
/// anything is recorded.
#[test]
fn every_capacity() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn_jittered([3, 3, 4], 0.3, 2).unwrap();
    let topology = topology(&mesh).unwrap();
    let sizes = measure(&mesh, &topology, &Vertices::new(&mesh, &topology.grid));
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Reject).unwrap();
    let view = device.view();
    let (input, tets) = (view.input, view.input.tets);
    let points = PointInput { points: input.positions, stride: input.stride, count: input.points, hints: None, order: None };
    for (lists, by_entries) in [(Lists::All, false), (Lists::Boundary, false), (Lists::Boundary, true)] {
        let options = BuildOptions { lists, ..BuildOptions::default() };
        let deepest = sizes.level(&options).unwrap();
        let trees: Vec<_> = (0..=deepest).map(|l| build(&mesh, &topology, &BuildOptions { level: Some(l), ..options }).unwrap()).collect();
        let candidates = |level: u32| sizes.entries[level as usize] as u32;
        let entries = |level: u32| if by_entries { trees[level as usize].p.len() as u32 } else { candidates(level) };
        let capacity = |room: u32| {
            let same = Capacity::for_entries(room, deepest + 1);
            if by_entries { Capacity { candidates: candidates(deepest), ..same } } else { same }
        };
        trees.iter().for_each(|tree| drop(tree.validate(&mesh, &topology).unwrap()));
        let expected: Vec<u32> = mesh.points.iter().map(|&p| Locator::new(&mesh, &topology, &trees[0]).owners(p)[0]).collect();
        let plan = |a: &mut Arena, room: u32| BuildScratch::carve(&gpu, a, tets, &capacity(room), &options);
        if !by_entries {
            let text = Arena::measure(|a| plan(a, tets - 1)).unwrap_err().to_string();
            assert!([tets, tets - 1].iter().all(|n| text.contains(&n.to_string())), "{text}");
        }

        // All capacities on the reference driver; only some where a layer or another driver is slow.
        let other = std::env::var("OLBVH_TEST_DRIVER").is_ok_and(|name| !name.starts_with("lavapipe25"));
        let step = if other || std::env::var_os("OLBVH_TEST_VALIDATION").is_some() { 13 } else { 1 };
        let most = (0..=deepest).map(&entries).max().unwrap();
        let rooms: Vec<u32> = (tets..most + 10).step_by(step).collect();
        let (mut built_levels, mut leapt) = (vec![0; trees.len()], 0);
        for rooms in rooms.chunks(128) {
            let carve = |a: &mut Arena| {
                let one = |&room: &u32| {
                    let tree = TreeMemory::carve(a, &capacity(room), &options)?;
                    Ok(Built { tree, owners: a.words(u64::from(input.points))? })
                };
                let built = rooms.iter().map(one).collect::<olbvh::Result<Vec<_>>>()?;
                Ok((built, a.take(16 * u64::from(input.points))?))
            };
            let memory = gpu.upload("olbvh.test.trees", &vec![0x55u8; Arena::measure(carve).unwrap() as usize]).unwrap();
            let (built, barycentrics) = carve(&mut Arena::new(memory.all())).unwrap();
            let scratch = gpu
                .buffer("olbvh.test.scratch", rooms.iter().map(|&room| Arena::measure(|a| plan(a, room)).unwrap()).max().unwrap())
                .unwrap();
            submit(&gpu, "olbvh.test.sweep", |r| {
                built.iter().zip(rooms).try_for_each(|(Built { tree, owners }, &room)| {
                    cmd_build(r, &view, tree, &options, &plan(&mut Arena::new(scratch.all()), room)?)?;
                    let scene = Scene::recorded(view, *tree);
                    cmd_locate(r, &scene, &points, &LocateOutput { owners: *owners, barycentrics }, &LocateOptions::default())?;
                    r.barrier("locate → build");
                    Ok(())
                })
            })
            .unwrap();
            let content: Vec<u32> = gpu.download(&memory, memory.all()).unwrap();
            let mut end = 0;
            for (Built { tree: t, owners }, &room) in built.iter().zip(rooms) {
                let status: BuildStatus = one(&content, t.status);
                // By its entries, only as many levels are tried as it takes if each has a quarter of the entries.
                let tried = (0..=16).find(|k| room << (2 * k) >= candidates(deepest)).map_or(0, |k| deepest.saturating_sub(k));
                let lowest = if by_entries { tried } else { 0 };
                let fitting = (lowest..=deepest).rev().find(|&l| entries(l) <= room);
                let level = fitting.or_else(|| (0..lowest).rev().find(|&l| candidates(l) <= room)).unwrap();
                leapt += u32::from(fitting.is_none());
                assert_eq!((status.overflow, status.level), (0, level), "{lists} {room} {by_entries}");
                assert!(arrays(&content, t, &status) == trees[level as usize], "{lists} {room}");
                assert_eq!(content[owners.offset() as usize / 4..][..expected.len()], expected, "{lists} {room}");
                built_levels[level as usize] += 1;
                for part in [t.status, t.grid, t.p, t.po, t.co, t.flags, t.masks, *owners] {
                    assert!(
                        content[end..part.offset() as usize / 4].iter().all(|&word| word == 0x5555_5555),
                        "{lists} {room}: written before {part:?}"
                    );
                    end = (part.offset() + part.size()).div_ceil(4) as usize;
                }
            }
        }
        // With lists of the boundary, a coarser level can have more entries than the next finer one.
        let built = (0..=deepest).filter(|&l| built_levels[l as usize] > 0).count();
        assert!(built > 2 && (by_entries || built == trees.len()), "{built_levels:?}");
        assert_eq!(leapt > 0, by_entries, "{leapt} trees whose level's candidates fit");
    }
    crate::silent(&gpu);
}

/// A recorded tree that does not fit its capacity is empty to the queries recorded behind it, whatever lay in its
/// memory.
#[test]
fn what_does_not_fit_answers_as_empty() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let mesh = kuhn([4; 3]).unwrap();
    let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
    let (tets, count, view, options) = (mesh.tets.len() as u32, mesh.points.len() as u32, device.view(), BuildOptions::default());
    let tree = Tree::build(&gpu, &device, &options).unwrap();
    let whole = Scene::of(&tree);
    for level in [0, 2] {
        let capacity = Capacity { candidates: 64 * tets, ..Capacity::for_entries(tets / 2, level) };
        let carve = |a: &mut Arena| {
            let tree = TreeMemory::carve(a, &capacity, &options)?;
            let scene = Scene::recorded(view, tree);
            let output = LocateOutput { owners: a.words(u64::from(count))?, barycentrics: a.take(16 * u64::from(count))? };
            Ok((BuildScratch::carve(&gpu, a, tets, &capacity, &options)?, scene, output, OverlapMemory::carve(a, &whole, &scene)?))
        };
        let memory = gpu.upload("olbvh.test.filled", &vec![0x55u8; Arena::measure(carve).unwrap() as usize]).unwrap();
        let (scratch, scene, output, overlap) = carve(&mut Arena::new(memory.all())).unwrap();
        let points = PointInput { points: device.input().positions, stride: 3, count, hints: None, order: None };
        submit(&gpu, "olbvh.test.empty", |r| {
            cmd_build(r, &view, &scene.tree, &options, &scratch)?;
            cmd_locate(r, &scene, &points, &output, &LocateOptions { method: LocateMethod::Traversal(8), ..LocateOptions::default() })?;
            r.barrier("locate → overlap");
            cmd_overlap(r, &whole, &scene, &overlap, Rounds::begin(4))
        })
        .unwrap();
        let status: BuildStatus = gpu.download_one(&memory, scene.tree.status).unwrap();
        assert_eq!(status.overflow, 1);
        let owners: Vec<u32> = gpu.download(&memory, output.owners.part(0, 4 * u64::from(count))).unwrap();
        assert!(owners.iter().all(|&owner| owner == u32::MAX), "level {level}: {owners:?}");
        for hits in overlap.hits {
            let hits: Vec<u32> = gpu.download(&memory, hits.part(0, 4 * u64::from(tets.div_ceil(32)))).unwrap();
            assert!(hits.iter().all(|&word| word == 0), "level {level}: {hits:x?}");
        }
    }
}

/// Of a thin body, too, for which leaves are finer than α asks for.
#[test]
fn a_plan_like_a_tree_builds_as_fine_a_tree() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    for (mesh, options) in [
        (diagonal(), BuildOptions { fineness: Fineness::Pictures, slabs: true, ..BuildOptions::default() }),
        (kuhn([24, 24, 1]).unwrap(), BuildOptions { fineness: Fineness::Pictures, ..BuildOptions::default() }),
        (kuhn([6; 3]).unwrap(), BuildOptions { lists: Lists::All, assign: Assign::Aabb, ..BuildOptions::default() }),
    ] {
        let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
        let tree = Tree::build(&gpu, &device, &options).unwrap();
        let like = *tree.status();
        let [positions, cells] =
            [gpu.upload("olbvh.test.positions", &mesh.points), gpu.upload("olbvh.test.cells", &mesh.tets)].map(Result::unwrap);
        for slack in [0.0, 1.5] {
            let plan = ScenePlan::like(&tree, slack);
            let bytes = plan.bytes(&gpu).unwrap();
            let [memory, scratch] = [bytes.memory, bytes.scratch].map(|bytes| gpu.buffer("olbvh.test.memory", bytes).unwrap());
            let placed = plan.place(&gpu, positions.all(), cells.all(), memory.all(), scratch.all()).unwrap();
            submit(&gpu, "olbvh.test.like", |r| placed.cmd_build(r)).unwrap();
            let status: BuildStatus = gpu.download_one(&memory, placed.tree.status).unwrap();
            let built = |s: &BuildStatus| (s.level, s.entries, s.nodes, s.leaves, s.longest_leaf, s.overflow);
            assert_eq!(built(&status), built(&like), "{} tetrahedra, slack {slack}", mesh.tets.len());
        }
    }
    crate::silent(&gpu);
}
