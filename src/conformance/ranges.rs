//! Cases that compare the ranges of a field in every node, and the nodes with visible values, with the reference
//! implementation.

use super::buffers::Guarded;
use super::failure::{Verdict, compare, compare_one, fail};
use super::meshes::MeshRecipe;
use super::picture::field;
use super::twin::Twin;
use crate::build::{DeviceMesh, Tree, cmd_ranges, range_bytes};
use crate::gpu::Gpu;
use crate::mesh::{Field, Mesh, On};
use crate::options::{Assign, BuildOptions, Lists};
use crate::query::{cmd_visible, visible_bytes};
use crate::reference::boundary::Topology;
use crate::reference::ranges::{ranges, visible};
use crate::tree::TreeArrays;

/// A field on a mesh with a tree.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RangesCase {
    pub mesh: MeshRecipe,
    pub alpha: f32,
    pub assign: Assign,
    pub lists: Lists,
    pub on: On,
}

/// Ranges of values that are drawn: everything, nothing, some values, a single value.
const DRAWN: [&[[f32; 2]]; 4] =
    [&[[f32::NEG_INFINITY, f32::INFINITY]], &[], &[[f32::NEG_INFINITY, -0.9], [0.1, 0.15], [0.4, 0.4], [0.95, 2.0]], &[[0.5, 0.5]]];

/// Replaces some values by non-finite ones and by others that are easily mishandled.
fn spoil(field: &mut Field) {
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.0, 0.0, 1e-42, -1e-42, f32::MAX, f32::MIN];
    for (i, v) in field.values.iter_mut().enumerate().filter(|(i, _)| i % 17 == 5) {
        *v = odd[i / 17 % odd.len()];
    }
}

pub(crate) fn check(gpu: &Gpu, case: &RangesCase, twin: &mut Twin, device: &DeviceMesh) -> Verdict {
    let options = BuildOptions { alpha: case.alpha, assign: case.assign, lists: case.lists, slabs: true, ..BuildOptions::default() };
    let built = twin.tree(&options)?;
    let (mesh, topology, host) = (&twin.mesh, &twin.topology, built.tree());
    let tree = Tree::build(gpu, device, &options)?;
    let (view, nodes) = (device.view(), host.nodes());
    let mut field = field(mesh, case.on);
    let bits = |ranges: &[[f32; 2]]| ranges.iter().map(|r| r.map(f32::to_bits)).collect::<Vec<_>>();
    for spoilt in [false, true] {
        if spoilt {
            spoil(&mut field);
        }
        let expected = ranges(mesh, topology, host, &field);
        // The recorded form must work whatever the memory held before, and write nothing after its end.
        let memory = Guarded::scratch(gpu, "olbvh.conformance.ranges", range_bytes(nodes))?;
        let values = gpu.upload("olbvh.conformance.field", &field.values)?;
        gpu.submit("olbvh.conformance.ranges", |r| cmd_ranges(r, &view, tree.memory(), (values.all(), field.on), memory.all()))?;
        let found: Vec<[u32; 2]> = memory.read(gpu, "build.ranges")?.chunks_exact(2).map(|r| [r[0], r[1]]).collect();
        compare("build.ranges", "recorded ranges", &bits(&expected), &found)?;
        for drawn in DRAWN {
            let marks = Guarded::scratch(gpu, "olbvh.conformance.marks", visible_bytes(nodes))?;
            let on_device = gpu.upload("olbvh.conformance.drawn", drawn)?;
            let drawn_ranges = (on_device.all(), drawn.len() as u32);
            gpu.submit("olbvh.conformance.visible", |r| cmd_visible(r, tree.memory(), memory.all(), drawn_ranges, marks.all()))?;
            compare("query.visible", "visible", &visible(&expected, drawn), &marks.read(gpu, "query.visible")?)?;
        }
        holds(host, mesh, topology, &field, &expected)?;
    }
    compare_one("build.ranges", "nodes", &nodes, &tree.status().nodes)
}

/// Checks that the range of every leaf contains the values of the tetrahedra that it lists, and that of every node
/// those of its children.
fn holds(tree: &TreeArrays, mesh: &Mesh, topology: &Topology, field: &Field, ranges: &[[f32; 2]]) -> Verdict {
    let wrong = |node: u32| fail("build.ranges", "ranges", Some(node as usize), "a range around all values in the node", "a smaller one");
    for leaf in tree.leaves() {
        let [lo, hi] = ranges[leaf as usize];
        for &t in tree.tets(leaf).iter().filter(|&&t| topology.is_valid(t)) {
            let ids = mesh.tets[t as usize];
            let values = if field.on == On::Points { ids.map(|i| field.values[i as usize]) } else { [field.values[t as usize]; 4] };
            if values.iter().all(|v| v.is_finite()) && !values.iter().all(|v| (lo..=hi).contains(v)) {
                return Err(wrong(leaf));
            }
        }
    }
    for node in 0..tree.internal_nodes() {
        let [lo, hi] = ranges[node as usize];
        if tree.children(node).map(|child| ranges[child as usize]).any(|[a, b]| a < lo || b > hi) {
            return Err(wrong(node));
        }
    }
    Ok(())
}
