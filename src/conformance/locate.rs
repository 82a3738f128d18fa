//! Cases that compare point location with the reference implementation: owners and barycentric coordinates to the bit.

use super::buffers::Guarded;
use super::data::Random;
use super::failure::{Verdict, compare, fail};
use super::meshes::MeshRecipe;
use super::twin::Twin;
use crate::build::{DeviceMesh, Tree};
use crate::error::Error;
use crate::gpu::{Arena, Gpu};
use crate::layout::NONE;
use crate::mesh::{Mesh, On};
use crate::options::{Assign, BuildOptions, Lists, TOLERANCE};
use crate::query::code_bits;
use crate::query::{
    LocateMethod, LocateOptions, LocateOutput, PointInput, PointOrder, SILENT, Scene, cmd_locate, cmd_sort_points, locate, locate_all,
    nearest,
};
use crate::reference::locate::{Location, Locator, order_of};
use crate::reference::nearest::Surface;

/// How the points of a case are located.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum How {
    /// By descent, with the owning call.
    Descent,
    /// By the paper's traversal with a short stack of this many nodes.
    Traversal(u32),
    /// By runs, with the owning call.
    Runs,
    /// In sorted order, with the owning call.
    Sorted,
    /// By runs in sorted order, with the owning call.
    SortedRuns,
    /// Recorded, with the right owner, a wrong one, or none as a hint.
    Hints,
    /// All owners.
    All,
    /// With interpolated values of a field.
    Values,
    /// The closest places of the surface.
    Nearest,
    /// Trees of every α and assignment must give the same owners and lose no point of the mesh.
    Same,
}

impl How {
    pub(crate) fn name(self) -> String {
        match self {
            Self::Descent => "descent".into(),
            Self::Traversal(stack) => format!("stack-{stack}"),
            Self::Runs => "runs".into(),
            Self::Sorted => "sorted".into(),
            Self::SortedRuns => "sorted-runs".into(),
            Self::Hints => "hints".into(),
            Self::All => "all-owners".into(),
            Self::Values => "values".into(),
            Self::Nearest => "nearest".into(),
            Self::Same => "same-owners".into(),
        }
    }
}

/// Points to locate in a tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocateCase {
    pub mesh: MeshRecipe,
    pub alpha: f32,
    pub assign: Assign,
    pub lists: Lists,
    pub how: How,
}

pub(crate) fn check(gpu: &Gpu, case: &LocateCase, twin: &mut Twin, device: &DeviceMesh) -> Verdict {
    let options = BuildOptions { alpha: case.alpha, assign: case.assign, lists: case.lists, slabs: true, ..BuildOptions::default() };
    let tree = Tree::build(gpu, device, &options)?;
    let built = twin.tree(&options)?;
    let (points, _) = twin.points();
    let (mesh, locator) = (&twin.mesh, twin.locator(&built));
    match case.how {
        How::Descent | How::Traversal(_) | How::Runs | How::Sorted | How::SortedRuns => {
            let method = match case.how {
                How::Traversal(stack) => LocateMethod::Traversal(stack),
                How::Runs => LocateMethod::Runs,
                How::Sorted => LocateMethod::Sorted,
                How::SortedRuns => LocateMethod::SortedRuns,
                _ => LocateMethod::Descent,
            };
            let found = locate(&tree, points, None, &LocateOptions { method, ..LocateOptions::default() }, SILENT)?;
            let order =
                if method.is_sorted() { order_of(&built.tree().grid, points, code_bits(gpu)) } else { (0..points.len() as u32).collect() };
            let runs = matches!(case.how, How::Runs | How::SortedRuns).then(|| locator.locate_in_runs(points, &order));
            let expected = runs.as_deref().unwrap_or_else(|| twin.locations(&built));
            compare_locations(expected, &found.owners, &found.barycentrics, points)?;
            // The owners do not show whether points were sorted.
            if case.how == How::Sorted { same_order(gpu, &Scene::of(&tree), points, &order) } else { Ok(()) }
        }
        How::Hints => hints(gpu, mesh, device, &tree, &locator, points),
        How::All => {
            let lists: Vec<_> = points.iter().map(|&p| locator.owners(p)).collect();
            compare("query.locate_all", "owners", &lists, &locate_all(&tree, points, TOLERANCE, SILENT)?.owners)
        }
        How::Values => {
            // Values are whole numbers below 2^12, so products and sums differ at most by the rounding of the division
            // that computes the barycentric coordinates.
            for (on, n) in [(On::Points, mesh.points.len()), (On::Cells, mesh.tets.len())] {
                let field = crate::mesh::Field {
                    name: "test".into(),
                    on,
                    values: (0..n).map(|i| (super::data::mix(i as u32) % 4096) as f32).collect(),
                };
                let found = locate(&tree, points, Some((&field.values, on)), &LocateOptions::default(), SILENT)?;
                let near = |a: f32, b: f32| (a.is_nan() && b.is_nan()) || (a - b).abs() <= 4096.0 * 1e-6;
                let values: Vec<f32> = twin.locations(&built).iter().map(|e| e.value(mesh, &field)).collect();
                if let Some(i) = (0..points.len()).find(|&i| !found.values.get(i).is_some_and(|v| near(*v, values[i]))) {
                    return Err(fail(
                        "query.interpolate",
                        "values",
                        Some(i),
                        &format!("{}", values[i]),
                        &format!("{:?}", found.values.get(i)),
                    ));
                }
            }
            Ok(())
        }
        How::Nearest => {
            let surface = Surface::new(mesh, &twin.topology, built.tree());
            for within in [f32::INFINITY, 0.1 / built.tree().grid.scale] {
                let found = nearest(&tree, points, within, SILENT)?;
                let expected: Vec<_> = points.iter().map(|&p| surface.nearest(p, within)).collect();
                let places: Vec<_> = expected.iter().map(|place| place.map_or(Location::NOWHERE, |(location, _)| location)).collect();
                compare_locations(&places, &found.owners, &found.barycentrics, points)?;
                let squares: Vec<u32> = expected.iter().map(|place| place.map_or(f32::INFINITY, |(_, square)| square).to_bits()).collect();
                compare("query.nearest", "squares", &squares, &found.squares.iter().map(|s| s.to_bits()).collect::<Vec<_>>())?;
            }
            Ok(())
        }
        How::Same => same_owners(gpu, twin, device, &tree),
    }
}

/// Locates points of the mesh in trees of every kind, which must all find the same owners.
fn same_owners(gpu: &Gpu, twin: &mut Twin, device: &DeviceMesh, first: &Tree) -> Verdict {
    let (points, inside) = twin.points();
    let points = points[..inside].to_vec();
    let owners = |tree: &Tree| Ok::<_, Error>(locate(tree, &points, None, &LocateOptions::default(), SILENT)?.owners);
    let expected = owners(first)?;
    if let Some(i) = expected.iter().position(|&o| o == NONE) {
        return Err(fail("query.locate", "owners", Some(i), &format!("an owner of {:?}", points[i]), "none"));
    }
    for (alpha, assign) in [(0.0, Assign::Planes), (1.0, Assign::Exact), (2.0, Assign::Planes), (4.0, Assign::Aabb)] {
        for lists in Lists::EVERY {
            let tree = Tree::build(gpu, device, &BuildOptions { alpha, assign, lists, ..*first.options() })?;
            let stage = format!("query.locate (alpha {alpha}, {assign}, lists {lists})");
            let same = compare(&stage, "owners", &expected, &owners(&tree)?);
            if lists == Lists::All { same } else { twin.same_unless_tangled(same) }?;
        }
    }
    Ok(())
}

fn compare_locations(expected: &[Location], owners: &[u32], barycentrics: &[[f32; 4]], points: &[[f32; 3]]) -> Verdict {
    let place = |i: usize| format!("owners (point {:?})", points.get(i));
    let first = expected.iter().zip(owners).position(|(e, o)| e.owner != *o).unwrap_or(0);
    compare("query.locate", &place(first), &expected.iter().map(|e| e.owner).collect::<Vec<_>>(), owners)?;
    let bits = |b: &[f32; 4]| b.map(f32::to_bits);
    let wanted: Vec<_> = expected.iter().map(|e| bits(&e.barycentric)).collect();
    compare("query.locate", "barycentrics (bits)", &wanted, &barycentrics.iter().map(bits).collect::<Vec<_>>())
}

/// Compares the order that points are sorted into.
fn same_order(gpu: &Gpu, scene: &Scene, points: &[[f32; 3]], expected: &[u32]) -> Verdict {
    let count = points.len() as u32;
    let input = gpu.upload("olbvh.conformance.points", points)?;
    let (memory, order) = Arena::reserve(gpu, "olbvh.conformance.order", |a| PointOrder::carve(gpu, a, count))?;
    let input = PointInput { points: input.all(), stride: 3, count, hints: None, order: None };
    gpu.submit("olbvh.conformance.sort_points", |r| cmd_sort_points(r, scene.tree.grid, &input, &order))?;
    compare("query.sort_points", "order", expected, &gpu.download::<u32>(&memory, order.order)?)
}

/// Locates points with hints: the owner, another valid tetrahedron, or none. The reference implementation gets the same
/// hints.
fn hints(gpu: &Gpu, mesh: &Mesh, device: &DeviceMesh, tree: &Tree, locator: &Locator<'_>, points: &[[f32; 3]]) -> Verdict {
    let bad = device.bad_cells()?;
    let valid: Vec<u32> = (0..mesh.tets.len() as u32).filter(|t| bad.binary_search(t).is_err()).collect();
    let mut random = Random::new(77);
    let hint = |p: &[f32; 3]| match random.below(3) {
        0 => locator.locate(*p).owner,
        1 if !valid.is_empty() => valid[random.below(valid.len() as u32) as usize],
        _ => NONE,
    };
    let hints: Vec<u32> = points.iter().map(hint).collect();
    let expected: Vec<_> = points.iter().zip(&hints).map(|(p, h)| locator.locate_near(*p, *h)).collect();
    let n = points.len();
    let input = gpu.upload("olbvh.conformance.points", points)?;
    let hint_buffer = gpu.upload("olbvh.conformance.hints", &hints)?;
    let owners = Guarded::new(gpu, "olbvh.conformance.owners", &[], n)?;
    let barycentrics = Guarded::new(gpu, "olbvh.conformance.barycentrics", &[], 4 * n)?;
    let scene = Scene::of(tree);
    let input = PointInput { points: input.all(), stride: 3, count: n as u32, hints: Some(hint_buffer.all()), order: None };
    let output = LocateOutput { owners: owners.all(), barycentrics: barycentrics.all() };
    gpu.submit("olbvh.conformance.locate", |r| cmd_locate(r, &scene, &input, &output, &LocateOptions::default()))?;
    let words = barycentrics.read(gpu, "query.locate")?;
    let found: Vec<_> = words.chunks_exact(4).map(|w| [0, 1, 2, 3].map(|i| f32::from_bits(w[i]))).collect();
    compare_locations(&expected, &owners.read(gpu, "query.locate")?, &found, points)
}
