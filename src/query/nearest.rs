//! The place of the mesh's surface that is closest to each point, wherever the point lies.

use super::{PointInput, PointOrder, Progress, Rounds, Scene, cmd_sort_points, until_done};
use crate::build::Tree;
use crate::error::Result;
use crate::gpu::{Arena, BufferRef, Groups, Recorder};
use crate::grid::{CellRange, canonical};
use crate::kernels::{Nearest as NearestKernel, NearestPlaces, NearestPlacesSpec, NearestSpec};
use crate::layout::{NONE, NearState};
use crate::options::POINT_CHUNK;
use crate::reference::nearest::distance;
use crate::times::StageTimes;

/// Points of one submission. Each may take thousands of tests, so they are fewer than in other queries.
const AT_ONCE: usize = POINT_CHUNK / 8;

/// Answers and scratch memory: 32 bytes per point.
#[derive(Clone, Copy, Debug)]
pub struct NearestMemory {
    /// [`NearState`] per point: the tetrahedron with the closest place, and its squared distance.
    pub states: BufferRef,
    /// Four floats per point: barycentric coordinates of the closest place in that tetrahedron; zeros without one.
    pub barycentrics: BufferRef,
    /// One word: the number of points that need another round.
    pub unfinished: BufferRef,
}

impl NearestMemory {
    /// Carves the memory for `count` points.
    ///
    /// # Errors
    /// [`crate::Error::Invalid`] if the arena is too small.
    pub fn carve(arena: &mut Arena, count: u32) -> Result<Self> {
        let n = u64::from(count);
        Ok(Self { states: arena.take(size_of::<NearState>() as u64 * n)?, barycentrics: arena.take(16 * n)?, unfinished: arena.words(1)? })
    }
}

/// Records the search for the place of the surface that is closest to each point, at most `within` away, in units of the
/// mesh, and at most 1 / [`crate::layout::Grid::scale`], which is between half of the mesh's largest extent and all of it:
/// of the faces without neighbour the one with the smallest squared distance (ties: that of the tetrahedron with the lowest
/// id). Hints are not used. Points that follow each other closely are found faster: give those in no order
/// [`PointInput::order`].
///
/// Each round tests about a thousand nodes and tetrahedra per point and passes over points that are finished; [`nearest`]
/// searches for 131,072 points at a time, so that no dispatch takes long. Points close to the surface take one or two rounds,
/// and those deep inside, with much of the surface about as far away, many: in a grid of 32×32×32 cubes, 27 for 2,000 points
/// anywhere, and 54 around its middle. A search that is not finished has no coordinates yet, and its tetrahedron need not be
/// the closest, so read [`NearestMemory::unfinished`], or keep `within` short.
///
/// Entry: mesh, tree and points are read by compute shaders. First use of `memory`: a transfer write of `unfinished`, and
/// compute reads and writes. Last use: compute reads and writes; no barrier before or after.
///
/// # Errors
/// [`crate::Error::Invalid`] if a part is too small, or for a beginning without rounds.
pub fn cmd_nearest(
    r: &mut Recorder<'_>,
    scene: &Scene,
    input: &PointInput,
    within: f32,
    memory: &NearestMemory,
    rounds: Rounds,
) -> Result<()> {
    cmd_nearest_in(r, scene, input, (within, None), memory, rounds)
}

/// [`cmd_nearest`]; a block of a mesh is searched in these cells, whole leaves of its tree, only.
fn cmd_nearest_in(
    r: &mut Recorder<'_>,
    scene: &Scene,
    input: &PointInput,
    reach: (f32, Option<CellRange>),
    memory: &NearestMemory,
    rounds: Rounds,
) -> Result<()> {
    rounds.check()?;
    input.check()?;
    let n = u64::from(input.count);
    memory.states.check(size_of::<NearState>() as u64 * n, "states of points")?;
    memory.barycentrics.check(16 * n, "barycentrics")?;
    record(r, scene, input, reach, memory, rounds, NearestSpec::default().budget)
}

/// Records the rounds. In each, a point has `budget` nodes and tetrahedra, which must exceed the level of the tree.
fn record(
    r: &mut Recorder<'_>,
    scene: &Scene,
    input: &PointInput,
    (within, cell_range): (f32, Option<CellRange>),
    memory: &NearestMemory,
    rounds: Rounds,
    budget: u32,
) -> Result<()> {
    let (tree, mesh) = (&scene.tree, &scene.mesh);
    let PointInput { points, stride, count, .. } = *input;
    let NearestMemory { states, barycentrics, unfinished } = *memory;
    let (cells, vertices, neighbours) = (mesh.input.cells, mesh.arrays.vertices, mesh.arrays.neighbours);
    let [first_cell, last_cell] = cell_range.unwrap_or(CellRange::WHOLE).words();
    let search = NearestKernel {
        grid: tree.grid,
        masks: tree.masks,
        co: tree.co,
        po: tree.po,
        p: tree.p,
        flags: tree.flags,
        cells,
        vertices,
        neighbours,
        points,
        states,
        order: input.order.unwrap_or_else(|| r.gpu().nothing()),
        unfinished,
        count,
        stride,
        // Not a number finds nothing, like a negative distance: drivers may compare it as they like.
        within: if within >= 0.0 { canonical(within) } else { -1.0 },
        first_cell,
        last_cell,
    };
    let (workgroup, ordered) = (r.gpu().target().query, u32::from(input.order.is_some()));
    let groups = Groups::Count(count.div_ceil(workgroup));
    for round in 0..rounds.count {
        if round > 0 {
            r.barrier("nearest → nearest.clear");
        }
        r.fill(unfinished, 0);
        r.barrier("nearest.clear → nearest");
        let fresh = u32::from(round == 0 && !rounds.resume);
        let spec = NearestSpec { workgroup, fresh, budget, ordered, ..Default::default() };
        r.stage("query.nearest", |r| r.dispatch(&search, spec, groups))?;
    }
    if rounds.count > 0 {
        r.barrier("nearest → nearest.places");
    }
    let places = NearestPlaces { grid: tree.grid, cells, vertices, neighbours, points, states, barycentrics, count, stride };
    let spec = NearestPlacesSpec { workgroup, ..Default::default() };
    r.stage("query.nearest_places", |r| r.dispatch(&places, spec, groups))
}

/// Closest places of the surface, in host memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Nearest {
    /// The tetrahedron with the closest place, or `u32::MAX`.
    pub owners: Vec<u32>,
    /// Barycentric coordinates of the place, in the order of the tetrahedron's vertices.
    pub barycentrics: Vec<[f32; 4]>,
    /// Squared distances, as [`NearState::square`]; infinite where nothing was found.
    pub squares: Vec<f32>,
    /// [`crate::layout::Grid::scale`] of the tree.
    pub scale: f32,
    /// What it took.
    pub times: StageTimes,
}

impl Nearest {
    /// Distances in units of the mesh; NaN where nothing was found.
    pub fn distances(&self) -> Vec<f32> {
        let found = self.owners.iter().zip(&self.squares);
        found.map(|(&owner, &square)| if owner == NONE { f32::NAN } else { distance(square, self.scale) }).collect()
    }
}

/// Finds the place of the surface that is closest to each point, at most `within` away ([`cmd_nearest`]). Points are
/// relative to the mesh's origin. `report` receives the number of points done and their total.
///
/// # Errors
/// [`crate::Error::Memory`], or a failed Vulkan call.
pub fn nearest(tree: &Tree, points: &[[f32; 3]], within: f32, report: Progress<'_>) -> Result<Nearest> {
    nearest_in(tree, points, within, None, report)
}

/// [`nearest`]; a block of a mesh is searched in these cells, whole leaves of its tree, only.
pub(crate) fn nearest_in(tree: &Tree, points: &[[f32; 3]], within: f32, cells: Option<CellRange>, report: Progress<'_>) -> Result<Nearest> {
    let (gpu, scene, scale) = (tree.gpu(), Scene::of(tree), tree.grid().scale);
    let most = points.len().min(AT_ONCE) as u32;
    let (buffer, memory) = Arena::reserve(gpu, "olbvh.query.nearest", |a| NearestMemory::carve(a, most))?;
    let (_memory, sort) = Arena::reserve(gpu, "olbvh.query.order", |a| PointOrder::carve(gpu, a, most))?;
    let mut all = Nearest { scale, ..Nearest::default() };
    for chunk in points.chunks(AT_ONCE) {
        let asked = gpu.upload("olbvh.query.points", chunk)?;
        let count = chunk.len() as u32;
        let input = PointInput { points: asked.all(), stride: 3, count, hints: None, order: Some(sort.order) };
        let record = |r: &mut Recorder<'_>, rounds: Rounds| {
            if !rounds.resume {
                cmd_sort_points(r, scene.tree.grid, &input, &sort)?;
                r.barrier("sort_points → nearest");
            }
            cmd_nearest_in(r, &scene, &input, (within, cells), &memory, rounds)
        };
        until_done(gpu, "olbvh.query.nearest", 1, &mut all.times, record, || {
            let unfinished: u32 = gpu.download_one(&buffer, memory.unfinished)?;
            report(all.owners.len() as u64 + u64::from(count - unfinished.min(count)), points.len() as u64)?;
            Ok((unfinished == 0).then_some(()))
        })?;
        let states: Vec<NearState> = gpu.download(&buffer, memory.states.part(0, size_of::<NearState>() as u64 * u64::from(count)))?;
        all.owners.extend(states.iter().map(|state| state.owner));
        all.squares.extend(states.iter().map(|state| state.square));
        all.barycentrics.extend(gpu.download::<[f32; 4]>(&buffer, memory.barycentrics.part(0, 16 * u64::from(count)))?);
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{BadCells, DeviceMesh};
    use crate::gpu::{Gpu, GpuOptions};
    use crate::grid::per_axis;
    use crate::mesh::kuhn_jittered;
    use crate::options::BuildOptions;
    use crate::reference::boundary::topology;
    use crate::reference::nearest::Surface;

    /// Wherever a round ends, the next one goes on there, also where what was found since excludes that leaf.
    #[test]
    fn rounds_of_any_length_find_the_same() {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap();
        let mesh = kuhn_jittered([6, 5, 4], 0.3, 5).unwrap();
        let topology = topology(&mesh).unwrap();
        let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
        let points: Vec<[f32; 3]> = (0..2000u32)
            .map(|i| per_axis(|c| i.wrapping_mul([0x9e37_79b9, 0x7f4a_7c15, 0xf39c_c060][c]) as f32 / 4_294_967_296.0 * 9.0 - 1.5))
            .collect();
        let input = gpu.upload("olbvh.test.points", &points).unwrap();
        for level in [1, 3, 5] {
            let options = BuildOptions { level: Some(level), ..BuildOptions::default() };
            let tree = Tree::build(&gpu, &device, &options).unwrap();
            let reference = crate::reference::build::build(&mesh, &topology, &options).unwrap();
            let surface = Surface::new(&mesh, &topology, &reference);
            let found = |p| surface.nearest(p, f32::INFINITY).map_or((NONE, f32::INFINITY), |(place, square)| (place.owner, square));
            let expected: Vec<_> = points.iter().map(|&p| found(p)).collect();
            let order = gpu.upload("olbvh.test.order", &(0..points.len() as u32).rev().collect::<Vec<_>>()).unwrap();
            let order = (level == 3).then(|| order.all());
            let input = PointInput { points: input.all(), stride: 3, count: points.len() as u32, hints: None, order };
            let carve = |a: &mut Arena| NearestMemory::carve(a, input.count);
            let (buffer, memory) = Arena::reserve(&gpu, "olbvh.test.nearest", carve).unwrap();
            let (scene, reach) = (Scene::of(&tree), (f32::INFINITY, None));
            for budget in [7, 8, 12, 37] {
                let mut rounds = Rounds::begin(1);
                let mut count = 0;
                while count == 0 || gpu.download_one::<u32>(&buffer, memory.unfinished).unwrap() > 0 {
                    gpu.submit("olbvh.test.nearest", |r| record(r, &scene, &input, reach, &memory, rounds, budget)).unwrap();
                    rounds = Rounds::resume(1);
                    count += 1;
                }
                let states: Vec<NearState> = gpu.download(&buffer, memory.states).unwrap();
                let wrong = (0..points.len()).filter(|&i| (states[i].owner, states[i].square) != expected[i]).count();
                assert!(wrong == 0 && count > 3, "level {level}, budget {budget}: {wrong} wrong after {count} rounds");
            }
        }
    }
}
