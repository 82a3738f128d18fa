//! Tests of the owning calls, as a C program calls them: the results are those of Rust.

use super::pictures::pictures;
use super::queries::{Expected, expected, meshes, settings, sliced, values, voxels};
use super::*;
use crate::capi::lists::*;
use crate::capi::query::*;
use crate::mesh::{Bounds, Field};
use crate::render::{Prepared, ValidTets};

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
    let tree_with = |mesh: &Mesh, reorder: u32, options: *const OlbvhBuildOptions| -> *mut OlbvhTree {
        // At twice the size, and then moved to where it belongs.
        let double: Vec<[f32; 3]> = mesh.points.iter().map(|p| p.map(|x| 2.0 * x)).collect();
        let (points, tets) = (double.as_ptr().cast(), mesh.tets.as_ptr().cast());
        let first: *mut OlbvhMesh =
            made(|out| call!(olbvh_mesh_upload(gpu, points, mesh.points.len(), tets, mesh.tets.len(), reorder, out)));
        let held: *mut OlbvhMesh = made(|out| call!(olbvh_mesh_moved(first, mesh.points.as_ptr().cast(), out)));
        call!(olbvh_mesh_free(first));
        let tree = made(|out| call!(olbvh_tree_build(held, options, out)));
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
    let tree_of = |mesh: &Mesh, reorder: u32| tree_with(mesh, reorder, null());
    let middle = |t: &[u32; 4]| [0, 1, 2].map(|c| t.iter().map(|&v| mesh.points[v as usize][c] / 4.0).sum::<f32>());
    let middles: Vec<[f32; 3]> = mesh.tets.iter().map(middle).collect();
    let other_tree = tree_of(&other, 1);
    let listed_tree = tree_with(&other, 1, &OlbvhBuildOptions { lists: 0, ..olbvh_default_build_options() });
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
        listed(tree, listed_tree, &mesh.points, expected);
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
    call!(olbvh_tree_free(listed_tree));
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

/// All owners of points, and all pairs of an overlap, with room for them and with too little.
fn listed(tree: *mut OlbvhTree, other: *mut OlbvhTree, points: &[[f32; 3]], expected: &Expected) {
    let all: Vec<u32> = expected.owners.concat();
    for room in [all.len() + 1, all.len() / 2, 0] {
        let (mut ends, mut found, mut total) = (vec![0u64; points.len()], vec![7u32; room], 0);
        let owners = (ends.as_mut_ptr(), found.as_mut_ptr());
        ok(call!(olbvh_locate_all(tree, points.as_ptr().cast(), points.len(), -1.0, owners.0, owners.1, room, &raw mut total)));
        let lengths: Vec<u64> = [0].iter().chain(&ends).zip(&ends).map(|(begin, end)| end - begin).collect();
        assert!(lengths.into_iter().eq(expected.owners.iter().map(|owners| owners.len() as u64)));
        let written = room.min(all.len());
        assert_eq!((total, &found[..written]), (all.len() as u64, &all[..written]));
        assert!(found[written..].iter().all(|&rest| rest == 7));
    }
    let all = &expected.pairs;
    for room in [all.len() + 1, all.len() / 2, 0] {
        let (mut pairs, mut total) = (vec![[7u32; 2]; room], 0);
        ok(call!(olbvh_overlap_pairs(tree, other, pairs.as_mut_ptr().cast(), room, &raw mut total)));
        let written = room.min(all.len());
        assert_eq!((total, &pairs[..written]), (all.len() as u64, &all[..written]));
        assert!(pairs[written..].iter().all(|&rest| rest == [7; 2]));
    }
}
