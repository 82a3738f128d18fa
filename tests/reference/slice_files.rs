//! Slices of mesh files against brute force: every tetrahedron with every voxel that its box may reach.
//!
//! The files of the repository and, with `OLBVH_TEST_MESHES=FOLDER`, all files in this folder and its subfolders.

use super::oracle::{P, box_gap};
use super::prepared;
use super::slice::{bounds, slice, wide};
use olbvh::formats::{LoadOptions, load};
use olbvh::layout::NONE;
use olbvh::options::BuildOptions;
use olbvh::reference::build::build;
use olbvh::slicing::{EMPTY, Extrapolate, Plane, SliceSettings, Tally, VoxelGrid};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

fn dot(a: P, b: P) -> f64 {
    (0..3).map(|c| a[c] * b[c]).sum()
}

/// The voxels along an axis that a tetrahedron may meet, out of `n`. They are `step` apart, numbered from `origin`, and
/// their boxes reach `half` along the axis; `slack` is the allowance of a touch.
fn reached(v: &[P; 4], origin: P, step: P, half: P, n: u32, slack: f64) -> std::ops::Range<u32> {
    let length = dot(step, step);
    let places = v.map(|p| dot([0, 1, 2].map(|c| p[c] - origin[c]), step) / length);
    // The allowance of a touch and, far from 0, the rounding of centres may be more than the width of a voxel.
    let rounding = origin.iter().fold(0.0, |most: f64, x| most.max(x.abs())) * 1e-6;
    let reach = dot(half, step).abs() / length + 0.01 + (rounding + slack) / length.sqrt();
    let lo = places.into_iter().fold(f64::MAX, f64::min) - reach;
    let hi = places.into_iter().fold(f64::MIN, f64::max) + reach;
    lo.ceil().clamp(0.0, f64::from(n)) as u32..(hi.floor() + 1.0).clamp(0.0, f64::from(n)) as u32
}

/// The smallest gap between each voxel and the tetrahedra that come near it.
fn gaps(voxels: &VoxelGrid, tets: &[[P; 4]], slack: f64) -> Vec<f64> {
    let [w, h] = voxels.size;
    let half = voxels.half.map(wide);
    let origin = wide(voxels.origin);
    let extent = [0, 1, 2].map(|c| half.iter().map(|h| h[c].abs()).sum::<f64>());
    // A voxel outside of the box of a tetrahedron by more than the allowance of a touch is apart from it.
    let meets = |lo: P, hi: P, centre: P| (0..3).all(|c| lo[c] - extent[c] - slack <= centre[c] && centre[c] <= hi[c] + extent[c] + slack);
    let normal = |layers: u32| if layers > 1 { voxels.next_layer } else { voxels.half[2] };
    let near = |v: &[P; 4]| {
        let along = |step: [f32; 3], k: usize, n: u32| reached(v, origin, wide(step), half[k], n, slack);
        let (xs, ys) = (along(voxels.next_voxel, 0, w), along(voxels.next_row, 1, h));
        let layers = along(normal(voxels.layers), 2, voxels.layers);
        let [lo, hi] = [f64::min, f64::max].map(|pick| [0, 1, 2].map(|c| v.iter().map(|p| p[c]).fold(v[0][c], pick)));
        let mut found = Vec::new();
        for (k, y) in layers.flat_map(|k| ys.clone().map(move |y| (k, y))) {
            for x in xs.clone() {
                let centre = wide(voxels.centre([x, y, k]));
                if meets(lo, hi, centre) {
                    found.push(((k * h + y) * w + x, box_gap(v, centre, &half)));
                }
            }
        }
        found
    };
    let mut least = vec![f64::MAX; voxels.voxels() as usize];
    for (i, gap) in tets.par_iter().flat_map_iter(near).collect::<Vec<_>>() {
        least[i as usize] = least[i as usize].min(gap);
    }
    least
}

/// Checks slices with `finer` times as many voxels per axis.
fn check(file: &Path, finer: u32, tally: &mut Tally) {
    let mesh = match load(file, &LoadOptions::default()) {
        Ok(loaded) => loaded.mesh,
        Err(e) => return println!("NOT A MESH: {e}"),
    };
    let (mesh, topology) = prepared(mesh);
    let tree = build(&mesh, &topology, &BuildOptions::default()).unwrap();
    let (lo, hi) = bounds(&tree);
    let size = (0..3).map(|c| f64::from(hi[c]) - f64::from(lo[c])).fold(0.0, f64::max);
    let valid = (0..).zip(&mesh.tets).filter(|(t, _)| topology.is_valid(*t));
    let tets: Vec<[P; 4]> = valid.map(|(_, ids)| ids.map(|i| wide(mesh.points[i as usize]))).collect();
    for settings in [
        SliceSettings { size: [40, 30].map(|n| n * finer), ..SliceSettings::default() },
        SliceSettings { plane: Plane::Axis(0), size: [10, 8].map(|n| n * finer), layers: 3, ..SliceSettings::default() },
        SliceSettings { plane: Plane::Normal([1.0, 2.0, -1.0]), size: [25, 20].map(|n| n * finer), layers: 2, ..SliceSettings::default() },
    ] {
        let voxels = match settings.voxels(lo, hi, mesh.origin) {
            Ok(voxels) if size > 0.0 => voxels,
            _ => return println!("NO VOLUME: {}", file.display()),
        };
        let band = slice(&mesh, &topology, &tree, None, voxels, Extrapolate::Nearest);
        let extent = voxels.half.iter().map(|h| h.iter().map(|&x| f64::from(x).abs()).sum::<f64>()).fold(0.0, f64::max);
        let slack = 4e-6 * (size + extent);
        for (i, gap) in gaps(&voxels, &tets, slack).into_iter().enumerate() {
            let (kind, owner) = (band.kinds[i], band.owners[i]);
            let what = || format!("{}: voxel {i} of {voxels:?}: kind {kind}, owner {owner}, gap {gap:e}", file.display());
            if kind == EMPTY {
                assert!(gap > 0.0 && owner == NONE, "touched: {}", what());
            } else {
                assert!(gap < slack && owner != NONE, "not touched: {}", what());
            }
        }
        tally.add(&band.kinds);
    }
    println!("{}: {} cells, as brute force says", file.display(), tets.len());
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for path in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
    found.sort();
}

#[test]
fn slices_of_files_are_conservative() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = vec![root.join("tests/data/flow_sphere_50k.vtu"), root.join("tests/data/bracket_50k.vtu")];
    let mut finer = 1;
    match std::env::var_os("OLBVH_TEST_MESHES") {
        Some(folder) => {
            files(Path::new(&folder), &mut paths);
            finer = 4;
        }
        None => println!("NOT ALL: OLBVH_TEST_MESHES=FOLDER tests the meshes of a folder too, in finer slices"),
    }
    let mut tally = Tally::default();
    paths.iter().for_each(|file| check(file, finer, &mut tally));
    assert!(tally.inside > 1000 && tally.touched > 1000 && tally.empty > 1000, "{tally:?}");
}
