//! Slices: no voxel that the mesh touches is empty, no other voxel is filled, owners are the closest ones, and voxels
//! do not depend on the tree.

use super::oracle::{P, box_gap, distance};
use super::{prepared, tree};
use olbvh::grid::CellRange;
use olbvh::layout::NONE;
use olbvh::mesh::cases::cases;
use olbvh::mesh::{Field, Mesh, On, kuhn_jittered};
use olbvh::options::Assign;
use olbvh::reference::boundary::Topology;
use olbvh::reference::locate::Locator;
use olbvh::reference::slice::Slicer;
use olbvh::slicing::{Band, EMPTY, Extrapolate, INSIDE, Plane, Rows, SliceSettings, TOUCHED, Tally, VoxelGrid, bands};
use olbvh::tree::TreeArrays;

pub fn wide(p: [f32; 3]) -> P {
    p.map(f64::from)
}

fn settings() -> Vec<SliceSettings> {
    let default = SliceSettings { size: [20, 17], ..SliceSettings::default() };
    vec![
        default,
        SliceSettings { plane: Plane::Axis(0), size: [9, 40], thickness: Some(0.3), ..default },
        SliceSettings { plane: Plane::Axis(1), layers: 5, size: [7, 6], ..default },
        SliceSettings { plane: Plane::Normal([1.0, -2.0, 0.7]), layers: 3, size: [15, 12], ..default },
        SliceSettings { plane: Plane::Normal([0.1, 0.2, 1.0]), size: [33, 2], thickness: Some(1e-3), ..default },
        SliceSettings { plane: Plane::Axis(2), size: [2, 1], layers: 1, ..default },
    ]
}

pub fn bounds(tree: &TreeArrays) -> ([f32; 3], [f32; 3]) {
    let three = |v: [f32; 4]| [v[0], v[1], v[2]];
    (three(tree.grid.lo), three(tree.grid.hi))
}

pub fn slice(
    mesh: &Mesh,
    topology: &Topology,
    tree: &TreeArrays,
    field: Option<&Field>,
    voxels: VoxelGrid,
    extrapolate: Extrapolate,
) -> Band {
    let slicer = Slicer::new(mesh, topology, tree, field, voxels, extrapolate).unwrap();
    let mut all = Band::default();
    for rows in bands(&voxels, 100) {
        let band = slicer.band(rows);
        all.rows.count += rows.count;
        all.values.extend(band.values);
        all.kinds.extend(band.kinds);
        all.owners.extend(band.owners);
    }
    all
}

fn same(a: &Band, b: &Band) -> bool {
    let bits = |band: &Band| band.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    a.kinds == b.kinds && a.owners == b.owners && bits(a) == bits(b)
}

/// Compares every voxel with every tetrahedron. In a mesh that is `tangled`, tetrahedra overlap each other.
fn check(name: &str, tangled: bool, mesh: &Mesh, topology: &Topology, tree: &TreeArrays, voxels: &VoxelGrid, band: &Band) {
    let (lo, hi) = bounds(tree);
    let size = (0..3).map(|c| f64::from(hi[c]) - f64::from(lo[c])).fold(0.0, f64::max);
    let extent = voxels.half.iter().map(|h| h.iter().map(|&x| f64::from(x).abs()).sum::<f64>()).fold(0.0, f64::max);
    // Far from 0, the centre of a voxel is as coarse as the coordinates there, and its three half axes are longer.
    let far = lo.iter().chain(&hi).map(|x| f64::from(x.abs())).fold(0.0, f64::max);
    let slack = 4e-6 * (size + extent) + 3.0 * far / f64::from(1 << 20);
    let half = voxels.half.map(wide);
    let locator = Locator::new(mesh, topology, tree);
    let [w, h] = voxels.size;
    let tets: Vec<(u32, [P; 4])> = (0..)
        .zip(&mesh.tets)
        .filter(|(t, _)| topology.is_valid(*t))
        .map(|(t, ids)| (t, ids.map(|i| wide(mesh.points[i as usize]))))
        .collect();
    for (i, (&kind, &owner)) in band.kinds.iter().zip(&band.owners).enumerate() {
        let i = i as u32;
        let at = [i % w, i / w % h, i / w / h];
        let centre = voxels.centre(at);
        let what = format!("{name}: voxel {at:?} of {voxels:?} at {centre:?}: kind {kind}, owner {owner}");
        let gaps: Vec<f64> = tets.iter().map(|(_, v)| box_gap(v, wide(centre), &half)).collect();
        let least = gaps.iter().copied().fold(f64::MAX, f64::min);
        match kind {
            EMPTY => assert!(least > 0.0 && owner == NONE, "{what}: touched, {least:e}"),
            INSIDE if tangled => assert!(locator.locate(centre).found().is_some() && topology.is_valid(owner), "{what}"),
            INSIDE => assert_eq!(locator.locate(centre).owner, owner, "{what}"),
            TOUCHED => {
                assert!(least < slack, "{what}: not touched, {least:e}");
                assert_eq!(locator.locate(centre).owner, NONE, "{what}");
                assert!(topology.is_boundary(owner), "{what}");
                let of = |t: u32| tets.iter().position(|x| x.0 == t).unwrap();
                assert!(gaps[of(owner)] < slack, "{what}");
                let mine = distance(&tets[of(owner)].1, wide(centre));
                for ((t, v), gap) in tets.iter().zip(&gaps) {
                    let closer = *gap <= 0.0 && topology.is_boundary(*t) && distance(v, wide(centre)) < mine - slack;
                    assert!(!closer, "{what}: {t} is closer");
                }
            }
            _ => panic!("{what}"),
        }
    }
}

/// Two halves of the octree cells together find what all of them find: one has the centre of a voxel, either may have
/// the closest tetrahedron.
fn check_parts(mesh: &Mesh, topology: &Topology, tree: &TreeArrays, voxels: VoxelGrid, band: &Band) {
    let low = CellRange { hi: [511, 1023, 1023], ..CellRange::WHOLE };
    let high = CellRange { lo: [512, 0, 0], ..CellRange::WHOLE };
    let rows = Rows { layer: 0, first: 0, count: voxels.size[1] * voxels.layers };
    let slicer = |part| Slicer::new(mesh, topology, tree, None, voxels, Extrapolate::Nearest).unwrap().within(part);
    let parts = [low, high].map(|part| slicer(part).band(rows));
    for i in 0..band.kinds.len() {
        let of = |kind: u8| parts.iter().filter(move |p| p.kinds[i] == kind).map(|p| p.owners[i]).collect::<Vec<_>>();
        let (inside, touched) = (of(INSIDE), of(TOUCHED));
        match band.kinds[i] {
            INSIDE => assert_eq!(inside, [band.owners[i]], "voxel {i}"),
            TOUCHED => assert!(inside.is_empty() && touched.contains(&band.owners[i]), "voxel {i}: {touched:?}"),
            _ => assert!(inside.is_empty() && touched.is_empty(), "voxel {i}"),
        }
    }
}

#[test]
fn slices_are_conservative_and_the_same_from_every_tree() {
    let mut tally = Tally::default();
    for case in cases().unwrap() {
        let (mesh, topology) = prepared(case.mesh);
        let field = Field { name: "x".into(), on: On::Points, values: mesh.points.iter().map(|p| p[0]).collect() };
        let first = tree(&mesh, &topology, 0.0, Assign::Aabb);
        let (lo, hi) = bounds(&first);
        let largest = (0..3).map(|c| f64::from(hi[c]) - f64::from(lo[c])).fold(0.0, f64::max);
        // Where tetrahedra overlap, the owner of a centre may depend on the tree.
        let tangled =
            topology.counts.boundary > 0 && ["soup", "kuhn-tangled", "three-on-a-face", "fold", "flat-between"].contains(&case.name);
        if largest == 0.0 {
            assert!(settings()[0].voxels(lo, hi, mesh.origin).is_err(), "{}", case.name);
            continue;
        }
        for (i, mut settings) in settings().into_iter().enumerate() {
            settings.thickness = settings.thickness.map(|t| t * largest);
            let voxels = settings.voxels(lo, hi, mesh.origin).unwrap();
            let band = slice(&mesh, &topology, &first, Some(&field), voxels, Extrapolate::Nearest);
            tally.add(&band.kinds);
            if case.name != "near-denormal" {
                check(case.name, tangled, &mesh, &topology, &first, &voxels, &band);
            }
            if !tangled && first.grid.level > 0 && i % 3 == 0 {
                check_parts(&mesh, &topology, &first, voxels, &band);
            }
            for (alpha, assign) in [(1.0, Assign::Planes), (0.0, Assign::Exact), (4.0, Assign::Aabb)] {
                let other = tree(&mesh, &topology, alpha, assign);
                let again = slice(&mesh, &topology, &other, Some(&field), voxels, Extrapolate::Nearest);
                assert!(tangled || same(&band, &again), "{} {alpha} {assign} {settings:?}", case.name);
            }
        }
    }
    assert!(tally.inside > 1000 && tally.touched > 1000 && tally.empty > 1000, "{tally:?}");
}

#[test]
fn values_continue_the_field() {
    let (mut mesh, topology) = prepared(kuhn_jittered([4, 3, 3], 0.3, 5).unwrap());
    let linear = |p: [f32; 3]| 2.0 * p[0] - p[1] + 0.5 * p[2] + 1.0;
    mesh.fields = vec![
        Field { name: "linear".into(), on: On::Points, values: mesh.points.iter().map(|&p| linear(p)).collect() },
        Field { name: "material".into(), on: On::Cells, values: (0..mesh.tets.len()).map(|t| t as f32).collect() },
    ];
    let tree = tree(&mesh, &topology, 0.0, Assign::Aabb);
    let settings = SliceSettings { plane: Plane::Normal([0.3, 0.5, 1.0]), size: [40, 40], layers: 12, ..SliceSettings::default() };
    let (lo, hi) = bounds(&tree);
    let voxels = settings.voxels(lo, hi, mesh.origin).unwrap();
    let far = slice(&mesh, &topology, &tree, mesh.field("linear"), voxels, Extrapolate::Linear);
    let near = slice(&mesh, &topology, &tree, mesh.field("linear"), voxels, Extrapolate::Nearest);
    let cells = slice(&mesh, &topology, &tree, mesh.field("material"), voxels, Extrapolate::Nearest);
    assert!(far.kinds.contains(&TOUCHED));
    for i in 0..far.kinds.len() {
        let n = i as u32;
        let centre = voxels.centre([n % 40, n / 40 % 40, n / 1600]);
        assert_eq!((near.kinds[i], near.owners[i]), (far.kinds[i], far.owners[i]));
        if far.kinds[i] == EMPTY {
            assert!(far.values[i].is_nan() && near.values[i].is_nan() && cells.values[i].is_nan());
            continue;
        }
        assert_eq!(cells.values[i], cells.owners[i] as f32);
        assert!((far.values[i] - linear(centre)).abs() < 1e-4, "{centre:?}: {} for {}", far.values[i], linear(centre));
        if near.kinds[i] == TOUCHED {
            let t = mesh.tets[near.owners[i] as usize].map(|v| wide(mesh.points[v as usize]));
            let reach = distance(&t, wide(centre)) * (4.0f64 + 1.0 + 0.25).sqrt();
            assert!(f64::from((near.values[i] - linear(centre)).abs()) <= reach + 1e-4);
        }
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let (mesh, topology) = prepared(kuhn_jittered([3, 3, 3], 0.0, 0).unwrap());
    let tree = tree(&mesh, &topology, 0.0, Assign::Aabb);
    let (lo, hi) = bounds(&tree);
    let default = SliceSettings::default();
    for bad in [
        SliceSettings { size: [0, 0], ..default },
        SliceSettings { layers: 0, ..default },
        SliceSettings { thickness: Some(0.0), ..default },
        SliceSettings { thickness: Some(f64::NAN), ..default },
        SliceSettings { thickness: Some(-1.0), ..default },
        SliceSettings { thickness: Some(1e30), ..default },
        SliceSettings { at: Some(f64::INFINITY), ..default },
        SliceSettings { at: Some(1e300), ..default },
        SliceSettings { plane: Plane::Normal([0.0; 3]), ..default },
        SliceSettings { plane: Plane::Normal([f64::NAN, 1.0, 0.0]), ..default },
        SliceSettings { plane: Plane::Axis(3), ..default },
        SliceSettings { size: [u32::MAX, 1], ..default },
    ] {
        let made = bad.voxels(lo, hi, mesh.origin);
        let refused = made.and_then(|voxels| Slicer::new(&mesh, &topology, &tree, None, voxels, Extrapolate::Nearest).map(|_| ()));
        assert!(refused.is_err(), "{bad:?}");
    }
    // A plane far away is empty, not an error.
    let voxels = SliceSettings { at: Some(1e6), size: [5, 5], ..default }.voxels(lo, hi, mesh.origin).unwrap();
    let band = slice(&mesh, &topology, &tree, None, voxels, Extrapolate::Nearest);
    assert!(band.kinds.iter().all(|&k| k == EMPTY));
}

/// The weights of a flat tetrahedron sum to rounding noise, so it has no gradient to go on with.
#[test]
fn flat_tetrahedra_are_not_extrapolated() {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [3.0, 3.0, 0.0], [0.0, 0.0, 1.0]];
    let (mesh, topology) = prepared(Mesh { points, tets: vec![[0, 1, 2, 3], [0, 1, 2, 4]], ..Mesh::default() });
    let tree = tree(&mesh, &topology, 0.0, Assign::Exact);
    let field = Field { name: String::from("f"), on: On::Points, values: vec![1.0, 2.0, 3.0, 4.0, 5.0] };
    for k in 0..500 {
        let below = 0.1 + k as f32 / 2000.0;
        let half = [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.5]];
        let [next_voxel, next_row, next_layer] = half;
        let voxels = VoxelGrid { origin: [0.3, 0.3, -below], next_voxel, next_row, next_layer, half, size: [1, 1], layers: 1 };
        let [nearest, linear] =
            [Extrapolate::Nearest, Extrapolate::Linear].map(|e| slice(&mesh, &topology, &tree, Some(&field), voxels, e));
        assert_eq!((&nearest.owners[..], &nearest.values), (&[0][..], &linear.values), "{below} below");
    }
}

/// Cells of a rounding error in size, where two voxels meet: the boxes of voxels side by side leave no gap for them.
#[test]
fn nothing_is_lost_between_voxels() {
    const WIDTH: u32 = 998;
    for lower in [-1.0f32, 15.0] {
        let mut mesh = Mesh::default();
        let mut add = |corner: [f32; 3], size: f32| {
            let n = mesh.points.len() as u32;
            let moved = |c: usize| std::array::from_fn(|i| if i == c { corner[i] + size } else { corner[i] });
            mesh.points.extend([corner, moved(0), moved(1), moved(2)]);
            mesh.tets.push([n, n + 1, n + 2, n + 3]);
        };
        // Two cells that give the bounds, then the small ones.
        add([lower; 3], 0.01);
        add([lower + 2.0; 3], -0.01);
        let boundaries = || (3..WIDTH - 3).step_by(3);
        for i in boundaries() {
            let x = lower + 2.0 * i as f32 / WIDTH as f32;
            add([x, lower + 0.6, lower + 0.7], (x.abs() * f32::EPSILON).max(1e-8));
        }
        let (mesh, topology) = prepared(Mesh::new(mesh.points, mesh.tets));
        let tree = tree(&mesh, &topology, 0.0, Assign::Exact);
        let (lo, hi) = bounds(&tree);
        let settings = SliceSettings { size: [WIDTH, 1], thickness: Some(2.0), ..SliceSettings::default() };
        let band = slice(&mesh, &topology, &tree, None, settings.voxels(lo, hi, mesh.origin).unwrap(), Extrapolate::Nearest);
        let lost = boundaries().filter(|&i| (i - 1..=i).all(|x| band.kinds[x as usize] == EMPTY)).count();
        assert_eq!(lost, 0, "from {lower}");
    }
}
