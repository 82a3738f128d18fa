//! Recording functions refuse parts of buffers that are too small for what is read from them or written to them.

use crate::submit::submit;
use olbvh::build::{BadCells, DeviceMesh, Tree, cmd_ranges, range_bytes};
use olbvh::error::{Error, Result};
use olbvh::gpu::{Arena, BufferRef, DeviceClass, Gpu, GpuOptions, Recorder};
use olbvh::layout::ViewUniforms;
use olbvh::mesh::{On, kuhn};
use olbvh::options::{BuildOptions, Lists};
use olbvh::primitives::{Count, SortScratch, cmd_sort_pairs};
use olbvh::query::{
    LocateMethod, LocateOptions, LocateOutput, NearestMemory, OverlapMemory, OwnersMemory, PairMemory, PointInput, PointOrder, RenderInput,
    RenderMemory, Rounds, Scene, SliceInput, SliceMemory, Visibility, cmd_count_owners, cmd_count_pairs, cmd_depths, cmd_interpolate,
    cmd_list_owners, cmd_list_pairs, cmd_locate, cmd_nearest, cmd_overlap, cmd_render, cmd_slice, cmd_sort_points, cmd_visible,
    visible_bytes,
};
use olbvh::render::TABLE_SIZE;
use olbvh::slicing::{Extrapolate, Rows, VoxelGrid};

fn refused(result: Result<()>, what: &str) {
    let Err(Error::Invalid(text)) = result else { panic!("{what}: {result:?}") };
    assert!(text.contains(&format!("{what} in a part of")), "{what}: {text}");
}

fn too_few_rounds(result: &Result<()>) {
    assert!(matches!(result, Err(Error::Invalid(text)) if text.contains("begins with no rounds")), "{result:?}");
}

fn less(part: BufferRef) -> BufferRef {
    part.part(0, part.size() - 1)
}

/// A mesh, its tree, and memory of which parts are taken.
struct Lab {
    gpu: Gpu,
    device: DeviceMesh,
    tree: Tree,
    memory: olbvh::gpu::Buffer,
}

impl Lab {
    fn new() -> Self {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap();
        let device = DeviceMesh::upload(&gpu, &kuhn([3; 3]).unwrap(), BadCells::Reject).unwrap();
        let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
        let memory = gpu.buffer("olbvh.test.parts", 1 << 20).unwrap();
        Self { gpu, device, tree, memory }
    }

    fn part(&self, bytes: u64) -> BufferRef {
        self.memory.all().part(0, bytes)
    }

    /// Records without a command buffer.
    fn rehearse(&self, record: impl FnOnce(&mut Recorder<'_>) -> Result<()>) -> Result<()> {
        record(&mut Recorder::rehearse(&self.gpu))
    }
}

#[test]
fn points_and_their_answers() {
    let lab = Lab::new();
    let scene = Scene::of(&lab.tree);
    let count = 100;
    let n = u64::from(count);
    // The last point ends before the next one would begin.
    let stride = 5;
    let input =
        PointInput { points: lab.part(4 * (5 * 99 + 3)), stride, count, hints: Some(lab.part(4 * n)), order: Some(lab.part(4 * n)) };
    let output = LocateOutput { owners: lab.part(4 * n), barycentrics: lab.part(16 * n) };
    let locate = |input: PointInput, output: LocateOutput| {
        use LocateMethod::{Descent, Runs, Sorted, SortedRuns, Traversal};
        [Descent, Runs, Sorted, SortedRuns, Traversal(8)].map(|method| {
            let options = LocateOptions { method, ..LocateOptions::default() };
            lab.rehearse(|r| cmd_locate(r, &scene, &input, &output, &options))
        })
    };
    let each = |results: [Result<()>; 5], what: &str| results.into_iter().for_each(|result| refused(result, what));
    locate(input, output).into_iter().for_each(Result::unwrap);
    each(locate(PointInput { points: less(input.points), ..input }, output), "points");
    each(locate(PointInput { hints: input.hints.map(less), ..input }, output), "hints");
    each(locate(PointInput { order: input.order.map(less), ..input }, output), "an order of points");
    each(locate(input, LocateOutput { owners: less(output.owners), ..output }), "owners");
    each(locate(input, LocateOutput { barycentrics: less(output.barycentrics), ..output }), "barycentrics");
    let none = PointInput { points: lab.part(0), count: 0, hints: Some(lab.part(0)), ..input };
    locate(none, LocateOutput { owners: lab.part(0), barycentrics: lab.part(0) }).into_iter().for_each(Result::unwrap);

    let sort = |input: PointInput, room: u32| {
        let order = PointOrder::carve(&lab.gpu, &mut Arena::new(lab.memory.all()), room).unwrap();
        lab.rehearse(|r| cmd_sort_points(r, lab.tree.memory().grid, &input, &order))
    };
    sort(input, count).unwrap();
    refused(sort(PointInput { points: less(input.points), ..input }, count), "points");
    refused(sort(input, count - 1), "an order of points");

    let owners = |room: u32| {
        let memory = OwnersMemory::carve(&lab.gpu, &mut Arena::new(lab.memory.all()), room).unwrap();
        let count = |r: &mut Recorder<'_>| cmd_count_owners(r, &scene, &input, &memory, &LocateOptions::default());
        [lab.rehearse(count), lab.rehearse(|r| cmd_list_owners(r, &scene, &input, &memory, lab.part(4)))]
    };
    owners(count).into_iter().for_each(Result::unwrap);
    owners(count - 1).into_iter().for_each(|result| refused(result, "owners"));

    let memory = NearestMemory::carve(&mut Arena::new(lab.memory.all()), count).unwrap();
    let near = |input, memory, rounds| lab.rehearse(|r| cmd_nearest(r, &scene, &input, 1.0, &memory, rounds));
    near(input, memory, Rounds::begin(1)).unwrap();
    too_few_rounds(&near(input, memory, Rounds::begin(0)));
    refused(near(PointInput { points: less(input.points), ..input }, memory, Rounds::begin(1)), "points");
    refused(near(input, NearestMemory { states: less(memory.states), ..memory }, Rounds::begin(1)), "states of points");
    refused(near(input, NearestMemory { barycentrics: less(memory.barycentrics), ..memory }, Rounds::begin(1)), "barycentrics");
}

#[test]
fn fields_and_their_values() {
    let lab = Lab::new();
    let (scene, view, tree) = (Scene::of(&lab.tree), lab.device.view(), lab.tree.memory());
    let (points, tets) = (u64::from(view.input.points), u64::from(view.input.tets));
    let (count, nodes) = (100, tree.capacity.nodes);
    let (located, values) = (LocateOutput { owners: lab.part(400), barycentrics: lab.part(1600) }, lab.part(400));
    for (on, field) in [(On::Points, lab.part(4 * points)), (On::Cells, lab.part(4 * tets))] {
        let interpolate = |field, located, values| lab.rehearse(|r| cmd_interpolate(r, &scene, (field, on), 1, &located, (values, count)));
        interpolate(field, located, values).unwrap();
        refused(interpolate(less(field), located, values), "a field");
        refused(interpolate(field, LocateOutput { owners: less(located.owners), ..located }, values), "owners");
        refused(interpolate(field, LocateOutput { barycentrics: less(located.barycentrics), ..located }, values), "barycentrics");
        refused(interpolate(field, located, less(values)), "values");
        let several = |many| lab.rehearse(|r| cmd_interpolate(r, &scene, (field, on), many, &located, (values, count)));
        assert!(matches!(several(0), Err(olbvh::Error::Invalid(_))));
        refused(several(2), "a field");
        assert!(matches!(several(u32::MAX), Err(olbvh::Error::TooLarge(_))));

        let ranges = lab.part(range_bytes(nodes));
        let gather = |field, ranges| lab.rehearse(|r| cmd_ranges(r, &view, tree, (field, on), ranges));
        gather(field, ranges).unwrap();
        refused(gather(less(field), ranges), "a field");
        refused(gather(field, less(ranges)), "ranges");
    }
    let (ranges, shown, marks) = (lab.part(range_bytes(nodes)), lab.part(24), lab.part(visible_bytes(nodes)));
    let mark = |ranges, shown, marks| lab.rehearse(|r| cmd_visible(r, tree, ranges, (shown, 3), marks));
    mark(ranges, shown, marks).unwrap();
    refused(mark(less(ranges), shown, marks), "ranges");
    refused(mark(ranges, less(shown), marks), "visible values");
    refused(mark(ranges, shown, less(marks)), "marks");
}

#[test]
fn pictures_and_slices() {
    let lab = Lab::new();
    let (scene, points) = (Scene::of(&lab.tree), u64::from(lab.device.input().points));
    let memory = RenderMemory::carve(&mut Arena::new(lab.memory.all()), [16; 2], None).unwrap();
    let field = (lab.part(4 * points), On::Points);
    let short = (less(field.0), On::Points);
    let (view, table) = (lab.part(size_of::<ViewUniforms>() as u64), lab.part(16 * TABLE_SIZE as u64));
    let (normals, depth) = (Some(lab.part(12 * points)), Some(lab.part(4 * 16 * 16)));
    let input = RenderInput { size: [16; 2], view, iso: false, table, field, normals, depth, visibility: None, row: 0 };
    let draw = |input: RenderInput| lab.rehearse(|r| cmd_render(r, &scene, &input, &memory, Rounds::begin(1)));
    draw(input).unwrap();
    refused(draw(RenderInput { view: less(view), ..input }), "a view");
    refused(draw(RenderInput { table: less(table), ..input }), "a transfer function");
    refused(draw(RenderInput { field: short, ..input }), "a field");
    refused(draw(RenderInput { normals: normals.map(less), ..input }), "normals");
    refused(draw(RenderInput { depth: depth.map(less), ..input }), "a depth buffer");
    let skipping = RenderInput { visibility: Some(Visibility { ranges: lab.part(64), values: lab.part(8), count: 1 }), ..input };
    let without = draw(skipping);
    assert!(matches!(&without, Err(Error::Invalid(text)) if text.contains("memory without room for")), "{without:?}");
    let depths = |to| lab.rehearse(|r| cmd_depths(r, &input, &memory, to));
    depths(lab.part(4 * 16 * 16)).unwrap();
    refused(depths(lab.part(4 * 16 * 16 - 1)), "a depth buffer");

    let axis = |c: usize| [0, 1, 2].map(|k| if k == c { 0.4 } else { 0.0 });
    let half = [axis(0), axis(1), axis(2)];
    let voxels = VoxelGrid { origin: [0.0; 3], next_voxel: axis(0), next_row: axis(1), next_layer: axis(2), half, size: [5, 5], layers: 1 };
    let memory = SliceMemory::carve(&mut Arena::new(lab.memory.all()), [5, 5], 5).unwrap();
    let slice = |field, rounds| {
        let rows = Rows { layer: 0, first: 0, count: 5 };
        let input = SliceInput { voxels: &voxels, rows, field: Some(field), extrapolate: Extrapolate::Nearest };
        lab.rehearse(|r| cmd_slice(r, &scene, &input, &memory, rounds))
    };
    slice(field, Rounds::begin(1)).unwrap();
    refused(slice(short, Rounds::begin(1)), "a field");
    too_few_rounds(&slice(field, Rounds::begin(0)));
    slice(field, Rounds::resume(0)).unwrap();
}

/// What a beginning without rounds would leave to a resumed search, nothing has written.
#[test]
fn searches_begin_with_a_round() {
    let lab = Lab::new();
    let scene = Scene::of(&lab.tree);
    let memory = OverlapMemory::carve(&mut Arena::new(lab.memory.all()), &scene, &scene).unwrap();
    too_few_rounds(&lab.rehearse(|r| cmd_overlap(r, &scene, &scene, &memory, Rounds::begin(0))));
    lab.rehearse(|r| cmd_overlap(r, &scene, &scene, &memory, Rounds::begin(1))).unwrap();
    let memory = PairMemory::carve(&lab.gpu, &mut Arena::new(lab.memory.all()), lab.device.input().tets).unwrap();
    too_few_rounds(&lab.rehearse(|r| cmd_list_pairs(r, &scene, &scene, &memory, lab.part(64), Rounds::begin(0))));
}

/// Overlaps take memory for these two meshes, in this order.
#[test]
fn overlaps() {
    let lab = Lab::new();
    let scene = Scene::of(&lab.tree);
    let with = |points: u32, tets: u32| {
        let mut more = scene;
        (more.mesh.input.points, more.mesh.input.tets) = (scene.mesh.input.points + points, scene.mesh.input.tets + tets);
        more
    };
    let memory = OverlapMemory::carve(&mut Arena::new(lab.memory.all()), &scene, &scene).unwrap();
    let overlap = |a: &Scene, b: &Scene| lab.rehearse(|r| cmd_overlap(r, a, b, &memory, Rounds::begin(1)));
    overlap(&scene, &scene).unwrap();
    refused(overlap(&with(1, 0), &scene), "places of vertices");
    refused(overlap(&scene, &with(1, 0)), "places of vertices");
    refused(overlap(&with(0, 1), &scene), "states of tetrahedra");
    refused(overlap(&scene, &with(0, 32)), "tetrahedra around vertices");

    let whole = Tree::build(&lab.gpu, &lab.device, &BuildOptions { lists: Lists::All, ..BuildOptions::default() }).unwrap();
    let (whole, more) = (Scene::of(&whole), with(0, 1));
    let memory = PairMemory::carve(&lab.gpu, &mut Arena::new(lab.memory.all()), scene.mesh.input.tets).unwrap();
    let count = |a: &Scene| lab.rehearse(|r| cmd_count_pairs(r, a, &whole, &memory, Rounds::begin(1)));
    let list = |a: &Scene| lab.rehearse(|r| cmd_list_pairs(r, a, &whole, &memory, lab.part(64), Rounds::begin(1)));
    count(&scene).and_then(|()| list(&scene)).unwrap();
    [count(&more), list(&more)].into_iter().for_each(|result| refused(result, "states of tetrahedra"));
}

/// Keys have 32 bits, so that a sort by more of them sorts by all, in the place that it says.
#[test]
fn a_sort_takes_no_more_bits_than_there_are() {
    for row in [DeviceClass::Portable, DeviceClass::Cpu] {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap();
        let gpu = gpu.with_target(row.target(&gpu.report().room)).unwrap();
        let n = 5000;
        let keys: Vec<u32> = (0..n).map(|i: u32| i.wrapping_mul(2_654_435_761)).collect();
        let (key_buffer, id_buffer) = (gpu.upload("olbvh.test.keys", &keys).unwrap(), gpu.upload("olbvh.test.ids", &keys).unwrap());
        let (_memory, scratch) = Arena::reserve(&gpu, "olbvh.test.sort", |a| SortScratch::carve(&gpu, a, n, 40)).unwrap();
        let record = |r: &mut Recorder<'_>| cmd_sort_pairs(r, key_buffer.all(), id_buffer.all(), 40, Count::host(n), &scratch);
        submit(&gpu, "olbvh.test.sort", record).unwrap();
        let mut sorted = keys;
        sorted.sort_unstable();
        for buffer in [&key_buffer, &id_buffer] {
            assert!(gpu.download::<u32>(buffer, buffer.all()).unwrap() == sorted, "{row}");
        }
    }
}
