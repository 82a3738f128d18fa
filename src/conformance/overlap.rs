//! Cases that compare mesh overlap with the reference implementation (SPEC 3.5): sets, pairs, and effort.

use super::failure::{Stop, Verdict, compare, compare_one};
use super::meshes::MeshRecipe;
use super::twin::Twin;
use crate::build::{BadCells, DeviceMesh, Tree};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::mesh::{Mesh, kuhn_jittered};
use crate::named::named;
use crate::options::{Assign, BuildOptions, Lists};
use crate::query::{SILENT, overlap, overlap_pairs};
use crate::reference::boundary::{Topology, topology};
use crate::reference::build::build;
use crate::reference::overlap::{OverlapSide, overlap as reference};
use crate::tree::TreeArrays;

/// The overlap of a mesh with another one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OverlapCase {
    pub mesh: MeshRecipe,
    pub alpha: f32,
    pub assign: Assign,
    pub lists: Lists,
    pub other: Other,
}

/// The other mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Other {
    /// A jittered grid near the origin.
    Grid,
    /// The mesh itself, moved by a part of its extent.
    Itself,
}

named!(Other, "other mesh", [Grid = "grid", Itself = "itself"]);

/// A mesh with its tree, on host and device.
#[derive(Debug)]
pub struct HostAndDevice {
    mesh: Mesh,
    topology: Topology,
    host: TreeArrays,
    /// The tree on the device.
    pub tree: Tree,
}

impl HostAndDevice {
    /// Prepares a mesh, and builds its tree, on host and device.
    ///
    /// # Errors
    /// Those of the topology and of the build.
    pub fn new(gpu: &Gpu, mesh: Mesh, options: &BuildOptions) -> Result<Self> {
        let topology = topology(&mesh)?;
        let device = DeviceMesh::upload(gpu, &mesh, BadCells::Skip)?;
        let tree = Tree::build(gpu, &device, options)?;
        Ok(Self { host: build(&mesh, &topology, options)?, topology, mesh, tree })
    }

    fn sides(&self) -> Sides<'_> {
        (OverlapSide { mesh: &self.mesh, topology: &self.topology, tree: &self.host }, &self.tree)
    }
}

/// A mesh as input of the reference implementation and of the device.
type Sides<'a> = (OverlapSide<'a>, &'a Tree);

pub(crate) fn check(gpu: &Gpu, case: &OverlapCase, twin: &mut Twin, device: &DeviceMesh) -> Verdict {
    let options = BuildOptions { alpha: case.alpha, assign: case.assign, lists: case.lists, slabs: true, ..BuildOptions::default() };
    let tree = Tree::build(gpu, device, &options)?;
    let built = twin.tree(&options)?;
    let own = (OverlapSide { mesh: &twin.mesh, topology: &twin.topology, tree: built.tree() }, &tree);
    let other = match case.other {
        Other::Grid => kuhn_jittered([6, 5, 4], 0.3, 9)?,
        Other::Itself => {
            let grid = twin.topology.grid;
            let mut mesh = twin.mesh.clone();
            mesh.points.iter_mut().for_each(|p| *p = [0, 1, 2].map(|c| p[c] + [0.37, 0.11, -0.23][c] * (grid.hi[c] - grid.lo[c])));
            mesh
        }
    };
    let other = HostAndDevice::new(gpu, other, &options)?;
    compare_overlaps(own, other.sides())?;
    compare_overlaps(other.sides(), own)?;
    Ok(())
}

/// Compares the overlap of two meshes with that of the reference implementation. Returns the number of tetrahedra of
/// the first mesh that intersect the second.
///
/// # Errors
/// The first difference, or the reason why there is no answer.
pub fn check_overlap(a: &HostAndDevice, b: &HostAndDevice) -> std::result::Result<usize, String> {
    compare_overlaps(a.sides(), b.sides()).map_err(|stop| match stop {
        Stop::Failed(failure) => failure.to_string(),
        Stop::Skipped(why) => why,
    })
}

fn compare_overlaps(a: Sides<'_>, b: Sides<'_>) -> Verdict<usize> {
    let mut hits = 0;
    // Pairs can be found only with full lists.
    let kinds: &[bool] = if a.0.tree.lists == Lists::All { &[false, true] } else { &[false] };
    for &pairs in kinds {
        let expected = reference(a.0, b.0, pairs);
        let find = if pairs { overlap_pairs } else { overlap };
        let found = find(a.1, b.1, SILENT)?.overlap;
        hits = expected.a.len();
        let stage = if pairs { "query.overlap_pairs" } else { "query.overlap_search" };
        compare(stage, "a", &expected.a, &found.a)?;
        compare(stage, "b", &expected.b, &found.b)?;
        compare_one(stage, "pairs are listed", &expected.pairs.is_some(), &found.pairs.is_some())?;
        compare(stage, "pairs", expected.pairs.as_deref().unwrap_or_default(), found.pairs.as_deref().unwrap_or_default())?;
        compare_one(stage, "narrow tests", &expected.effort[0].narrow, &found.effort[0].narrow)?;
        if !pairs {
            compare_one(stage, "effort", &expected.effort, &found.effort)?;
        }
    }
    Ok(hits)
}
