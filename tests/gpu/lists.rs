//! `Lists::Boundary` on the device: trees and answers equal those of the reference implementation to the bit, and the
//! answers equal those of `Lists::All`.

use crate::not_run::not_run;
use crate::submit::submit;
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::{Binding, Gpu, GpuOptions};
use olbvh::layout::NONE;
use olbvh::mesh::cases::cases;
use olbvh::mesh::{Field, Mesh, On, kuhn, kuhn_jittered};
use olbvh::options::{Assign, BuildOptions, Fineness, LIST_PART, Lists, TOLERANCE};
use olbvh::query::{
    LocateMethod, LocateOptions, LocateOutput, PointInput, SILENT, Scene, cmd_locate, locate, locate_all, overlap, overlap_pairs, render,
    slice,
};
use olbvh::reference::boundary::{Topology, topology};
use olbvh::reference::build::build;
use olbvh::reference::locate::{Location, Locator};
use olbvh::reference::slice::Slicer;
use olbvh::reference::volume;
use olbvh::render::RenderSettings;
use olbvh::slicing::{Band, Extrapolate, Plane, SliceSettings};
use olbvh::tree::TreeArrays;

fn options(alpha: f32, assign: Assign, lists: Lists) -> BuildOptions {
    BuildOptions { alpha, assign, lists, ..BuildOptions::default() }
}

/// A mesh and its topology, on the host and on a device.
struct Subject {
    name: String,
    mesh: Mesh,
    topology: Topology,
    device: DeviceMesh,
}

impl Subject {
    fn new(gpu: &Gpu, name: &str, mesh: Mesh) -> Self {
        let (topology, device) = (topology(&mesh).unwrap(), DeviceMesh::upload(gpu, &mesh, BadCells::Skip).unwrap());
        Self { name: name.into(), mesh, topology, device }
    }

    /// The tree that the device builds, which must equal that of the reference implementation.
    fn tree(&self, gpu: &Gpu, options: &BuildOptions) -> (Tree, TreeArrays) {
        let tree = Tree::build(gpu, &self.device, options).unwrap();
        let expected = build(&self.mesh, &self.topology, options).unwrap();
        let found = tree.download().unwrap();
        assert_eq!(expected.grid, found.grid, "{} {options:?}", self.name);
        assert_eq!(expected.p, found.p, "{} {options:?}", self.name);
        assert_eq!(expected, found, "{} {options:?}", self.name);
        (tree, expected)
    }

    fn points(&self, n: usize) -> Vec<[f32; 3]> {
        let mut state = 7u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0
        };
        let (grid, tets) = (&self.topology.grid, &self.mesh.tets);
        let mut points = vec![[f32::NAN; 3], [1e38; 3], [f32::NEG_INFINITY; 3]];
        for i in 0..n {
            let t = ((next() * tets.len() as f32) as u32).min((tets.len() as u32).saturating_sub(1));
            if i % 5 == 4 || !self.topology.is_valid(t) {
                points.push([0, 1, 2].map(|c| grid.lo[c] + (next() * 1.1 - 0.05) * (grid.hi[c] - grid.lo[c])));
                continue;
            }
            let v = tets[t as usize].map(|v| self.mesh.points[v as usize]);
            let raw = [1.0, next(), next(), next()].map(|x: f32| x + 1e-3);
            let used = &raw[..=(i % 5).min(3)];
            let sum: f32 = used.iter().sum();
            let p = [0, 1, 2].map(|c| used.iter().zip(&v).map(|(w, v)| w / sum * v[c]).sum::<f32>());
            // Every third point is moved by an ulp.
            points.push(if i % 3 == 0 { p.map(|x| if next() < 0.5 { x.next_up() } else { x.next_down() }) } else { p });
        }
        points
    }

    fn locations(&self, gpu: &Gpu, options: &BuildOptions, n: usize) -> Vec<Location> {
        let (tree, host) = self.tree(gpu, options);
        let (locator, points) = (Locator::new(&self.mesh, &self.topology, &host), self.points(n));
        let expected = locator.locate_each(&points);
        let what = |i: usize| format!("{} {options:?} point {i} {:?}", self.name, points[i]);
        for method in [LocateMethod::Descent, LocateMethod::Traversal(3)] {
            let found = locate(&tree, &points, None, &LocateOptions { method, ..LocateOptions::default() }, SILENT).unwrap();
            for (i, e) in expected.iter().enumerate() {
                assert_eq!((e.owner, e.barycentric), (found.owners[i], found.barycentrics[i]), "{method:?} {}", what(i));
            }
        }
        let lists = locate_all(&tree, &points, TOLERANCE, SILENT).unwrap();
        for (i, list) in lists.owners.iter().enumerate() {
            assert_eq!(&locator.owners(points[i]), list, "all owners: {}", what(i));
        }
        // Every point has the owner of the point before as its hint.
        let hints: Vec<u32> = std::iter::once(NONE).chain(expected.iter().map(|e| e.owner)).take(points.len()).collect();
        let (input, hint_buffer) = (gpu.upload("olbvh.test.points", &points).unwrap(), gpu.upload("olbvh.test.hints", &hints).unwrap());
        let count = points.len() as u64;
        let owners = gpu.buffer("olbvh.test.owners", 4 * count).unwrap();
        let barycentrics = gpu.buffer("olbvh.test.barycentrics", 16 * count).unwrap();
        let input = PointInput { points: input.all(), stride: 3, count: count as u32, hints: Some(hint_buffer.all()), order: None };
        let output = LocateOutput { owners: owners.all(), barycentrics: barycentrics.all() };
        // Also as a host records it that does not know how long lists are: parts begin behind the end of all of them.
        let known = Scene::of(&tree).longest_leaf;
        for longest_leaf in [known, known.max(1) + 2 * LIST_PART] {
            let scene = Scene { longest_leaf, ..Scene::of(&tree) };
            submit(gpu, "olbvh.test.locate", |r| cmd_locate(r, &scene, &input, &output, &LocateOptions::default())).unwrap();
            let found: Vec<u32> = gpu.download(&owners, owners.all()).unwrap();
            let coordinates: Vec<[f32; 4]> = gpu.download(&barycentrics, barycentrics.all()).unwrap();
            for (i, (owner, barycentric)) in found.into_iter().zip(coordinates).enumerate() {
                let near = locator.locate_near(points[i], hints[i]);
                assert_eq!((near.owner, near.barycentric), (owner, barycentric), "hint, lists up to {longest_leaf}: {}", what(i));
            }
        }
        expected
    }

    /// The slices over a tree, which must equal those of the reference implementation.
    fn slices(&self, gpu: &Gpu, options: &BuildOptions) -> Vec<(Vec<u8>, Vec<u32>)> {
        let (tree, host) = self.tree(gpu, options);
        let settings = SliceSettings { plane: Plane::Normal([1.0, -2.0, 0.7]), layers: 3, size: [37, 21], ..SliceSettings::default() };
        let three = |v: [f32; 4]| [v[0], v[1], v[2]];
        let Ok(voxels) = settings.voxels(three(host.grid.lo), three(host.grid.hi), self.mesh.origin) else { return Vec::new() };
        let slicer = Slicer::new(&self.mesh, &self.topology, &host, None, voxels, Extrapolate::Nearest).unwrap();
        let mut bands = Vec::new();
        let mut take = |band: Band| {
            let expected = slicer.band(band.rows);
            assert_eq!((&expected.kinds, &expected.owners), (&band.kinds, &band.owners), "{} {options:?}", self.name);
            bands.push((band.kinds, band.owners));
            Ok(())
        };
        slice(&tree, None, &voxels, Extrapolate::Nearest, SILENT, &mut take).unwrap();
        bands
    }

    /// The colours of a picture, and the number of its samples in the mesh.
    fn picture(&self, gpu: &Gpu, options: &BuildOptions) -> (Vec<[u32; 4]>, u64) {
        let (tree, host) = self.tree(gpu, options);
        let field = Field { name: "x".into(), on: On::Points, values: self.mesh.points.iter().map(|p| p[0] + 0.5 * p[1]).collect() };
        let settings = RenderSettings { size: [60, 45], ..RenderSettings::default() };
        let scene = volume::Drawing::new(&self.mesh, &self.topology, &host, &field, &settings).unwrap();
        let drawn = render(&tree, scene.plan(), (&field.values, field.on), None, SILENT).unwrap();
        (drawn.colors.into_iter().map(|c| c.map(f32::to_bits)).collect(), drawn.stats.found_samples)
    }
}

fn loaded(file: &str) -> Mesh {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(file);
    olbvh::formats::load(&file, &olbvh::formats::LoadOptions::default()).unwrap().mesh
}

/// Meshes whose tetrahedra do not overlap.
fn closed(gpu: &Gpu) -> Vec<Subject> {
    let mut closed = vec![
        Subject::new(gpu, "kuhn", kuhn([8; 3]).unwrap()),
        Subject::new(gpu, "kuhn, off the grid", kuhn([9, 7, 11]).unwrap()),
        Subject::new(gpu, "jittered", kuhn_jittered([12; 3], 0.12, 3).unwrap()),
    ];
    if std::env::var("OLBVH_TEST_DRIVER").is_ok_and(|d| d == "swiftshader") {
        not_run("bracket_50k on SwiftShader, where it takes many minutes");
    } else {
        closed.push(Subject::new(gpu, "bracket_50k.vtu", loaded("bracket_50k.vtu")));
    }
    closed
}

fn gpu(binding: Binding) -> Gpu {
    Gpu::new(&GpuOptions { binding: Some(binding), ..GpuOptions::default() }).unwrap()
}

fn quiet(gpu: &Gpu) {
    crate::silent(gpu);
}

#[test]
fn points() {
    let gpu = gpu(Binding::Address);
    for subject in closed(&gpu) {
        for (alpha, assign) in [(0.0, Assign::Planes), (1.0, Assign::Aabb)] {
            let [all, boundary] = Lists::EVERY.map(|lists| subject.locations(&gpu, &options(alpha, assign, lists), 5000));
            for (i, (a, b)) in all.iter().zip(&boundary).enumerate() {
                assert_eq!(a, b, "{} α {alpha} {assign} point {i}", subject.name);
            }
        }
    }
    quiet(&gpu);
}

#[test]
fn degenerate_meshes() {
    let gpu = gpu(Binding::Address);
    for case in cases().unwrap() {
        let subject = Subject::new(&gpu, case.name, case.mesh);
        for (alpha, assign) in [(0.0, Assign::Aabb), (1.0, Assign::Exact), (3.0, Assign::Planes)] {
            subject.locations(&gpu, &options(alpha, assign, Lists::Boundary), 500);
        }
    }
    quiet(&gpu);
}

#[test]
fn slices_and_pictures() {
    let gpu = gpu(Binding::Address);
    for subject in closed(&gpu) {
        let [all, boundary] = Lists::EVERY.map(|lists| options(0.5, Assign::Planes, lists));
        assert_eq!(subject.slices(&gpu, &all), subject.slices(&gpu, &boundary), "{}", subject.name);
        assert_eq!(subject.picture(&gpu, &all), subject.picture(&gpu, &boundary), "{}", subject.name);
    }
    quiet(&gpu);
}

#[test]
fn overlaps() {
    let gpu = gpu(Binding::Address);
    let mut moved = kuhn_jittered([9; 3], 0.12, 5).unwrap();
    moved.points.iter_mut().for_each(|p| *p = [p[0] * 0.9 + 6.3, p[1] - p[2] * 0.3 + 2.7, p[2] + 3.1]);
    let (a, b) = (Subject::new(&gpu, "a", kuhn_jittered([14; 3], 0.12, 3).unwrap()), Subject::new(&gpu, "b", moved));
    let sets = Lists::EVERY.map(|lists| {
        let trees = [&a, &b].map(|s| Tree::build(&gpu, &s.device, &options(0.0, Assign::Aabb, lists)).unwrap());
        let inputs = [&trees[0], &trees[1]];
        if lists == Lists::Boundary {
            assert!(overlap_pairs(inputs[0], inputs[1], SILENT).is_err_and(|e| e.to_string().contains("Lists::All")));
        }
        let found = overlap(inputs[0], inputs[1], SILENT).unwrap().overlap;
        (found.a, found.b)
    });
    assert!(sets[0].0.len() > 100 && sets[0].1.len() > 100);
    assert_eq!(sets[0], sets[1]);
    quiet(&gpu);
}

/// In meshes of more than 2^20 tetrahedra, entries hold halves instead of quarters.
#[test]
fn more_than_a_million() {
    let gpu = gpu(Binding::Address);
    let subject = Subject::new(&gpu, "a million", kuhn_jittered([56, 56, 56], 0.2, 5).unwrap());
    assert!(subject.mesh.tets.len() > 1 << 20);
    let (_, tree) = subject.tree(&gpu, &options(0.0, Assign::Planes, Lists::Boundary));
    assert_eq!((tree.grid.ids.count_ones(), tree.quarters.iter().max()), (26, Some(&0x3f)));
    subject.locations(&gpu, &options(0.0, Assign::Planes, Lists::Boundary), 5000);
    quiet(&gpu);
}

/// Tetrahedra that reach through a plate call for a tree of a single node, which lists all of them.
#[test]
fn long_lists_make_leaves_finer() {
    let gpu = Gpu::new(&GpuOptions::default()).unwrap();
    let plate = Subject::new(&gpu, "plate", kuhn_jittered([40, 40, 1], 0.2, 3).unwrap());
    let alpha = BuildOptions::default();
    let (coarse, _) = plate.tree(&gpu, &alpha);
    assert_eq!((coarse.status().level, coarse.status().longest_leaf), (0, 9_600));
    let found = plate.locations(&gpu, &alpha, 3000);
    let inside = |l: &Location| l.owner != NONE && l.barycentric.iter().all(|&b| b >= 0.0);
    assert!(found.iter().filter(|l| inside(l)).count() > 2000);
    for (fineness, limit) in [(Fineness::Pictures, None), (Fineness::Points, None), (Fineness::Pictures, Some(40_000))] {
        let options = BuildOptions { fineness, capacity: limit, ..alpha };
        let status = *plate.tree(&gpu, &options).0.status();
        let (level, mean, next) = (status.level, status.entries / status.leaves, status.total[2 * status.level as usize + 2]);
        assert!(
            level > 0 && fineness.wants_finer(u64::from(mean)) == limit.is_some(),
            "{fineness}: {mean} entries per leaf of level {level}"
        );
        assert!(limit.is_none_or(|limit| status.candidates <= limit && next > limit), "{next} candidates would fit");
        for (a, b) in found.iter().zip(plate.locations(&gpu, &options, 3000)) {
            assert!(a.owner == b.owner || !inside(a), "{fineness}: {a:?}, {b:?}");
        }
    }
    // The tree gets as fine as the memory beside the first tree allows; without any, the first tree stays.
    let options = BuildOptions { fineness: Fineness::Pictures, ..alpha };
    let measured = gpu.with_memory(1 << 40);
    Tree::build(&measured, &plate.device, &alpha).unwrap();
    let level = |memory: u64| Tree::build(&gpu.with_memory(memory), &plate.device, &options).unwrap().status().level;
    let [none, some, enough] = [measured.memory_peak(), 4 * measured.memory_peak(), 1 << 30].map(level);
    assert!(none == 0 && some > 0 && enough > some, "{none} {some} {enough}");
    // The lists of a body that fills its bounds are short as they are. For pictures, leaves are as fine as a million
    // entries allow, so that rays pass over the empty space around a small body.
    let cube = Subject::new(&gpu, "cube", kuhn([16; 3]).unwrap());
    let level = |fineness| cube.tree(&gpu, &BuildOptions { fineness, ..alpha }).0.status().level;
    assert_eq!(Fineness::EVERY.map(level), [4, 4, 5]);
}

/// Some drivers end loops after 65,535 passes, so none may go on as long as cells are bad; and the level of a tree over
/// nothing is 0, whatever is asked for.
#[test]
fn stretches_of_bad_cells() {
    let gpu = gpu(Binding::Address);
    let mut mesh = kuhn([4; 3]).unwrap();
    let bad = || std::iter::repeat_n([0; 4], 70_000);
    mesh.tets.splice(100..100, bad());
    let subject = Subject::new(&gpu, "a stretch of bad cells", mesh);
    for lists in Lists::EVERY {
        subject.tree(&gpu, &options(0.0, Assign::Aabb, lists));
    }
    let nothing = Subject::new(&gpu, "bad cells", Mesh { tets: bad().take(10).collect(), ..kuhn([1; 3]).unwrap() });
    for fineness in Fineness::EVERY {
        for level in [None, Some(5)] {
            let (tree, _) = nothing.tree(&gpu, &BuildOptions { fineness, level, ..BuildOptions::default() });
            assert_eq!((tree.status().wanted_level, tree.status().level), (0, 0));
        }
    }
    quiet(&gpu);
}
