//! A mesh on the device, and the queries that all structures over it answer.

use super::load::Load;
use super::measure::{Timing, repeat};
use super::quantity::Quantity;
use super::structure::Structure;
use super::suite::Settings;
use crate::build::{BadCells, DeviceMesh};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::grid::morton;
use crate::mesh::{Bounds, Field, Mesh, On, fault_of};
use crate::query::{self, Rendered, SILENT, Sliced};
use crate::render::{PicturePlan, RenderSettings};
use crate::slicing::{Band, Extrapolate, SliceSettings, VoxelGrid};

/// Thickness of voxels as a fraction of the largest extent: one cell of the paper's mesh *Jets*.
const THICKNESS: f64 = 1.0 / 127.0;
/// Distance by which the mesh is moved along each axis for the overlap with itself, as a fraction of the extent.
const MOVED: f32 = 0.137;

/// A mesh and its queries.
pub(super) struct Subject<'a> {
    pub gpu: &'a Gpu,
    pub name: &'a str,
    pub mesh: &'a Mesh,
    pub device: DeviceMesh,
    /// Times of stage 0, which is done once per mesh for all structures.
    pub topology: Timing,
    /// What keeps the device at its clock before every measurement.
    pub load: Load,
    /// The same mesh, moved, if the overlap is measured.
    pub moved: Option<DeviceMesh>,
    /// Points to locate, and the quantity that they measure.
    pub points: Vec<(Quantity, Vec<[f32; 3]>)>,
    field: Field,
    plan: Option<PicturePlan>,
    voxels: Option<VoxelGrid>,
}

impl<'a> Subject<'a> {
    pub(super) fn new(gpu: &'a Gpu, name: &'a str, mesh: &'a Mesh, settings: &Settings) -> Result<Self> {
        let device = DeviceMesh::upload(gpu, mesh, BadCells::Skip)?;
        let load = Load::new(gpu)?;
        let topology = {
            let mut again = device.again()?;
            again()?; // the first one gets memory that the system has yet to give
            repeat(&load, &settings.budget, again)?.timing(None)
        };
        let grid = *device.grid();
        let bounds = Bounds::from(&grid);
        let extent = [0, 1, 2].map(|c| bounds.hi[c] - bounds.lo[c]);
        let move_it = || {
            let mut moved = mesh.clone();
            moved.points.iter_mut().for_each(|p| *p = [0, 1, 2].map(|c| p[c] + MOVED * extent[c]));
            DeviceMesh::upload(gpu, &moved, BadCells::Skip)
        };
        let moved = settings.overlap.then(move_it).transpose()?;

        let random = random_points(mesh, settings.points);
        let mut coherent = random.clone();
        coherent.sort_by_cached_key(|&p| morton(grid.quantize(p)));

        let of_points = mesh.fields.iter().find(|f| f.on == On::Points).cloned();
        let along_x = || Field { name: "x".into(), on: On::Points, values: mesh.points.iter().map(|p| p[0]).collect() };
        let field = of_points.unwrap_or_else(along_x);
        // Every sample is taken, because nothing is opaque and no ray ends early.
        let picture = RenderSettings { size: [settings.picture; 2], shading: false, termination: 1.0, ..RenderSettings::default() };
        let plan = (settings.picture > 0).then(|| PicturePlan::new(&picture, &bounds, mesh.origin, field.range())).transpose()?;
        let thickness = extent.into_iter().fold(0.0, f32::max).max(f32::MIN_POSITIVE);
        let slice =
            SliceSettings { size: [settings.slice, 0], thickness: Some(f64::from(thickness) * THICKNESS), ..SliceSettings::default() };
        let voxels = (settings.slice > 0).then(|| slice.voxels(bounds.lo, bounds.hi, [0.0; 3])).transpose()?;
        let samples = plan.as_ref().map(|plan| (Quantity::LocateSamples, samples(plan, &bounds, settings.points as usize)));
        let points = [(Quantity::LocateRandom, random), (Quantity::LocateCoherent, coherent)].into_iter().chain(samples).collect();
        Ok(Self { gpu, name, mesh, device, topology, load, moved, points, field, plan, voxels })
    }

    /// Centre of a voxel of the slice, given by its index.
    pub(super) fn centre(&self, voxel: usize) -> [f32; 3] {
        let Some(voxels) = &self.voxels else { return [f32::NAN; 3] };
        let (row, at) = (voxels.size[0].max(1), voxel as u32);
        voxels.centre([at % row, at / row, 0])
    }

    /// Draws the field; `None` if the structure cannot.
    pub(super) fn render(&self, structure: &Structure) -> Result<Option<Rendered>> {
        let Some(plan) = &self.plan else { return Ok(None) };
        let field = (self.field.values.as_slice(), On::Points);
        match structure {
            Structure::Octree(tree) => query::render(tree, plan, field, None, SILENT).map(Some),
            Structure::Lbvh(lbvh) => lbvh.render(plan, field, None, SILENT).map(Some),
            Structure::Rays(_) => Ok(None),
        }
    }

    /// Slices the mesh through its middle; `None` if the structure cannot.
    pub(super) fn slice(&self, structure: &Structure, sink: &mut dyn FnMut(Band) -> Result<()>) -> Result<Option<Sliced>> {
        let Some(voxels) = &self.voxels else { return Ok(None) };
        let field = Some((self.field.values.as_slice(), On::Points));
        match structure {
            Structure::Octree(tree) => query::slice(tree, field, voxels, Extrapolate::Nearest, SILENT, sink).map(Some),
            Structure::Lbvh(lbvh) => lbvh.slice(field, voxels, Extrapolate::Nearest, SILENT, sink).map(Some),
            Structure::Rays(_) => Ok(None),
        }
    }
}

/// Samples within the bounds of some of a picture's rays, in blocks of 8 × 8 rays that are spread over the picture;
/// front to back within each block.
fn samples(plan: &PicturePlan, bounds: &Bounds, most: usize) -> Vec<[f32; 3]> {
    let across = plan.size[0].div_ceil(8);
    let blocks = across * plan.size[1].div_ceil(8);
    let steps = (2.0 * bounds.diagonal() / f64::from(plan.step)) as u32;
    let in_bounds = |p: &[f32; 3]| (0..3).all(|c| bounds.lo[c] <= p[c] && p[c] <= bounds.hi[c]);
    // The order of the blocks covers the whole picture early.
    let mut order: Vec<u32> = (0..blocks).collect();
    order.sort_by_key(|b| b.wrapping_mul(2_654_435_761));
    let block = |b: u32| {
        let corner = [8 * (b % across), 8 * (b / across)];
        let rays: Vec<_> = (0..64).map(|i| plan.rays.ray(corner[0] + i % 8, corner[1] + i / 8)).collect();
        let at = move |k: u32| (k as f32 + 0.5) * plan.step;
        let point = move |(from, direction): &([f32; 3], [f32; 3]), t: f32| [0, 1, 2].map(|c| from[c] + direction[c] * t);
        (0..steps).flat_map(move |k| rays.iter().map(|ray| point(ray, at(k))).collect::<Vec<_>>()).filter(in_bounds)
    };
    order.into_iter().flat_map(block).take(most).collect()
}

/// Six times the volume of a tetrahedron with these corners.
pub(super) fn volume(p: [[f64; 3]; 4]) -> f64 {
    let [a, b, c] = [1, 2, 3].map(|i| glam::DVec3::from_array(p[i]) - glam::DVec3::from_array(p[0]));
    a.cross(b).dot(c).abs()
}

/// The corners of every valid tetrahedron.
pub(super) fn corners(mesh: &Mesh) -> impl Iterator<Item = [[f64; 3]; 4]> {
    let valid = (0u32..).zip(&mesh.tets).filter(|&(t, _)| fault_of(mesh, t).is_none());
    valid.map(|(_, ids)| ids.map(|id| mesh.points[id as usize].map(f64::from)))
}

/// Points distributed uniformly over the volume of a mesh, always the same ones.
fn random_points(mesh: &Mesh, count: u32) -> Vec<[f32; 3]> {
    let mut state = 0u64;
    // SplitMix64, of which 53 bits are used.
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
    };
    let ends: Vec<f64> = corners(mesh).scan(0.0, |sum, p| Some((*sum += volume(p), *sum).1)).collect();
    let tets: Vec<_> = corners(mesh).collect();
    let total = ends.last().copied().unwrap_or(0.0);
    let mut point = |_| {
        let at = next() * total;
        let p = tets.get(ends.partition_point(|&end| end <= at)).or(tets.last())?;
        let mut cuts = [next(), next(), next()];
        cuts.sort_by(f64::total_cmp);
        let weights = [cuts[0], cuts[1] - cuts[0], cuts[2] - cuts[1], 1.0 - cuts[2]];
        Some([0, 1, 2].map(|c| (0..4).map(|i| weights[i] * p[i][c]).sum::<f64>() as f32))
    };
    (0..count).map_while(&mut point).collect()
}
