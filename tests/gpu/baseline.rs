//! The LBVH baseline: its tree is sound and equal on every device, and it gives the answers of the octree.

use olbvh::baseline::{Lbvh, LbvhArrays};
use olbvh::build::{BadCells, DeviceMesh, Tree};
use olbvh::gpu::Gpu;
use olbvh::layout::NONE;
use olbvh::mesh::cases::cases;
use olbvh::mesh::{Field, Mesh, On, kuhn_jittered};
use olbvh::options::{BuildOptions, Lists, TOLERANCE};
use olbvh::query::{self, LocateOptions, Rendered, SILENT};
use olbvh::render::{RenderSettings, TransferFunction};
use olbvh::slicing::{Band, Extrapolate, Plane, SliceSettings};

/// A mesh, and both structures over it.
struct HostAndDevice {
    mesh: Mesh,
    device: DeviceMesh,
    tree: Tree,
    lbvh: Lbvh,
}

impl HostAndDevice {
    fn new(gpu: &Gpu, mesh: Mesh) -> Self {
        let device = DeviceMesh::upload(gpu, &mesh, BadCells::Skip).unwrap();
        let tree = Tree::build(gpu, &device, &BuildOptions { lists: Lists::All, ..BuildOptions::default() }).unwrap();
        let lbvh = Lbvh::build(gpu, &device).unwrap();
        Self { mesh, device, tree, lbvh }
    }
}

/// Reproducible random numbers from 0 to 1.
fn random() -> impl FnMut() -> f32 {
    let mut state = 1u32;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 16_777_216.0
    }
}

/// All degenerate meshes, a jittered grid, and more tetrahedra in one place than a dispatch can test: equal ones, and
/// different ones, none of which may be passed over.
fn meshes() -> Vec<(&'static str, Mesh)> {
    let mut meshes: Vec<_> = cases().unwrap().into_iter().map(|c| (c.name, c.mesh)).collect();
    meshes.push(("jittered", kuhn_jittered([9, 8, 7], 0.3, 5).unwrap()));
    let one = kuhn_jittered([1; 3], 0.0, 0).unwrap();
    meshes.push(("identical-9000", Mesh::new(one.points.clone(), vec![one.tets[0]; 9_000])));
    let mut random = random();
    let crossing = (0..4 * 1500).map(|_| [random(), random(), random()]).collect();
    meshes.push(("crossing", Mesh::new(crossing, (0..1500).map(|i| [0, 1, 2, 3].map(|k| 4 * i + k)).collect())));
    meshes
}

const LEAF: u32 = 1 << 31;
const BOUNDARY: u32 = 1 << 30;

/// Checks the subtree of a reference. Returns its places, box, and depth.
fn check_subtree(at: u32, tree: &LbvhArrays, mesh: &Mesh, vertices: &[[f32; 4]], boundary: &[u32]) -> ([u32; 2], [[f32; 3]; 2], u32) {
    let i = at & (BOUNDARY - 1);
    if at & LEAF != 0 {
        let t = tree.ids[i as usize];
        let corners = mesh.tets[t as usize].map(|v| [0, 1, 2].map(|c| vertices[v as usize][c]));
        let fold = |f: fn(f32, f32) -> f32| corners.iter().copied().reduce(|a, b| [0, 1, 2].map(|c| f(a[c], b[c]))).unwrap();
        assert_eq!(at & BOUNDARY != 0, boundary[t as usize / 32] >> (t % 32) & 1 != 0, "flag of leaf {i}");
        return ([i; 2], [fold(f32::min), fold(f32::max)], 0);
    }
    let node = &tree.nodes[i as usize];
    let (left, left_box, left_depth) = check_subtree(node.left, tree, mesh, vertices, boundary);
    let (right, right_box, right_depth) = check_subtree(node.right, tree, mesh, vertices, boundary);
    assert_eq!([left[1], right[0]], [i, i + 1], "places of node {i}");
    let lo = [0, 1, 2].map(|c| left_box[0][c].min(right_box[0][c]));
    let hi = [0, 1, 2].map(|c| left_box[1][c].max(right_box[1][c]));
    assert_eq!([lo, hi], [node.lo, node.hi], "box of node {i}");
    assert_eq!(at & BOUNDARY, (node.left | node.right) & BOUNDARY, "flag of node {i}");
    ([left[0], right[1]], [lo, hi], 1 + left_depth.max(right_depth))
}

fn check_tree(name: &str, b: &HostAndDevice) {
    let tree = b.lbvh.download().unwrap();
    let valid = b.device.input().tets - b.device.status().bad;
    let mut ids = tree.ids.clone();
    ids.sort_unstable();
    let bad = b.device.bad_cells().unwrap();
    assert!(ids.iter().eq((0..b.device.input().tets).filter(|t| bad.binary_search(t).is_err()).collect::<Vec<_>>().iter()), "{name}");
    assert_eq!(tree.root == NONE, valid == 0, "{name}");
    if valid > 0 {
        let (vertices, boundary) = (b.device.vertices().unwrap(), b.device.boundary_bits().unwrap());
        let (places, _, depth) = check_subtree(tree.root, &tree, &b.mesh, &vertices, &boundary);
        assert_eq!(places, [0, valid - 1], "{name}");
        assert!(depth < 60, "{name}: {depth} levels");
    }
}

/// Vertices, midpoints of faces and tetrahedra, and points all over the bounds.
fn points(mesh: &Mesh) -> Vec<[f32; 3]> {
    let corner = |v: u32| mesh.points.get(v as usize).copied().unwrap_or([f32::NAN; 3]);
    let middle = |of: &[u32]| [0, 1, 2].map(|c| of.iter().map(|&v| corner(v)[c] / of.len() as f32).sum::<f32>());
    let mut points = mesh.points.clone();
    points.extend(mesh.tets.iter().take(3000).flat_map(|t| [middle(t), middle(&t[..3]), middle(&t[2..])]));
    let (lo, hi) = mesh.points.iter().fold(([0f32; 3], [1f32; 3]), |(lo, hi), p| {
        if p.iter().all(|x| x.abs() < 1e37) { ([0, 1, 2].map(|c| lo[c].min(p[c])), [0, 1, 2].map(|c| hi[c].max(p[c]))) } else { (lo, hi) }
    });
    let mut random = random();
    points.extend((0..2000).map(|_| [0, 1, 2].map(|c| lo[c] + (random() * 1.2 - 0.1) * (hi[c] - lo[c]))));
    points.extend([[f32::NAN; 3], [f32::INFINITY; 3], [1e38; 3], [-1e38, 1.0, 1.0]]);
    points
}

fn check_owners(name: &str, b: &HostAndDevice) {
    let mut points = points(&b.mesh);
    if name == "identical-9000" {
        points = points.into_iter().step_by(97).collect(); // every point tests all tetrahedra
    }
    let expected = query::locate(&b.tree, &points, None, &LocateOptions::default(), SILENT).unwrap();
    let found = b.lbvh.locate(&points, TOLERANCE).unwrap();
    for (i, p) in points.iter().enumerate() {
        let of = |l: &query::Located| (l.owners[i], l.barycentrics[i]);
        assert_eq!(of(&expected), of(&found), "{name}: point {i} {p:?}");
    }
    if name == "identical-9000" {
        assert!(found.times.submissions > 1, "the search of a point was never resumed");
    }
}

/// The size of a picture or slice: small where every pixel or voxel tests thousands of tetrahedra, in many dispatches,
/// or has thousands of samples.
fn size(name: &str, size: [u32; 2]) -> [u32; 2] {
    if name.starts_with("identical") || name == "very-far" {
        [4, 3]
    } else if name == "crossing" {
        [12, 9]
    } else {
        size
    }
}

/// The picture, which both structures must draw alike; `None` if nothing is visible.
fn same_picture(name: &str, b: &HostAndDevice, settings: &RenderSettings, field: &Field) -> Option<Rendered> {
    let prepared = query::prepare_picture(&b.device, &b.mesh, field, settings).ok()?;
    let normals = settings.shading.then_some(&prepared.normals[..]);
    let (plan, field) = (&prepared.plan, (&field.values[..], field.on));
    let expected = query::render(&b.tree, plan, field, normals, SILENT).unwrap();
    let drawn = b.lbvh.render(plan, field, normals, SILENT).unwrap();
    let camera = &settings.camera;
    // With a surface, the octree skips what does not show it. With a function that shows every value, it skips nothing.
    assert!(
        expected.stats.skipped_samples > 0 || expected.stats.found_samples == drawn.stats.found_samples,
        "{name}, {camera:?}: samples in the mesh"
    );
    assert!(expected.colors == drawn.colors, "{name}, {camera:?}: colours");
    Some(drawn)
}

/// Draws fields that number points, with light, and cells, without. Returns the number of samples in the mesh.
fn check_picture(name: &str, b: &HostAndDevice) -> u64 {
    let mut found = 0;
    for (camera, on, n) in [("iso", On::Points, b.mesh.points.len()), ("azimuth=100,elevation=-10,zoom=1.5", On::Cells, b.mesh.tets.len())]
    {
        let field = Field { name: "number".into(), on, values: (0..n).map(|i| (i % 17) as f32).collect() };
        let (size, camera, shading) = (size(name, [28, 20]), camera.parse().unwrap(), on == On::Points);
        let settings = RenderSettings { size, camera, shading, ..RenderSettings::default() };
        found += same_picture(name, b, &settings, &field).map_or(0, |drawn| drawn.stats.found_samples);
    }
    found
}

/// Compares slices through the middle. Returns the number of touched voxels.
fn check_slices(name: &str, b: &HostAndDevice) -> u64 {
    let three = |v: [f32; 4]| [v[0], v[1], v[2]];
    let (lo, hi) = (three(b.device.grid().lo), three(b.device.grid().hi));
    let mut touched = 0;
    for (plane, layers) in [(Plane::Axis(0), 1), (Plane::Axis(2), 3), (Plane::Normal([1.0, -2.0, 0.7]), 2)] {
        let settings = SliceSettings { plane, layers, size: size(name, [17, 13]), ..SliceSettings::default() };
        let Ok(voxels) = settings.voxels(lo, hi, b.mesh.origin) else { continue };
        let slice = |by_tree: bool| {
            let (mut kinds, mut owners) = (Vec::new(), Vec::new());
            let mut sink = |band: Band| {
                kinds.extend(band.kinds);
                owners.extend(band.owners);
                Ok(())
            };
            let sliced = if by_tree {
                query::slice(&b.tree, None, &voxels, Extrapolate::Nearest, SILENT, &mut sink)
            } else {
                b.lbvh.slice(None, &voxels, Extrapolate::Nearest, SILENT, &mut sink)
            };
            touched += sliced.unwrap().tally.touched;
            (kinds, owners)
        };
        let [expected, found] = [true, false].map(slice);
        assert!(expected.0 == found.0, "{name}: kinds of {plane:?}");
        assert!(expected.1 == found.1, "{name}: owners of {plane:?}");
    }
    touched
}

fn check_overlap(name: &str, a: &HostAndDevice, b: &HostAndDevice) -> usize {
    let expected = query::overlap(&a.tree, &b.tree, SILENT).unwrap();
    let found = a.lbvh.overlap(&b.lbvh, SILENT).unwrap();
    assert_eq!(expected.overlap.a, found.overlap.a, "{name}: a");
    assert_eq!(expected.overlap.b, found.overlap.b, "{name}: b");
    if name == "identical-9000" {
        assert!(found.times.submissions > 1, "the search of a primitive was never resumed");
    }
    found.overlap.a.len()
}

fn everything(gpu: &Gpu) {
    let (mut found, mut touched, mut hits) = (0, 0, 0);
    let mut grid = kuhn_jittered([6, 5, 4], 0.3, 9).unwrap();
    grid.points.iter_mut().for_each(|p| *p = [p[0] - 2.6, p[1] - 3.3, p[2] - 1.4]);
    let grid = HostAndDevice::new(gpu, grid);
    for (name, mesh) in meshes() {
        let both = HostAndDevice::new(gpu, mesh);
        check_tree(name, &both);
        check_owners(name, &both);
        found += if name == "identical-9000" { 0 } else { check_picture(name, &both) };
        touched += check_slices(name, &both);
        hits += check_overlap(name, &grid, &both);
        hits += check_overlap(name, &both, &grid);
    }
    assert!(found > 10_000 && touched > 1000 && hits > 1000, "{found} samples, {touched} voxels, {hits} hits");
}

/// Two surfaces that cut through tetrahedra, lit or not, and half transparent, so that both are visible.
fn surfaces(gpu: &Gpu) {
    let both = HostAndDevice::new(gpu, kuhn_jittered([6, 5, 4], 0.3, 9).unwrap());
    let values = both.mesh.points.iter().map(|p| p[0] * p[1] - p[2]).collect();
    let field = Field { name: "saddle".into(), on: On::Points, values };
    for shading in [true, false] {
        let transfer = TransferFunction::default().with_opacity(vec![(0.0, 0.4), (1.0, 0.6)]).unwrap();
        let settings = RenderSettings { size: [28, 20], iso: vec![3.0, 11.0], shading, transfer, ..RenderSettings::default() };
        let drawn = same_picture("surfaces", &both, &settings, &field).unwrap();
        let beyond_one = drawn.colors.iter().filter(|c| c[3] > 0.65).count();
        assert!(beyond_one > 20 && drawn.colors.iter().any(|c| c[3] == 0.0), "{beyond_one} pixels with several surfaces");
    }
}

both_bindings!(surfaces, surfaces_by_address, surfaces_by_descriptors);

both_bindings!(everything, baseline_by_address, baseline_by_descriptors);
