//! Point location (SPEC 3.1): the owner of each point, its barycentric coordinates, and values of fields there.

use super::order::{PointOrder, cmd_sort_points};
use super::{Progress, Scene, list_parts};
use crate::build::{Tree, check_components, check_points};
use crate::error::{Error, Result};
use crate::gpu::{Arena, BufferRef, DeviceKind, Gpu, Groups, Recorder};
use crate::grid::MAX_LEVEL;
use crate::kernels::{Interpolate, InterpolateSpec, Locate, LocateByTraversal, LocateByTraversalSpec, LocateSpec};
use crate::layout::constants::locate::{HINTS, ORDER};
use crate::mesh::On;
use crate::options::{POINT_CHUNK, POINT_RUN, TOLERANCE};
use crate::reference::traverse::full_stack;
use crate::times::StageTimes;

pub use crate::layout::constants::locate_by_traversal::MOST_TRAVERSED;

/// Size of the largest useful short stack: at most seven siblings per level wait on it, so it never drops a node.
const MAX_STACK: u32 = full_stack(MAX_LEVEL) as u32;

/// How the owner of a point is searched for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LocateMethod {
    /// As suits the points, with the same owners: [`locate`] takes what [`LocateMethod::suited`] names, and [`cmd_locate`]
    /// [`LocateMethod::Sorted`] if it is given an order, otherwise [`LocateMethod::Descent`].
    #[default]
    Suited,
    /// Finds the point's leaf by descent over child masks.
    Descent,
    /// Takes points in runs of [`POINT_RUN`]. Each point is first searched for around the owner of the one before it,
    /// up to a few tetrahedra away, and found by descent if it is not there. Suits points that are each near the one
    /// before. In a mesh whose tetrahedra do not overlap, the owners are those of [`LocateMethod::Descent`].
    Runs,
    /// As [`LocateMethod::Descent`], but in the order given by [`PointInput::order`], for example that of
    /// [`super::cmd_sort_points`]; [`locate`] computes this order itself. Invocations next to each other then read the
    /// same memory. Suits many points in no particular order.
    Sorted,
    /// As [`LocateMethod::Runs`], but along such an order. Suits many points in no particular order on a processor.
    SortedRuns,
    /// Finds the leaf by the paper's traversal with a short stack of this many nodes (at most 78 are used). Lists of
    /// more than [`MOST_TRAVERSED`] entries are refused.
    Traversal(u32),
}

impl LocateMethod {
    /// The method for this many points in a tree with seeds ([`crate::options::Lists::Boundary`]) over this many
    /// tetrahedra: [`LocateMethod::Descent`] if each point lies near the one before it (`in_order`) or if there are
    /// fewer than one per four tetrahedra, otherwise [`LocateMethod::Sorted`]. Both give the same owners.
    ///
    /// In a mesh of 1.5 million tetrahedra, a million random points take 0.32 ms sorted on an NVIDIA H100. Points along
    /// a Z curve take 0.13 ms, and in runs 0.30 ms: a GPU is better used if every point has an invocation.
    pub fn suited(points: usize, tets: usize, in_order: bool) -> Self {
        // Only points that are sorted together get nearer to each other.
        let few = points.min(POINT_CHUNK).saturating_mul(4) < tets;
        if in_order || few { Self::Descent } else { Self::Sorted }
    }

    /// The fastest method on this device, for an application that does not mind that the owners of points in cells that
    /// overlap may then differ between devices: as [`LocateMethod::suited`], but in runs on a processor, unless there
    /// are fewer points than one per four tetrahedra.
    pub fn fastest(gpu: &Gpu, points: usize, tets: usize, in_order: bool) -> Self {
        let processor = gpu.report().kind == DeviceKind::Cpu;
        let near = points.saturating_mul(4) >= tets;
        match Self::suited(points, tets, in_order) {
            Self::Descent if processor && in_order && near => Self::Runs,
            Self::Sorted if processor => Self::SortedRuns,
            method => method,
        }
    }

    /// Whether points are taken in the order [`PointInput::order`], which must then be given.
    pub fn is_sorted(self) -> bool {
        matches!(self, Self::Sorted | Self::SortedRuns)
    }
}

/// How points are located.
#[derive(Clone, Copy, Debug)]
pub struct LocateOptions {
    /// How far below 0 the smallest barycentric coordinate of an owner may be in a boundary leaf: a finite number, at
    /// least 0.
    pub tolerance: f32,
    /// How owners are searched for.
    pub method: LocateMethod,
}

impl Default for LocateOptions {
    fn default() -> Self {
        Self { tolerance: TOLERANCE, method: LocateMethod::Suited }
    }
}

/// Rejects a tolerance that is not a finite number of at least 0.
pub(crate) fn check_tolerance(tolerance: f32) -> Result<()> {
    if tolerance.is_finite() && tolerance >= 0.0 {
        return Ok(());
    }
    Err(Error::Invalid(format!("a tolerance of {tolerance}; it is a finite number, at least 0")))
}

/// Points in device memory.
#[derive(Clone, Copy, Debug)]
pub struct PointInput {
    /// 32-bit floats; point i starts at float `i * stride`.
    pub points: BufferRef,
    /// Floats from one point to the next, at least 3.
    pub stride: u32,
    /// Number of points.
    pub count: u32,
    /// For points that are taken in their own order, each by itself: one tetrahedron per point from which its search
    /// starts, such as its last owner, or `u32::MAX` for none; points that have moved little are found in about half the
    /// time. Only valid tetrahedra of this mesh are allowed. It may be the same part as [`LocateOutput::owners`]: a point's
    /// hint is read before its owner is written, and no other point reads it.
    pub hints: Option<BufferRef>,
    /// For methods that sort ([`LocateMethod::is_sorted`]), and for closest places: one word per place, the point that is
    /// located there; every point occurs once. Answers are stored by point, not by place.
    pub order: Option<BufferRef>,
}

impl PointInput {
    /// Rejects points that overlap or are too many, and parts that hold fewer.
    pub(crate) fn check(&self) -> Result<()> {
        check_points("points", self.count, self.stride)?;
        let Some(others) = self.count.checked_sub(1) else { return Ok(()) };
        self.points.check(4 * (u64::from(self.stride) * u64::from(others) + 3), "points")?;
        let words = 4 * u64::from(self.count);
        self.hints.map_or(Ok(()), |hints| hints.check(words, "hints"))?;
        self.order.map_or(Ok(()), |order| order.check(words, "an order of points"))
    }
}

/// Where [`cmd_locate`] writes its answers.
#[derive(Clone, Copy, Debug)]
pub struct LocateOutput {
    /// One word per point: the owner, or `u32::MAX`.
    pub owners: BufferRef,
    /// 16 bytes per point, aligned to 16: barycentric coordinates in the order of the tetrahedron's vertices; zeros
    /// without an owner.
    pub barycentrics: BufferRef,
}

impl LocateOutput {
    /// Rejects parts for the answers of fewer points.
    pub(crate) fn check(&self, count: u32) -> Result<()> {
        self.owners.check(4 * u64::from(count), "owners")?;
        self.barycentrics.check(16 * u64::from(count), "barycentrics")
    }
}

/// Records point location. Compute shaders read mesh, tree and points and write `output`; there is no barrier before or
/// after.
///
/// # Errors
/// [`Error::Invalid`] for a stride below 3, for parts of fewer points, a tolerance out of its range, or a method that sorts
/// without an order;
/// [`Error::TooLarge`] for points of more than 2^31 floats, or for lists too long for [`LocateMethod::Traversal`].
pub fn cmd_locate(r: &mut Recorder<'_>, scene: &Scene, input: &PointInput, output: &LocateOutput, options: &LocateOptions) -> Result<()> {
    let PointInput { points, stride, count, hints, order } = *input;
    let LocateOutput { owners, barycentrics } = *output;
    let tolerance = options.tolerance;
    check_tolerance(tolerance)?;
    input.check()?;
    output.check(count)?;
    let (grid, masks, co, po, p, flags) = (scene.tree.grid, scene.tree.masks, scene.tree.co, scene.tree.po, scene.tree.p, scene.tree.flags);
    let (cells, vertices, neighbours) = (scene.mesh.input.cells, scene.mesh.arrays.vertices, scene.mesh.arrays.neighbours);
    let (workgroup, lists) = (r.gpu().target().query, scene.tree.lists as u32);
    let groups = |run: u32| Groups::Count(count.div_ceil(run).div_ceil(workgroup));
    if options.method.is_sorted() && order.is_none() {
        return Err(Error::Invalid("points to be located in an order that is not given".into()));
    }
    let sorted = options.method.is_sorted() || options.method == LocateMethod::Suited;
    let in_runs = matches!(options.method, LocateMethod::Runs | LocateMethod::SortedRuns);
    let run = if in_runs { POINT_RUN } else { 1 };
    let (guide, guides) = match (order.filter(|_| sorted), hints.filter(|_| !in_runs)) {
        (Some(order), _) => (ORDER, order),
        (None, Some(hints)) => (HINTS, hints),
        (None, None) => (0, r.gpu().nothing()),
    };
    if matches!(options.method, LocateMethod::Traversal(_)) && scene.longest_leaf > MOST_TRAVERSED {
        let longest = scene.longest_leaf;
        return Err(Error::TooLarge(format!(
            "lists of up to {longest} entries; the traversal searches {MOST_TRAVERSED} at most, so locate by LocateMethod::Descent"
        )));
    }
    r.stage("query.locate", |r| {
        if let LocateMethod::Traversal(stack) = options.method {
            let arguments = LocateByTraversal {
                grid,
                masks,
                co,
                po,
                p,
                flags,
                cells,
                vertices,
                points,
                owners,
                barycentrics,
                neighbours,
                count,
                stride,
                tolerance,
            };
            let spec = LocateByTraversalSpec { workgroup, stack: stack.min(MAX_STACK), lists, ..Default::default() };
            return r.dispatch(&arguments, spec, groups(1));
        }
        let (length, parts) = list_parts(r.gpu().report().kind, scene.longest_leaf);
        for part in 0..parts {
            if part > 0 {
                r.barrier("locate.part → locate.part");
            }
            let last = u32::from(part + 1 == parts);
            let arguments = Locate {
                grid,
                masks,
                co,
                po,
                p,
                flags,
                cells,
                vertices,
                points,
                guides,
                owners,
                barycentrics,
                neighbours,
                count,
                stride,
                part,
                last,
                tolerance,
            };
            // Runs are for the first part only; the points that it leaves undecided are located one by one in later
            // parts.
            let (run, guide) = if part == 0 { (run, guide) } else { (1, 0) };
            let spec = LocateSpec { workgroup, guide, part_length: length, lists, run, ..Default::default() };
            r.dispatch(&arguments, spec, groups(run))?;
        }
        Ok(())
    })
}

/// Records the values of a field at located points. The field has `components` floats per point of the mesh or per
/// tetrahedron, such as 3 of a velocity, and `values` gets as many for each located point, NaN without an owner. Compute
/// shaders read `located`, the field and the mesh and write `values`. There is no barrier before or after: the caller
/// records one between `cmd_locate` and this function.
///
/// # Errors
/// [`Error::Invalid`] if a part is too small or there are no components, [`Error::TooLarge`] for more than 2^31 floats,
/// [`Error::Vulkan`] if the pipeline cannot be made.
pub fn cmd_interpolate(
    r: &mut Recorder<'_>,
    scene: &Scene,
    (field, on): (BufferRef, On),
    components: u32,
    located: &LocateOutput,
    (values, count): (BufferRef, u32),
) -> Result<()> {
    let floats = u64::from(components) * u64::from(count);
    if components == 0 {
        return Err(Error::Invalid("a field of no components".into()));
    }
    if floats > 1 << 31 {
        return Err(Error::TooLarge(format!("{floats} values at once; shaders number 2^31 floats at most")));
    }
    check_components((field, on), components, &scene.mesh.input)?;
    located.check(count)?;
    values.check(4 * floats, "values")?;
    let workgroup = r.gpu().target().query;
    let LocateOutput { owners, barycentrics } = *located;
    let spec = InterpolateSpec { workgroup, on_cells: u32::from(on == On::Cells), ..Default::default() };
    let arguments = Interpolate { cells: scene.mesh.input.cells, field, owners, barycentrics, values, count, components };
    r.stage("query.interpolate", |r| r.dispatch(&arguments, spec, Groups::Count(count.div_ceil(workgroup))))
}

/// The number of points, which 32 bits number.
pub(crate) fn numbered(points: usize) -> Result<u32> {
    u32::try_from(points).map_err(|_| Error::TooLarge(format!("{points} points; ask for {} at most at a time", u32::MAX)))
}

/// Most entries that one submission tests even if every point searches the longest list, unless a thousand points test
/// more: systems end submissions that take seconds.
const WORK: usize = 1 << 31;

/// Points that one submission locates.
fn points_at_once(longest_leaf: u32) -> usize {
    (WORK / (longest_leaf as usize).max(1)).clamp(1024, POINT_CHUNK)
}

/// Answers in host memory.
#[derive(Clone, Debug, Default)]
pub struct Located {
    /// Owner of each point, or `u32::MAX`.
    pub owners: Vec<u32>,
    /// Barycentric coordinates in the order of the tetrahedron's vertices.
    pub barycentrics: Vec<[f32; 4]>,
    /// Values of the given field, as many for each point as it has components; empty if none was given.
    pub values: Vec<f32>,
    /// What it took.
    pub times: StageTimes,
}

/// Locates points, whose coordinates are relative to the mesh's origin. `field` has values and says whether they belong
/// to points or tetrahedra, each of which may have several, such as the three of a velocity, next to each other. `report`
/// receives the number of points done and their total.
///
/// # Errors
/// [`Error::Memory`], a failed Vulkan call, or [`Error::Invalid`] if the field has the wrong length or the tolerance is
/// out of its range.
pub fn locate(
    tree: &Tree,
    points: &[[f32; 3]],
    field: Option<(&[f32], On)>,
    options: &LocateOptions,
    report: Progress<'_>,
) -> Result<Located> {
    let gpu = tree.gpu();
    let scene = Scene::of(tree);
    let components = field.map_or(Ok(1), |(values, on)| on.components(values, scene.mesh.input.sizes()))?;
    let field = field.map(|(values, on)| Ok((gpu.upload("olbvh.query.field", values)?, on))).transpose()?;
    let mut all = Located::default();
    let at_once = (points_at_once(scene.longest_leaf) / components).max(1);
    let most = points.len().min(at_once) as u64;
    let owners = gpu.buffer("olbvh.query.owners", 4 * most)?;
    let barycentrics = gpu.buffer("olbvh.query.barycentrics", 16 * most)?;
    let values = field.as_ref().map(|_| gpu.buffer("olbvh.query.values", 4 * components as u64 * most)).transpose()?;
    let method = match options.method {
        LocateMethod::Suited => LocateMethod::suited(points.len(), scene.mesh.input.tets as usize, false),
        method => method,
    };
    let (sorted, options) = (method.is_sorted(), &LocateOptions { method, ..*options });
    let carve = |a: &mut Arena| if sorted { PointOrder::carve(gpu, a, most as u32).map(Some) } else { Ok(None) };
    let (_memory, order) = Arena::reserve(gpu, "olbvh.query.order", carve)?;
    for chunk in points.chunks(at_once) {
        let input = gpu.upload("olbvh.query.points", chunk)?;
        let count = chunk.len() as u32;
        let n = u64::from(count);
        let input = PointInput { points: input.all(), stride: 3, count, hints: None, order: order.map(|o| o.order) };
        let output = LocateOutput { owners: owners.all().part(0, 4 * n), barycentrics: barycentrics.all().part(0, 16 * n) };
        let ((), times) = gpu.submit("olbvh.query.locate", |r| {
            if let Some(order) = &order {
                cmd_sort_points(r, scene.tree.grid, &input, order)?;
                r.barrier("sort_points → locate");
            }
            cmd_locate(r, &scene, &input, &output, options)?;
            if let (Some((field, on)), Some(values)) = (&field, &values) {
                r.barrier("locate → interpolate");
                cmd_interpolate(r, &scene, (field.all(), *on), components as u32, &output, (values.all(), count))?;
            }
            Ok(())
        })?;
        all.owners.extend(gpu.download::<u32>(&owners, output.owners)?);
        all.barycentrics.extend(gpu.download::<[f32; 4]>(&barycentrics, output.barycentrics)?);
        if let Some(values) = &values {
            all.values.extend(gpu.download::<f32>(values, values.all().part(0, 4 * components as u64 * n))?);
        }
        all.times.add(times);
        report(all.owners.len() as u64, points.len() as u64)?;
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn submissions_get_shorter_where_lists_get_longer() {
        assert_eq!([0, 1, 2048].map(points_at_once), [POINT_CHUNK; 3]);
        assert_eq!([4096, 1 << 20, u32::MAX].map(points_at_once), [POINT_CHUNK / 2, 2048, 1024]);
    }
}
