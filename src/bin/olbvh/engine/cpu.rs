//! The engine that computes on the CPU with the reference implementation.

use super::{Engine, OnProgress, Sink, Summary};
use olbvh::blocks::{Cost, LocateRequest, OverlapRequest, Picture, RenderRequest, SliceRequest};
use olbvh::error::Result;
use olbvh::mesh::Mesh;
use olbvh::options::{BuildOptions, POINT_CHUNK, POINT_CODE_BITS};
use olbvh::query::{AllOwners, LocateMethod, LocateOptions, Located, Nearest, Overlapped, Rendered, Sliced};
use olbvh::reference::boundary::{Topology, topology};
use olbvh::reference::depth::measure;
use olbvh::reference::locate::{self, Location, Locator};
use olbvh::reference::nearest::Surface;
use olbvh::reference::overlap::{OverlapSide, overlap};
use olbvh::reference::slice::Slicer;
use olbvh::reference::vertices::Vertices;
use olbvh::reference::volume::{self, Drawing};
use olbvh::slicing::{BAND_VOXELS, Tally, bands};
use olbvh::tree::TreeArrays;
use rayon::prelude::*;
use std::time::Instant;

/// The CPU.
pub struct Cpu;

/// A mesh with its topology and tree in host memory.
struct CpuTree<'a> {
    mesh: &'a Mesh,
    topology: Topology,
    tree: TreeArrays,
    topology_ms: f64,
    build_ms: f64,
}

impl Engine for Cpu {
    fn name(&self) -> String {
        "cpu".into()
    }

    fn target(&self) -> Option<&super::Shapes> {
        None
    }

    fn summary(&self, mesh: &Mesh, options: &BuildOptions) -> Result<Summary> {
        let CpuTree { topology, tree, topology_ms, build_ms, .. } = CpuTree::new(mesh, options)?;
        let wanted = match options.level {
            Some(level) => level,
            None => measure(mesh, &topology, &Vertices::new(mesh, &topology.grid)).heuristic(options.alpha_fixed()?),
        };
        Ok(Summary {
            counts: topology.counts,
            bad: topology.bad,
            bounds: (&tree.grid).into(),
            graded: tree.grid.graded != 0,
            level: tree.grid.level,
            wanted,
            entries: tree.p.len() as u64,
            nodes: u64::from(tree.nodes()),
            leaves: tree.leaves().len() as u64,
            memory: tree.memory(),
            paper_bytes: tree.memory().paper(),
            neighbour_bytes: size_of_val(&topology.neighbours[..]) as u64,
            topology_ms,
            build_ms,
            stages: Vec::new(),
        })
    }

    fn locate(&self, asked: &LocateRequest<'_>, how: &LocateOptions, report: OnProgress<'_>) -> Result<(Located, Cost)> {
        on_host(asked.mesh, &asked.options, |tree| tree.locate(asked.points, how, report))
    }

    fn locate_all(&self, asked: &LocateRequest<'_>, tolerance: f32, report: OnProgress<'_>) -> Result<(AllOwners, Cost)> {
        on_host(asked.mesh, &asked.options, |tree| {
            let locator = Locator::new(tree.mesh, &tree.topology, &tree.tree).with_tolerance(tolerance);
            Ok(AllOwners { owners: each(asked.points, |p| locator.owners(p), report)?, ..AllOwners::default() })
        })
    }

    fn nearest(&self, asked: &LocateRequest<'_>, within: f32, report: OnProgress<'_>) -> Result<(Nearest, Cost)> {
        on_host(asked.mesh, &asked.options, |tree| {
            let surface = Surface::new(tree.mesh, &tree.topology, &tree.tree);
            let found = each(asked.points, |p| surface.nearest(p, within).unwrap_or((Location::NOWHERE, f32::INFINITY)), report)?;
            Ok(Nearest {
                owners: found.iter().map(|(location, _)| location.owner).collect(),
                barycentrics: found.iter().map(|(location, _)| location.barycentric).collect(),
                squares: found.iter().map(|(_, square)| *square).collect(),
                scale: tree.tree.grid.scale,
                ..Nearest::default()
            })
        })
    }

    fn overlap(&self, asked: &OverlapRequest<'_>, report: OnProgress<'_>) -> Result<(Overlapped, Cost)> {
        let ([a, b], options) = (asked.meshes, &asked.options);
        let start = Instant::now();
        let (topology_a, topology_b) = (topology(a)?, topology(b)?);
        let build = olbvh::reference::build::build;
        let (tree_a, tree_b) = (build(a, &topology_a, options)?, build(b, &topology_b, options)?);
        let build_seconds = start.elapsed().as_secs_f64();
        let side_a = OverlapSide { mesh: a, topology: &topology_a, tree: &tree_a };
        let found = overlap(side_a, OverlapSide { mesh: b, topology: &topology_b, tree: &tree_b }, asked.pairs);
        let answer = Overlapped { overlap: found, ..Overlapped::default() };
        report(1, 1)?;
        let bad_cells = [topology_a.counts.bad, topology_b.counts.bad];
        Ok((answer, Cost { trees: 2, peak: 0, build_seconds, bad_cells }))
    }

    fn render(&self, asked: &RenderRequest<'_>, report: OnProgress<'_>) -> Result<(Picture, Cost)> {
        on_host(asked.mesh, &asked.options, |tree| {
            let scene = Drawing::new(tree.mesh, &tree.topology, &tree.tree, asked.field, asked.settings)?;
            let volume::Picture { colors, stats, times, .. } = volume::render(&scene, report)?;
            Ok(Picture { rendered: Rendered { colors, stats, times }, prepared: scene.into_prepared() })
        })
    }

    fn slice(&self, asked: &SliceRequest<'_>, report: OnProgress<'_>, sink: Sink<'_>) -> Result<(Sliced, Cost)> {
        let SliceRequest { field, voxels, extrapolate, .. } = *asked;
        on_host(asked.mesh, &asked.options, |tree| {
            let slicer = Slicer::new(tree.mesh, &tree.topology, &tree.tree, field, *voxels, extrapolate)?;
            let (mut tally, mut done) = (Tally::default(), 0);
            // Bands are those of the device, so that owners are equal even where tetrahedra overlap.
            for rows in bands(voxels, BAND_VOXELS) {
                let band = slicer.band(rows);
                tally.add(&band.kinds);
                sink(band)?;
                done += u64::from(rows.count) * u64::from(voxels.size[0]);
                report(done, voxels.voxels())?;
            }
            Ok(Sliced { tally, ..Sliced::default() })
        })
    }
}

/// Builds the tree over the whole mesh and computes an answer with it.
fn on_host<T>(mesh: &Mesh, options: &BuildOptions, answer: impl FnOnce(&CpuTree<'_>) -> Result<T>) -> Result<(T, Cost)> {
    let tree = CpuTree::new(mesh, options)?;
    let cost = Cost { trees: 1, peak: 0, build_seconds: tree.build_ms / 1e3, bad_cells: [tree.topology.counts.bad, 0] };
    Ok((answer(&tree)?, cost))
}

impl<'a> CpuTree<'a> {
    fn new(mesh: &'a Mesh, options: &BuildOptions) -> Result<Self> {
        let start = Instant::now();
        let topology = topology(mesh)?;
        let topology_ms = start.elapsed().as_secs_f64() * 1e3;
        let start = Instant::now();
        let tree = olbvh::reference::build::build(mesh, &topology, options)?;
        let build_ms = start.elapsed().as_secs_f64() * 1e3;
        Ok(Self { mesh, topology, tree, topology_ms, build_ms })
    }

    fn locate(&self, points: &[[f32; 3]], options: &LocateOptions, report: OnProgress<'_>) -> Result<Located> {
        let locator = Locator::new(self.mesh, &self.topology, &self.tree).with_tolerance(options.tolerance);
        let mut all = Located::default();
        // Chunks and runs are those of a device (sorted ones, those of a processor), so that owners are equal even where tetrahedra overlap.
        for chunk in points.chunks(POINT_CHUNK) {
            let found = match options.method {
                LocateMethod::Runs => locator.locate_in_runs(chunk, &(0..chunk.len() as u32).collect::<Vec<_>>()),
                LocateMethod::SortedRuns => locator.locate_in_runs(chunk, &locate::order_of(&self.tree.grid, chunk, POINT_CODE_BITS)),
                LocateMethod::Suited | LocateMethod::Descent | LocateMethod::Sorted | LocateMethod::Traversal(_) => {
                    locator.locate_each(chunk)
                }
            };
            all.owners.extend(found.iter().map(|l| l.owner));
            all.barycentrics.extend(found.iter().map(|l| l.barycentric));
            report(all.owners.len() as u64, points.len() as u64)?;
        }
        Ok(all)
    }
}

/// Number of points between two progress reports.
const CHUNK: usize = 1 << 16;

/// Computes the answers for all points, in parallel, chunk by chunk.
fn each<T: Send>(points: &[[f32; 3]], one: impl Fn([f32; 3]) -> T + Sync, report: OnProgress<'_>) -> Result<Vec<T>> {
    let mut all = Vec::with_capacity(points.len());
    for chunk in points.chunks(CHUNK) {
        all.par_extend(chunk.par_iter().map(|&p| one(p)));
        report(all.len() as u64, points.len() as u64)?;
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use olbvh::slicing::{Band, Extrapolate, Rows, SliceSettings};

    /// Where cells overlap, the owner of a voxel depends on where runs start: in wide layers, too, where the device
    /// starts them.
    #[test]
    fn runs_of_wide_layers_start_where_those_of_the_device_do() -> Result<()> {
        let one = olbvh::mesh::kuhn([6; 3])?;
        let moved = one.points.iter().map(|p| [p[0] + 0.37, p[1] + 0.21, p[2] + 0.43]);
        let beside = one.tets.iter().map(|t| t.map(|v| v + one.points.len() as u32));
        let mesh = &Mesh::new(one.points.iter().copied().chain(moved).collect(), one.tets.iter().copied().chain(beside).collect());
        let settings = SliceSettings { size: [1100, 130], ..SliceSettings::default() };
        let voxels = &settings.voxels([0.0; 3], [6.43; 3], mesh.origin)?;
        let (options, extrapolate) = (BuildOptions::default(), Extrapolate::Nearest);
        let mut owners = Vec::new();
        let mut sink = |band: Band| {
            owners.extend(band.owners);
            Ok(())
        };
        Cpu.slice(&SliceRequest { mesh, options, field: None, voxels, extrapolate }, &|_, _| Ok(()), &mut sink)?;
        let CpuTree { topology, tree, .. } = &CpuTree::new(mesh, &options)?;
        let whole = Slicer::new(mesh, topology, tree, None, *voxels, extrapolate)?.band(Rows { layer: 0, first: 0, count: 130 });
        assert!(owners == whole.owners, "{} owners differ", owners.iter().zip(&whole.owners).filter(|(a, b)| a != b).count());
        Ok(())
    }
}
