//! Drawing of a whole picture by means of [`super::cmd_render`]: allocates memory, and submits one round at a time until every
//! ray is done.

use super::{BLOCK, RenderInput, RenderMemory, Visibility, cmd_render_in};
use crate::build::{DeviceMesh, Tree, cmd_ranges, range_bytes};
use crate::error::{Error, Result};
use crate::gpu::{Arena, Buffer, BufferRef, DeviceKind, Gpu, Recorder};
use crate::grid::CellRange;
use crate::layout::{RayState, RenderStatus, wide};
use crate::mesh::{Field, Mesh, On};
use crate::query::searched::Searched;
use crate::query::{Progress, Rounds, SILENT, until_done, upload_field};
use crate::render::{PicturePlan, Prepared, RenderSettings, RenderStats, TABLE_SIZE, ValidTets};
use crate::times::StageTimes;
use bytemuck::Pod;

/// Rays that [`render`] draws at once, in about a second on a processor, so that no submission takes long. Fewer for
/// integrated GPUs, which may be slow, and whose systems end submissions that take seconds.
fn strip(gpu: &Gpu) -> u32 {
    if matches!(gpu.report().kind, DeviceKind::Discrete | DeviceKind::Cpu) { 1 << 20 } else { 1 << 18 }
}

/// A finished picture.
#[derive(Clone, Debug, Default)]
pub struct Rendered {
    /// Premultiplied colour and opacity, row 0 on top.
    pub colors: Vec<[f32; 4]>,
    /// Numbers of samples.
    pub stats: RenderStats,
    /// What it took, on the device.
    pub times: StageTimes,
}

/// The rays of a picture in host memory, kept from one block of a mesh to the next.
pub(crate) struct Rays {
    /// Premultiplied colour and opacity, row 0 on top.
    pub(crate) colors: Vec<[f32; 4]>,
    /// As in [`RenderMemory::rays`].
    states: Vec<RayState>,
}

impl Rays {
    /// The rays before the first block.
    ///
    /// # Errors
    /// [`Error::TooLarge`] for 2^31 pixels and more.
    pub(crate) fn new(size: [u32; 2]) -> Result<Self> {
        let fresh = RayState { last: u32::MAX, ..RayState::default() };
        Ok(Self { colors: vec![[0.0; 4]; size[0] as usize * size[1] as usize], states: vec![fresh; super::rays(size)? as usize] })
    }
}

/// A mesh, its structure and a field in device memory, ready to draw a whole picture or strips of one.
pub(crate) struct Canvas<'a> {
    gpu: &'a Gpu,
    searched: Searched,
    plan: &'a PicturePlan,
    field: (Buffer, On),
    normals: Option<Buffer>,
    uniforms: [Buffer; 3],
    ranges: Option<BufferRef>,
    memory: RenderMemory,
    buffer: Buffer,
    /// Rows of a strip.
    rows: u32,
    /// Whether the memory has the marks of the visible nodes, which strips have in common.
    marked: bool,
    stats: RenderStats,
    times: StageTimes,
}

impl<'a> Canvas<'a> {
    /// Prepares a picture, or strips of it with as many rows as the memory that is left allows.
    ///
    /// # Errors
    /// As [`render`].
    pub(crate) fn new(
        gpu: &'a Gpu,
        searched: &Searched,
        plan: &'a PicturePlan,
        (values, on): (&[f32], On),
        normals: Option<&[[f32; 3]]>,
        in_strips: bool,
    ) -> Result<Self> {
        let mesh = &searched.mesh.input;
        if plan.table.len() != TABLE_SIZE {
            return Err(Error::Invalid(format!("a transfer function of {} colours; there are {TABLE_SIZE}", plan.table.len())));
        }
        if let Some(normals) = normals.filter(|n| n.len() != mesh.points as usize) {
            return Err(Error::Invalid(format!("{} normals where the mesh has {} points", normals.len(), mesh.points)));
        }
        let field = upload_field(gpu, mesh, (values, on))?;
        let normals = normals.map(|n| gpu.upload("olbvh.query.normals", n)).transpose()?;
        let uniforms = [
            gpu.upload("olbvh.query.view", &[plan.view()])?,
            gpu.upload("olbvh.query.table", &plan.table)?,
            gpu.upload("olbvh.query.drawn", &plan.visible_values)?,
        ];
        let skipped = searched.octree().filter(|_| plan.hides(values));
        let carve = |a: &mut Arena, rows: u32| {
            let memory = RenderMemory::carve(a, [plan.size[0], rows], skipped.map(|tree| &tree.capacity))?;
            Ok((memory, skipped.map(|tree| a.take(range_bytes(tree.capacity.nodes))).transpose()?))
        };
        let in_strips = in_strips && searched.octree().is_some();
        let mut rows = if in_strips { strip_rows(strip(gpu), plan.size) } else { plan.size[1] }.max(1);
        let left = gpu.memory_left(); // once: other threads allocate and free
        while in_strips && rows > BLOCK && Arena::measure(|a| carve(a, rows))? > left - left / 4 {
            rows = rows.div_ceil(2).next_multiple_of(BLOCK);
        }
        let buffer = gpu.buffer("olbvh.query.picture", Arena::measure(|a| carve(a, rows))?)?;
        let (memory, ranges) = carve(&mut Arena::new(buffer.all()), rows)?;
        let (stats, times) = (RenderStats::default(), StageTimes::default());
        let mut canvas =
            Self { gpu, searched: *searched, plan, field, normals, uniforms, ranges, memory, buffer, rows, marked: false, stats, times };
        canvas.gather_ranges()?;
        Ok(canvas)
    }

    /// Computes the range of the field in every node, if nodes are skipped.
    fn gather_ranges(&mut self) -> Result<()> {
        if let (Some(tree), Some(ranges)) = (self.searched.octree(), self.ranges) {
            let field = (self.field.0.all(), self.field.1);
            let ((), times) = self.gpu.submit("olbvh.query.ranges", |r| cmd_ranges(r, &self.searched.mesh, tree, field, ranges))?;
            self.times.add(times);
        }
        Ok(())
    }

    /// Draws a picture of this size from this row of the view on, or what a block with these cells has of it. `report`
    /// receives the number of rays done and their total.
    fn draw(&mut self, size: [u32; 2], row: u32, cells: Option<CellRange>, report: Progress<'_>) -> Result<()> {
        let Self { gpu, searched, plan, memory, stats, times, .. } = self;
        let [view, table, values] = self.uniforms.each_ref().map(Buffer::all);
        let input = RenderInput {
            size,
            row,
            normals: self.normals.as_ref().map(Buffer::all),
            visibility: self.ranges.map(|ranges| Visibility { ranges, values, count: plan.visible_values.len() as u32 }),
            ..RenderInput::of(plan, view, table, (self.field.0.all(), self.field.1))
        };
        let marked = self.marked;
        let begin = |r: &mut Recorder<'_>| cmd_render_in(r, searched, &input, cells, marked, memory, Rounds::begin(0));
        times.add(gpu.submit("olbvh.query.intervals", begin)?.1);
        self.marked = true;
        let rays = u64::from(size[0]) * u64::from(size[1]);
        let round = |r: &mut Recorder<'_>, _| cmd_render_in(r, searched, &input, cells, marked, memory, Rounds::resume(1));
        let status = until_done(gpu, "olbvh.query.march", 1, times, round, || {
            let status: RenderStatus = gpu.download_one(&self.buffer, memory.status)?;
            report(rays.saturating_sub(u64::from(status.unfinished)), rays)?;
            Ok((status.unfinished == 0).then_some(status))
        })?;
        stats.samples += wide(status.samples);
        stats.skipped_samples += wide(status.skipped);
        stats.found_samples += wide(status.found);
        Ok(())
    }

    /// Draws the samples in these cells, strip by strip. Strips are left out if `met` marks none of their rows as
    /// meeting the block with something left to draw.
    ///
    /// # Errors
    /// A failed Vulkan call, or too little memory for transfers. `rays` then holds what is done; drawing the block
    /// again with these rays does not take the same samples again.
    pub(crate) fn draw_part(mut self, cells: CellRange, met: &[bool], rays: &mut Rays) -> Result<(RenderStats, StageTimes)> {
        let [width, height] = self.plan.size;
        for row in (0..height).step_by(self.rows as usize) {
            let size = [width, self.rows.min(height - row)];
            if !met.iter().skip(row as usize).take(size[1] as usize).any(|&met| met) {
                continue;
            }
            let first = [row as usize * width as usize, super::rays([width, row])? as usize];
            let pixels = first[0]..first[0] + size[0] as usize * size[1] as usize;
            let items = first[1]..first[1] + super::rays(size)? as usize;
            let (colors, states) = (&mut rays.colors[pixels], &mut rays.states[items]);
            self.gpu.write(&mut self.buffer, self.memory.colors.offset, colors)?;
            self.gpu.write(&mut self.buffer, self.memory.rays.offset, states)?;
            self.draw(size, row, Some(cells), SILENT)?;
            // Both are read before either is stored: colours with older states would get the same samples again.
            let drawn = self.first(self.memory.colors, colors.len())?;
            let reached = self.first(self.memory.rays, states.len())?;
            colors.copy_from_slice(&drawn);
            states.copy_from_slice(&reached);
        }
        Ok((self.stats, self.times))
    }

    /// Reads back the first items of a part of the memory.
    fn first<T: Pod>(&self, part: BufferRef, count: usize) -> Result<Vec<T>> {
        self.gpu.download(&self.buffer, part.part(0, (count * size_of::<T>()) as u64))
    }
}

/// Rows of a strip of about this many rays.
fn strip_rows(rays: u32, [width, height]: [u32; 2]) -> u32 {
    (rays / width.max(1)).max(1).next_multiple_of(BLOCK).min(height)
}

/// The plan of a picture of a field of `mesh`, which was uploaded as `device`, and the normals that its light needs. Reads
/// back what is on the surface. A renderer that draws frame after frame makes plans itself, as the crate's front page says.
///
/// # Errors
/// Those of [`Prepared::new`], or a failed transfer.
pub fn prepare_picture(device: &DeviceMesh, mesh: &Mesh, field: &Field, settings: &RenderSettings) -> Result<Prepared> {
    let bad = if device.status().bad == 0 { Vec::new() } else { device.bad_cells()? };
    // Light and opacity of a volume depend on where the surface is; those of iso-surfaces do not.
    let neighbours = if settings.iso.is_empty() { device.neighbours()? } else { Vec::new() };
    let is_valid = |tet: u32| bad.binary_search(&tet).is_err();
    Prepared::new(settings, mesh, &ValidTets { bounds: device.grid().into(), neighbours: &neighbours, is_valid: &is_valid }, field)
}

/// Draws a plan of a field (values per point or per tetrahedron) over the mesh of a tree. `normals` has one normal per
/// point, for light; without any, colours are not lit. `report` receives the number of rays done and their total.
///
/// ```no_run
/// use olbvh::{BadCells, BuildOptions, DeviceMesh, Fineness, Gpu, GpuOptions, Tree, formats, query, render::RenderSettings};
///
/// # fn main() -> olbvh::Result<()> {
/// let mesh = olbvh::mesh::kuhn([32, 32, 32])?;
/// let field = &mesh.fields[0];
/// let gpu = Gpu::new(&GpuOptions::default())?;
/// let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip)?;
/// let tree = Tree::build(&gpu, &device, &BuildOptions { fineness: Fineness::Pictures, slabs: true, ..Default::default() })?;
/// let picture = query::prepare_picture(&device, &mesh, field, &RenderSettings { size: [800, 600], ..Default::default() })?;
/// let drawn = query::render(&tree, &picture.plan, (&field.values, field.on), Some(&picture.normals), query::SILENT)?;
/// formats::write_png("jet.png", 800, 600, &picture.plan.pixels(&drawn.colors, 1))
/// # }
/// ```
///
/// # Errors
/// [`Error::Memory`], [`Error::TooLarge`], a failed Vulkan call, or [`Error::Invalid`] if field, normals or transfer
/// function have the wrong length.
pub fn render(
    tree: &Tree,
    plan: &PicturePlan,
    field: (&[f32], On),
    normals: Option<&[[f32; 3]]>,
    report: Progress<'_>,
) -> Result<Rendered> {
    render_in(tree.gpu(), &tree.into(), plan, field, normals.filter(|normals| !normals.is_empty()), report)
}

/// [`render`], with any structure.
pub(crate) fn render_in(
    gpu: &Gpu,
    searched: &Searched,
    plan: &PicturePlan,
    field: (&[f32], On),
    normals: Option<&[[f32; 3]]>,
    report: Progress<'_>,
) -> Result<Rendered> {
    let [width, height] = plan.size;
    let rays = u64::from(width) * u64::from(height);
    super::rays(plan.size)?;
    if !plan.rays.is_finite(plan.size) {
        return Err(Error::Invalid("rays that are no finite numbers; the camera's matrix may have no inverse".into()));
    }
    let mut canvas = Canvas::new(gpu, searched, plan, field, normals, rays > u64::from(strip(gpu)))?;
    let mut colors = Vec::with_capacity(rays as usize);
    for row in (0..height).step_by(canvas.rows as usize) {
        let size = [width, canvas.rows.min(height - row)];
        let before = colors.len() as u64;
        canvas.draw(size, row, None, &|done, _| report(before + done, rays))?;
        colors.extend(canvas.first::<[f32; 4]>(canvas.memory.colors, size[0] as usize * size[1] as usize)?);
    }
    log::debug!("picture: {}", canvas.times);
    Ok(Rendered { colors, stats: canvas.stats, times: canvas.times })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::BadCells;
    use crate::gpu::GpuOptions;
    use crate::layout::{DrawUniforms, ViewUniforms};
    use crate::mesh::kuhn_jittered;
    use crate::options::BuildOptions;
    use crate::render::interval_slack;

    #[test]
    fn the_device_makes_of_a_view_what_the_reference_does() {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap();
        let mesh = kuhn_jittered([6, 5, 4], 0.3, 5).unwrap();
        let device = DeviceMesh::upload(&gpu, &mesh, BadCells::Skip).unwrap();
        let tree = Tree::build(&gpu, &device, &BuildOptions::default()).unwrap();
        let settings = RenderSettings { size: [37, 29], ..RenderSettings::default() };
        let plan = prepare_picture(&device, &mesh, &mesh.fields[0], &settings).unwrap().plan;
        let mut canvas = Canvas::new(&gpu, &(&tree).into(), &plan, (&mesh.fields[0].values, On::Points), None, false).unwrap();
        canvas.draw(plan.size, 0, None, SILENT).unwrap();
        let frame = canvas.memory.frame;
        assert_eq!(canvas.first::<ViewUniforms>(frame, 1).unwrap(), [plan.view()]);
        let made = canvas.first::<DrawUniforms>(frame.part(size_of::<ViewUniforms>() as u64, frame.size()), 1).unwrap()[0];
        let [x, y, z] = interval_slack(tree.grid());
        assert_eq!((made.slack, made.size), ([x, y, z, 0.0], plan.size));
    }
}
