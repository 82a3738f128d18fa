//! Queries recorded after a [`Frame`]: points in sorted order and all their owners, values at the located points,
//! slicing, a picture, and overlap with a second mesh.

use super::Frame;
use olbvh::build::{BadCells, DeviceMesh, MeshView, Tree, cmd_ranges, range_bytes};
use olbvh::gpu::{Arena, Buffer, BufferRef, Gpu, Recorder};
use olbvh::mesh::{Bounds, Mesh, On};
use olbvh::options::{Assign, BuildOptions, Lists};
use olbvh::query::{
    LocateMethod, LocateOptions, LocateOutput, OverlapMemory, OwnersMemory, PairMemory, PointInput, PointOrder, RenderInput, RenderMemory,
    Rounds, Scene, SliceInput, SliceMemory, Visibility, cmd_count_owners, cmd_count_pairs, cmd_interpolate, cmd_list_owners,
    cmd_list_pairs, cmd_overlap, cmd_render, cmd_slice, cmd_sort_points,
};
use olbvh::render::{PicturePlan, RenderSettings, TransferFunction};
use olbvh::slicing::{Extrapolate, Rows, VoxelGrid};

/// The memory of the queries of a frame, and their input.
pub struct Queries {
    pub points: PointInput,
    pub order: PointOrder,
    pub owners: OwnersMemory,
    pub owner_lists: BufferRef,
    located: LocateOutput,
    values: BufferRef,
    pub voxels: VoxelGrid,
    pub rows: Rows,
    pub slice: SliceMemory,
    pub other: DeviceMesh,
    pub other_tree: Tree,
    pub sets: OverlapMemory,
    pub pairs: PairMemory,
    pub found: BufferRef,
    pub plan: PicturePlan,
    pub normals: Vec<[f32; 3]>,
    pub picture: RenderMemory,
    pub memory: Buffer,
    field: Buffer,
    ranges: BufferRef,
    /// View, transfer function, values that it shows, and normals.
    drawn: [Buffer; 4],
    scene: Scene,
}

impl Queries {
    /// Queries after `frame`, whose mesh has the values `field` on its points, with room for `room` pairs.
    pub fn new(gpu: &Gpu, frame: &Frame, field: &[f32], other: &Mesh, room: u64) -> Self {
        let scene = Scene::recorded(MeshView { input: frame.input, arrays: frame.arrays }, frame.tree);
        let other = DeviceMesh::upload(gpu, other, BadCells::Skip).unwrap();
        // Pairs are found in lists, and each once in lists of `Aabb`.
        let options = BuildOptions { lists: Lists::All, assign: Assign::Aabb, ..BuildOptions::default() };
        let other_tree = Tree::build(gpu, &other, &options).unwrap();
        let axis = |c: usize, x: f32| [0, 1, 2].map(|k| if k == c { x } else { 0.0 });
        let voxels = VoxelGrid {
            origin: [-1.0; 3],
            next_voxel: axis(0, 0.3),
            next_row: axis(1, 0.3),
            next_layer: axis(2, 0.8),
            half: [axis(0, 0.15), axis(1, 0.15), axis(2, 0.4)],
            size: [37, 29],
            layers: 9,
        };
        let rows = Rows { layer: 0, first: 0, count: 29 * 9 };
        let plan = plan(field);
        let normals = vec![[0.6, 0.0, 0.7]; field.len()];
        let carve = |a: &mut Arena| {
            let slice = SliceMemory::carve(a, [37, 29], rows.count)?;
            let sets = OverlapMemory::carve(a, &scene, &Scene::of(&other_tree))?;
            let pairs = PairMemory::carve(gpu, a, scene.mesh.input.tets)?;
            let owners = OwnersMemory::carve(gpu, a, frame.points.count)?;
            let picture = RenderMemory::carve(a, plan.size, Some(&frame.tree.capacity))?;
            let (ranges, values) = (a.take(range_bytes(frame.tree.capacity.nodes))?, a.words(u64::from(frame.points.count))?);
            let order = PointOrder::carve(gpu, a, frame.points.count)?;
            Ok((slice, sets, pairs, a.take(8 * room)?, owners, a.take(4 * room)?, picture, (ranges, values, order)))
        };
        let (memory, (slice, sets, pairs, found, owners, owner_lists, picture, rest)) =
            Arena::reserve(gpu, "olbvh.test.queries", carve).unwrap();
        let (ranges, values, order) = rest;
        let field = gpu.upload("olbvh.test.field", field).unwrap();
        let points = PointInput { order: Some(order.order), ..frame.points };
        let drawn = [
            gpu.upload("olbvh.test.view", &[plan.view()]).unwrap(),
            gpu.upload("olbvh.test.table", &plan.table).unwrap(),
            // One range more than there are, which shows nothing.
            gpu.upload("olbvh.test.drawn", &[&plan.visible_values[..], &[[f32::INFINITY; 2]]].concat()).unwrap(),
            gpu.upload("olbvh.test.normals", &normals).unwrap(),
        ];
        Self {
            points,
            order,
            owners,
            owner_lists,
            located: frame.output,
            values,
            voxels,
            rows,
            slice,
            other,
            other_tree,
            sets,
            pairs,
            found,
            plan,
            normals,
            picture,
            memory,
            field,
            ranges,
            drawn,
            scene,
        }
    }

    pub fn record(&self, r: &mut Recorder<'_>) -> olbvh::Result<()> {
        cmd_sort_points(r, self.scene.tree.grid, &self.points, &self.order)?;
        r.barrier("sort_points → locate");
        let options = LocateOptions { method: LocateMethod::Sorted, ..LocateOptions::default() };
        cmd_count_owners(r, &self.scene, &self.points, &self.owners, &options)?;
        cmd_list_owners(r, &self.scene, &self.points, &self.owners, self.owner_lists)?;
        let count = self.points.count;
        cmd_interpolate(r, &self.scene, (self.field.all(), On::Points), 1, &self.located, (self.values, count))?;
        let field = Some((self.field.all(), On::Points));
        let input = SliceInput { voxels: &self.voxels, rows: self.rows, field, extrapolate: Extrapolate::Nearest };
        cmd_slice(r, &self.scene, &input, &self.slice, Rounds::begin(2))?;
        let field = (self.field.all(), On::Points);
        cmd_ranges(r, &self.scene.mesh, &self.scene.tree, field, self.ranges)?;
        let [view, table, values, normals] = self.drawn.each_ref().map(Buffer::all);
        let visibility = Some(Visibility { ranges: self.ranges, values, count: self.plan.visible_values.len() as u32 + 1 });
        let input = RenderInput { normals: Some(normals), visibility, ..RenderInput::of(&self.plan, view, table, field) };
        cmd_render(r, &self.scene, &input, &self.picture, Rounds::begin(2))?;
        let other = Scene::of(&self.other_tree);
        cmd_overlap(r, &self.scene, &other, &self.sets, Rounds::begin(4))?;
        cmd_count_pairs(r, &self.scene, &other, &self.pairs, Rounds::begin(8))?;
        cmd_list_pairs(r, &self.scene, &other, &self.pairs, self.found, Rounds::begin(8))
    }
}

/// The plan of a small picture of values in the middle of their range, seen from farther away than the meshes move.
fn plan(values: &[f32]) -> PicturePlan {
    let transfer = TransferFunction::default().with_opacity(vec![(0.0, 0.0), (0.4, 0.0), (0.5, 0.3), (0.6, 0.0), (1.0, 0.0)]).unwrap();
    let settings = RenderSettings { size: [37, 30], transfer, ..RenderSettings::default() };
    let range = values.iter().fold([f32::MAX, f32::MIN], |[lo, hi], &v| [lo.min(v), hi.max(v)]);
    PicturePlan::new(&settings, &Bounds { lo: [-8.0; 3], hi: [10.0; 3] }, [0.0; 3], Some(range)).unwrap()
}
